"""The numbers of the page of limits, from made-up measurements."""

from paper_figures.report import limits


def test_limits_are_counted_and_compared():
    changes = {"inside": (0.001, 0.002), "beyond": (0.0041, 0.03, 0.0039)}
    rows = [{"where": where, "change": change} for where, group in changes.items() for change in group]
    text = limits.hard_cases_text({"accuracy": "standard", "map": rows})
    assert text.startswith("2 of 3 random cases far beyond it at `standard` (0.4 %)")
    assert text.endswith("at most by 3.0 %; none of 2 inside")
    tools = [
        {"setting": name, "errors": {"pull_off_force": {"p95": p95, "largest": 2 * p95}}}
        for name, p95 in (("0.05", 0.07), ("draft", 0.008))
    ]
    text = limits.draft_text({"tools": tools, "protocols": 9})
    assert text == "by 0.8 % (95th percentile) and by at most 1.6 % on 9 held-out protocols"

import json

import pytest

from paper_figures import drawing, reproduction, reproduction_report
from surrogate.architectures.naming import PAPER_PARAMETER_COUNTS


@pytest.mark.parametrize(
    ("rule", "theirs", "ours", "expected"),
    [
        ("count", 18, 18, "reproduced"),
        ("count", 18, 17, "differs"),
        ("value", 1.0, 1.09, "reproduced"),
        ("value", 1.0, 0.8, "differs"),
        ("error", 2.2, 2.7, "reproduced"),
        ("error", 2.2, 1.0, "better"),
        ("error", 2.2, 3.0, "differs"),
        ("cost", 478, 0.05, "better"),
        ("bound", 1.0, 0.4, "reproduced"),
        ("bound", 1.0, 1.4, "differs"),
        ("text", "M4", "M4", "reproduced"),
        ("text", "true", True, "reproduced"),
        ("text", "M4", "M3", "differs"),
        ("none", 3.0, 3.0, "not comparable"),
    ],
)
def test_verdicts(rule, theirs, ours, expected):
    assert reproduction.verdict(rule, theirs, ours) == expected


def test_every_claim_is_complete():
    claims = [*reproduction.text_claims(), *reproduction.table_claims()]
    assert len(claims) > 140
    for claim in claims:
        assert {"group", "place", "says", "value", "rule", "why"} <= claim.keys(), claim
        assert claim["rule"] in reproduction.RULES
        assert claim["why"].endswith("."), claim["says"]
        source = claim.get("source", "")
        assert source.partition(":")[0] in reproduction.SOURCES or (claim["rule"] == "none" and not source)


def test_parameter_counts_are_those_of_the_surrogate_package():
    stated = {c["says"].removeprefix("parameters of "): c["value"] for c in reproduction.text_claims()}
    assert {name: stated[name] for name in PAPER_PARAMETER_COUNTS} == PAPER_PARAMETER_COUNTS
    model = drawing.paper_values("reference_model")
    assert model["parameters"] == stated[model["name"]]


def test_what_is_not_computed_yet_is_said_to_be_missing(tmp_path):
    results = reproduction.Results(tmp_path, tmp_path)
    claim = {"value": 7.0, "rule": "value", "source": "features:summary/factor_a_over_d", "why": "."}
    finding = reproduction.judge(claim, results)
    assert (finding.verdict, finding.ours) == ("not yet", None)
    assert "make feature-sets" in finding.why
    text = reproduction_report.report(results)
    assert "**reproduced**" not in text
    assert "## Slips of the paper" in text


def test_numbers_come_from_result_files(tmp_path):
    path = tmp_path / "studies" / "error_statistics.json"
    path.parent.mkdir()
    content = {"trajectories": 1245, "overall": {"hysteresis_percent": {"median": 0.5}}, "quartiles": {}}
    path.write_text(json.dumps(content), encoding="utf-8")
    text = reproduction_report.report(reproduction.Results(tmp_path, tmp_path))
    (line,) = [line for line in text.splitlines() if "median hysteresis error" in line]
    assert "| 1.1 % | 0.5 % | 0.45 | **better** |" in line


def test_reductions():
    layers = [{"name": "a", "parameters": 3}, {"name": "b", "parameters": 4}, {"name": "c", "parameters": 9}]
    assert reproduction._reduced(layers, {"layers": ["a", "b"]}) == 7
    assert reproduction._reduced([1.0, 2.0], {"op": "length"}) == 2
    assert reproduction._reduced([0.01, 100.0], {"op": "decades"}) == pytest.approx(4.0)
    assert reproduction._reduced(7200.0, {"scale": 1 / 3600}) == pytest.approx(2.0)

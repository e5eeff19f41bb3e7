import json
import re

import pytest

from experiments.__main__ import studies
from experiments.paper_numbers import paper_claims, stated, with_stated
from experiments.trainings.ranking import contenders
from paper_figures.report import claims as reproduction
from paper_figures.report import write as reproduction_report
from paper_figures.style import drawing
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
        ("least", 3.0, 3.5, "reproduced"),
        ("least", 3.0, 2.5, "differs"),
        ("none", 3.0, 3.0, "not comparable"),
    ],
)
def test_verdicts(rule, theirs, ours, expected):
    assert reproduction.verdict(rule, theirs, ours) == expected


def test_an_unknown_rule_is_refused():
    with pytest.raises(ValueError, match=r"a rule must be one of count, value, .*; received 'most'"):
        reproduction.verdict("most", 3.0, 3.0)


RESULTS = studies()
CLAIMS = [*reproduction.text_claims(), *reproduction.table_claims()]


def test_claims_are_complete():
    assert len(CLAIMS) > 140
    for claim in CLAIMS:
        assert {"group", "place", "says", "rule", "why"} <= claim.keys(), claim
        assert "value" in claim or claim.get("beyond"), claim["says"]
        assert claim["rule"] in reproduction.RULES
        source = claim.get("source", "")
        assert source.partition(":")[0] in RESULTS or (claim["rule"] == "none" and not source)
    for claim in CLAIMS:
        assert claim["why"].endswith("."), claim["says"]
        assert not re.search(r"\d", re.sub("M1-concat|18 paper models", "", claim["why"])), claim["why"]


def test_tolerances_and_places_of_claims():
    for claim in (*CLAIMS, *drawing.paper_values("claims")["rules"].values()):
        assert (claim.get("tolerance", 0.0) > 0.1) == ("because" in claim), claim
    (claim,) = [claim for claim in CLAIMS if claim["says"].startswith("orders of magnitude")]
    assert reproduction_report.tolerance_text(claim) == "20 %: the paper says about three orders"
    numbers = drawing.paper_values("structure")
    for entry in (*CLAIMS, *reproduction.settings(), *drawing.paper_values("slips")["slip"]):
        for heading, number in re.findall(r"(section|appendix) ([A-H1-5](?:\.\d)?)", entry["place"]):
            assert number in numbers[heading], entry["place"]
    placed = {claim["says"]: claim["place"] for claim in CLAIMS}
    assert placed["epochs any model needed, at most"] == "appendix D"
    assert placed["best conditioning of M4"].endswith("appendix C")


def test_claim_numbers_are_transcribed_once():
    paper = {name: drawing.paper_values(name) for name in ("dataset", "reference_model", "cost")}
    numbers = {(name, key): value for name, values in paper.items() for key, value in values.items()}
    written = [claim for claim in paper_claims() if "value" in claim]
    once = {"dataset": ("trajectories", "cpu_hours"), "reference_model": ("mse", "mae"), "cost": ("surrogate_seconds",)}
    for key in [(name, key) for name, keys in once.items() for key in keys]:
        assert [claim["says"] for claim in written if claim["value"] == numbers[key]] == [], key
    with pytest.raises(ValueError, match="received 'dataset:nothing'"):
        stated("dataset:nothing")
    assert with_stated("{cost:surrogate_seconds} s") == "0.16 s"


@pytest.fixture
def results(tmp_path):
    """No results, but those that a test puts into `read`."""
    return reproduction.Results(tmp_path, tmp_path)


def test_common_reasons_stand_above_table():
    def finding(number, why, verdict="better"):
        claim = {"says": f"row {number}", "place": "table 1", "value": 2.0, "rule": "cost"}
        return reproduction.Finding(claim, 1.0, verdict, why)

    text = reproduction_report.section("Costs", [finding(1, "Another processor."), finding(2, "Another processor.")])
    assert text.startswith(
        "## Costs\n\nAnother processor. Tolerance: 25 %.\n\n| what | place | paper | here | ratio | verdict |\n"
    )
    assert text.endswith("| row 2 | table 1 | 2 | 1 | 0.5 | **better** |")
    text = reproduction_report.section(
        "Costs", [finding(1, "`make it`.", "not yet"), finding(2, "`make it`.", "not yet")]
    )
    assert text.startswith("## Costs\n\nTolerance: 25 %.\n\n")
    assert text.count("| `make it`. |") == 2


def test_settings_are_not_counted(results):
    results.read["adopted_settings"] = {"recipe": {"batch_size": 8, "epochs": 100}}
    findings = {claim["says"]: reproduction.judge(claim, results) for claim in CLAIMS}
    assert "batch size" not in findings
    text = reproduction_report.report(results)
    (recipe,) = [line for line in text.splitlines() if line.startswith("| recipe |")]
    paper, ours = recipe.split(" | ")[2:4]
    assert "batch size 8" in paper
    assert "batch size" not in ours
    assert "epochs, at most 100" in ours
    assert "optimizer not yet" in ours
    counted = sum(finding.counted for finding in findings.values())
    assert f"{counted} numbers:" in text
    assert text.index("## Beyond the paper") > text.index("## Crack velocities")


def test_differently_trained_stand_beside(results):
    sentence = "M2-concat is left out."
    study = {"models": {}, "beside": {"M1-concat-inputs-C": {"mse": 2e-4}}, "outdated": {"M2-concat": sentence}}
    results.read["model_comparison"] = study
    text = reproduction_report.report(results)
    assert sentence in text
    (line,) = [line for line in text.splitlines() if "from the inputs C: held-out MSE" in line]
    assert "| 5.00e-04 | 2.00e-04 | 0.4 |" in line
    (line,) = [line for line in text.splitlines() if "ten times the trajectories: held-out MSE" in line]
    assert "`make model-large` makes it." in line


def test_parameter_counts_equal_surrogate():
    stated = {c["says"].removeprefix("parameters of "): c.get("value") for c in reproduction.text_claims()}
    assert {name: stated[name] for name in PAPER_PARAMETER_COUNTS} == PAPER_PARAMETER_COUNTS
    model = drawing.paper_values("reference_model")
    assert model["parameters"] == stated[model["name"]]


def test_missing_results_are_stated(results):
    claim = {"value": 7.0, "rule": "value", "source": "feature_sets:summary/factor_a_over_d", "why": "."}
    finding = reproduction.judge(claim, results)
    assert (finding.verdict, finding.ours) == ("not yet", None)
    assert "make feature-sets" in finding.why
    text = reproduction_report.report(results)
    assert "**reproduced**" not in text
    assert "## Inconsistencies of the paper" in text


def test_numbers_come_from_result_files(tmp_path):
    path = tmp_path / "studies" / "error_statistics.json"
    path.parent.mkdir()
    by_recipe = {"trajectories": 1245, "overall": {"hysteresis_percent": {"median": 0.5}}, "quartiles": {}}
    study = {"overall": {"hysteresis_percent": {"median": 0.3}}, "by_paper_recipe": by_recipe}
    path.write_text(json.dumps(study), encoding="utf-8")
    text = reproduction_report.report(reproduction.Results(tmp_path, tmp_path))
    (line,) = [line for line in text.splitlines() if line.startswith("| median hysteresis error")]
    assert "| 1.1 % | 0.5 % | 0.3 % | 0.45 | 25 % | **better** |" in line
    reproduction_report.main(tmp_path, tmp_path / "published", tmp_path / "report.md")
    assert line in (tmp_path / "report.md").read_text(encoding="utf-8")


def test_table_rows_match_our_rows(results):
    regimes = [{"seconds": {"solver": float(n), "keras_call": -float(n)}} for n in range(1, 13)]
    points = [{"crack_velocity": 0.0, "own_crack_velocity": 10.0 * n} for n in range(1, 15)]
    results.read = {"canonical_regimes": {"regimes": regimes}, "persson_brener": {"points": points}}
    ours = {claim["says"]: results.find(claim) for claim in reproduction.table_claims()}
    assert (ours["sample (5), solver"], ours["sample (5), plain Keras call"]) == (5.0, -5.0)
    assert ours["crack velocity of point 3"] == 30.0


def test_reductions_and_comparisons(results):
    layers = [{"name": "a", "parameters": 3}, {"name": "b", "parameters": 4}, {"name": "c", "parameters": 9}]
    assert reproduction._reduced(layers, {"layers": ["a", "b"]}) == 7
    assert reproduction._reduced([1.0, 2.0], {"op": "length"}) == 2
    assert reproduction._reduced([0.01, 100.0], {"op": "decades"}) == pytest.approx(4.0)
    assert reproduction._reduced([75, 1.55125], {"op": "join"}) == "75, 1.55125"
    assert reproduction._reduced(7200.0, {"scale": 1 / 3600}) == pytest.approx(2.0)
    results.read = {"dataset_statistics": {"hours": 6.0}, "ranking": {"hours": 2.0, "most": None}}
    assert results.find({"source": "dataset_statistics:hours", "over": "ranking:hours"}) == 3.0
    assert results.find({"source": "dataset_statistics:hours", "than": "ranking:hours"}) is True
    claim = {"source": "dataset_statistics:hours", "over": "ranking:most", "rule": "value", "value": 80, "why": "."}
    assert "`make ranking` makes it." in reproduction.judge(claim, results).why


def test_model_beside_the_18_keeps_its_name():
    beside = [
        (claim["says"], re.split("[:/]", claim["source"])[2])
        for claim in reproduction.text_claims()
        if claim.get("beyond")
        and claim.get("source", "").startswith(("model_comparison:beside/", "training_cost:core_minutes/M1-concat-"))
    ]
    assert {"M1-concat-large", "M1-concat-paper"} <= {name for _, name in beside}
    assert all(says.startswith(f"{name}, ") for says, name in beside), beside


RANKED = [claim for claim in CLAIMS if "ranking" in claim]


def test_rankings_of_report_are_of_the_study(results):
    assert {claim["ranking"].partition("/")[0] for claim in RANKED} == {
        "best_model",
        "second_family",
        "best_conditioning",
        "concatenation_suffices",
        "best_input",
        "d_better_than_c",
    }
    for claim in RANKED:
        first, by_label = contenders(claim)
        assert first in by_label
    text = reproduction_report.report(results)
    lines = {line.split(" | ")[0].strip("| "): line for line in text.splitlines()}
    assert "**not yet** ‡" in lines["best conditioning of M2"]
    assert "‡" not in lines["best conditioning of M4"]


@pytest.mark.parametrize(
    ("decision", "ours"),
    [
        ("holds", "M1-concat, holds"),
        ("tie", "M1-concat = M1-FiLM, tie"),
        ("fails", "M6-concat, fails"),
        ("not decided", "M1-FiLM, one training each"),
        (None, "M1-FiLM, one training each"),
    ],
)
def test_decision_by_seeds_stands_beside(decision, ours, results):
    (claim,) = (claim for claim in RANKED if claim["ranking"] == "best_model")
    ranked = {"paper": "M1-concat", "first": "M6-concat", "level": ["M1-concat", "M1-FiLM"], "decision": decision}
    study = {"claims": {"best_model": ranked}} if decision else None
    results.read = {"model_comparison": {"comparison": {"best": "M1-FiLM"}}, "ranking": study}
    finding = reproduction.judge(claim, results)
    assert (finding.verdict, finding.ours, finding.by_ours) == ("not yet", None, ours)
    assert finding.why == "`make models RECIPE=paper` trains what is missing: 18."


@pytest.mark.parametrize(
    ("c_over_d", "verdict", "ours"),
    [(1.3, "reproduced", "true"), (1.1, "tie", "D = C"), (0.95, "tie", "D = C"), (0.8, "differs", "false")],
)
def test_ranking_is_judged_by_paper_recipe(c_over_d, verdict, ours, results):
    (claim,) = (claim for claim in RANKED if claim["ranking"] == "d_better_than_c")
    spread = {
        "features-C": {"test_mse": {"min": 1.0, "max": 1.2}},
        "features-D": {"test_mse": {"min": 1.0, "max": 1.1}},
    }
    ranked = {"paper": "D", "first": "C", "level": ["D", "C"], "decision": "fails"}
    mse = {"features-D": 2e-4, "features-C": c_over_d * 2e-4}
    results.read = {
        "model_comparison": {"by_paper_recipe": {"mse": mse}},
        "ranking": {"claims": {"d_better_than_c": ranked}, "spread": spread},
    }
    finding = reproduction.judge(claim, results)
    assert (finding.verdict, finding.ours, finding.by_ours) == (verdict, ours, "false, fails")

import json
import os
import re
import sys

import pytest

from experiments.__main__ import studies
from experiments.common import read_result
from experiments.paper import dataset_statistics, error_statistics, model_comparison, recipe_seeds
from experiments.paper_numbers import paper_claims, stated, with_stated
from experiments.trainings.ranking import contenders
from paper_figures.__main__ import modules
from paper_figures.report import claims as reproduction
from paper_figures.report import write as reproduction_report
from paper_figures.style import drawing
from surrogate.architectures.naming import PAPER_PARAMETER_COUNTS
from tests.processes import ROOT, ended


@pytest.mark.parametrize(
    ("rule", "theirs", "ours", "expected"),
    [
        ("count", 18, 18, "reproduced"),
        ("count", 18, 17, "differs"),
        ("value", 1.0, 1.09, "reproduced"),
        ("value", 1.0, 0.8, "differs"),
        ("error", 2.2, 2.7, "reproduced"),
        ("error", 2.2, 1.0, "smaller"),
        ("error", 2.2, 3.0, "differs"),
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
    (claim,) = [claim for claim in CLAIMS if claim["says"] == "orders of magnitude between solver and surrogate"]
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
    def finding(number, why, verdict="smaller"):
        claim = {"says": f"row {number}", "place": "table 1", "value": 2.0, "rule": "error"}
        return reproduction.Finding(claim, 1.0, verdict, why)

    text = reproduction_report.section("Costs", [finding(1, "Another processor."), finding(2, "Another processor.")])
    assert text.startswith(
        "### Costs\n\nAnother processor. Tolerance: 25 %.\n\n| what | place | paper | here | ratio | verdict |\n"
    )
    assert text.endswith("| row 2 | table 1 | 2 | 1 | 0.5 | **smaller** |")
    text = reproduction_report.section(
        "Costs", [finding(1, "`make it`.", "not yet"), finding(2, "`make it`.", "not yet")]
    )
    assert text.startswith("### Costs\n\nTolerance: 25 %")
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
    places = [text.index(f"### {group}") for group in ("Crack velocities", "Seconds of other", "Beyond the paper")]
    assert places == sorted(places)


def test_outdated_models_are_named(results):
    sentence = "M2-concat is left out."
    study = {"models": {}, "beside": {}, "outdated": {"M2-concat": sentence}}
    results.read["model_comparison"] = study
    text = reproduction_report.report(results)
    assert sentence in text


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
    parts = {"paper": 0.5, "swift": 0.3}
    study = {name: {"overall": {"hysteresis_percent": {"median": median}}} for name, median in parts.items()}
    path.write_text(json.dumps(study), encoding="utf-8")
    text = reproduction_report.report(reproduction.Results(tmp_path, tmp_path))
    first, line = [line for line in text.splitlines() if line.startswith("| median hysteresis error")]
    assert first.startswith("| median hysteresis error | 1.1 % | 0.5 % | **smaller** |")
    assert "| 1.1 % | 0.5 % | 0.3 % | 0.45 | 25 %" in line
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
    lines |= {line.split(" | ")[0].strip("| "): line for line in text.splitlines() if "section 3.1" in line}
    assert "**not yet** ‡" in lines["best conditioning of M2"]
    assert "‡" not in lines["best conditioning of M4"]


def decided(decision, first="M6-concat", lacking=(), seeds=3):
    level = ["M1-concat", "M1-FiLM"]
    return {"lacking": list(lacking), "decision": decision, "first": first, "level": level, "seeds": seeds}


@pytest.mark.parametrize(
    ("decision", "verdict", "ours"),
    [
        ("holds", "reproduced", "M1-concat"),
        ("tie", "tie", "M1-concat = M1-FiLM"),
        ("fails", "differs", "M6-concat"),
        ("not decided", "undecided", "M6-concat first"),
    ],
)
def test_ranking_is_judged_by_paper_recipe(decision, verdict, ours, results):
    (claim,) = (claim for claim in RANKED if claim["ranking"] == "best_model")
    row = {"model": "M6-concat", "removed": "elsewhere"}
    by_seeds = {"claims": {"best_model": decided("tie")}}
    results.read = {
        "recipe_seeds": {"claims": {"best_model": decided(decision)}, "trainings": [row]},
        "ranking": by_seeds,
    }
    finding = reproduction.judge(claim, results)
    assert (finding.verdict, finding.ours, finding.beside) == (verdict, ours, "M1-concat = M1-FiLM, tie")
    assert reproduction_report.verdict_text(finding) == f"**{verdict}** ‡†"
    assert finding.why == "Seeds and test trajectories are resampled together."
    results.read["recipe_seeds"]["claims"]["best_model"] = decided(decision, seeds=1)
    assert reproduction.judge(claim, results).why.startswith("One training each")
    results.read["recipe_seeds"] = {"claims": {"best_model": decided(None, lacking=["M4-FiLM"])}, "trainings": []}
    finding = reproduction.judge(claim, results)
    assert (finding.verdict, finding.why) == ("not yet", "`make models RECIPE=paper` trains what is missing: 1.")
    assert reproduction_report.verdict_text(finding) == "**not yet** ‡"


@pytest.mark.parametrize(
    ("others", "verdict"), [((4e-4, 1e-4), "not comparable"), ((2e-4, 1e-4), "smaller"), ((), "not yet")]
)
def test_verdict_holds_for_every_threshold(others, verdict, results):
    (claim,) = (claim for claim in CLAIMS if claim["says"] == "held-out MSE of M1-concat")
    results.read = {
        "model_comparison": {"beside": {"M1-concat-paper": {"mse": 1.1e-4}}},
        "open_choices": {"thresholds": {str(index): {"mse": mse} for index, mse in enumerate(others)}},
    }
    assert reproduction.judge(claim, results).verdict == verdict


def test_seconds_stand_beside_the_papers_method(results):
    (claim,) = (claim for claim in CLAIMS if claim["says"] == "sample (4), solver")
    results.read = {
        "canonical_regimes": {"regimes": [{"seconds": {"solver": 0.003}}] * 12},
        "paper_method_times": {"protocols": {"4": {"paper_method": 0.5}}},
    }
    finding = reproduction.judge(claim, results)
    assert not finding.counted
    assert reproduction_report.row(finding, 2)[2:5] == ["6585 s", "0.5 s", "0.003 s"]


PAGE = reproduction_report.page_claims()
REPORT = (ROOT / "REPRODUCTION.md").read_text(encoding="utf-8")


def test_first_page_is_a_page():
    page = REPORT.partition(reproduction_report.FIRST_PAGE)[0]
    assert sum(bool(re.search(r"\w", word)) for word in page.split()) <= 450
    says = {claim["says"] for claim in CLAIMS}
    rows = {line.split(" | ")[0].strip("| "): line.split(" | ") for line in page.splitlines()}
    for claim in PAGE:
        assert claim.get("finding", next(iter(says))) in says
        assert len(rows[claim["says"]][-1].strip(" |").split()) <= 10, claim["says"]
        words = [claim["why"]] if isinstance(claim["why"], str) else claim["why"].values()
        ranked = [found for found in RANKED if found["says"] == claim.get("finding")]
        assert len(words) == 1 or {"reproduced", "differs", "not yet"} <= set(claim["why"])
        assert not ranked or isinstance(claim["why"], str) or {"tie", "undecided"} <= set(claim["why"])


def test_map_names_what_exists():
    says, groups = ({claim[key] for claim in CLAIMS} for key in ("says", "group"))
    for kind in ("shown", "equation"):
        for entry in drawing.paper_values("map")[kind]:
            assert set(entry.get("says", ())) <= says, entry["paper"]
            assert set(entry.get("groups", ())) <= groups, entry["paper"]
            assert entry.keys() & {"says", "groups", "verdict"}
            assert kind == "shown" or all((ROOT / file).is_file() for file in entry["files"]), entry["files"]
            assert kind == "equation" or entry["target"] in modules(), entry["target"]
    shown = [entry["target"] for entry in drawing.paper_values("map")["shown"]]
    targets = {target for target, module in modules().items() if ".figures." in module or ".models." in module}
    assert targets - {"figure-ranking", "figure-plateau"} <= set(shown)  # which the paper has not


def test_open_choices_have_their_numbers(results):
    for entry in drawing.paper_values("left_open")["choice"]:
        assert {"unsaid", "ours", "changes", "shown_by"} == entry.keys()
    text = REPORT.partition("## What the paper leaves open")[2].partition("\n## ")[0]
    assert len(text.splitlines()) > 10
    assert "not yet" not in text
    assert "{" not in text
    results.read = {"open_choices": {"best": ["M1-concat", "M6-FiLM"], "thresholds": {"1": {"mse": 1.24e-4}}}}
    filled = reproduction_report.filled("{open_choices:best}; {open_choices:thresholds/1/mse|.1e}", results)
    assert filled.startswith("M1-concat, M6-FiLM; 1.2e-04")


def test_report_is_of_what_is_published(tmp_path):
    """Rows of the numbers that neither the solver nor a network computes; another training or data set changes them."""
    published = ROOT / "published"
    dataset, models, config = published / "dataset.h5", published / "models", {"model": "M1-concat"}
    seeds = read_result(published / "ranking.json")
    content = {
        "dataset_statistics": dataset_statistics.study(dataset),
        "error_statistics": error_statistics.study(config, models, dataset),
        "model_comparison": model_comparison.study(models, dataset),
        "recipe_seeds": recipe_seeds.study(models, dataset, seeds),
    }
    results = reproduction.Results(tmp_path, published)
    results.read |= content
    known = [c for c in CLAIMS if c.get("source", "").partition(":")[0] in content and "thresholds" not in c]
    assert len(known) > 30
    lines = set(REPORT.splitlines())
    for group in dict.fromkeys(claim["group"] for claim in known):
        findings = [reproduction.judge(claim, results) for claim in CLAIMS if claim["group"] == group]
        says = {claim["says"] for claim in known}
        for line in reproduction_report.section(group, findings).splitlines():
            assert line.split(" | ")[0].strip("| ") not in says or line in lines, f"{line}: run `make report`"


NUMBER = re.compile(r"-?\d[\d,]*(?:\.\d+)?(?:e[+-]\d+)?")


def test_what_a_result_lacks_is_none(tmp_path):
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies" / "short.json").write_text('{"rows": [1.5]}', encoding="utf-8")
    results = reproduction.Results(tmp_path, tmp_path)
    assert [results.at(f"short:{place}") for place in ("rows/0", "rows/1", "other/0")] == [1.5, None, None]


def test_published_report_lacks_nothing():
    assert "not yet" not in REPORT


@pytest.mark.slow
def test_report_is_what_make_report_writes(tmp_path):
    """Words and verdicts; numbers up to what another processor changes."""
    environment = os.path.relpath(sys.prefix, ROOT)  # make takes no name with a space
    ended(
        "make",
        "-s",
        "-o",
        f"{environment}/.installed",
        f"VENV={environment}",
        "report",
        f"OUT={tmp_path}",
        f"REPORT={tmp_path}/R.md",
        cwd=ROOT,
        check=True,
    )
    written = (tmp_path / "R.md").read_text(encoding="utf-8")
    assert NUMBER.sub("#", written) == NUMBER.sub("#", REPORT)
    ours, theirs = ([float(number.replace(",", "")) for number in NUMBER.findall(text)] for text in (written, REPORT))
    assert ours == pytest.approx(theirs, rel=0.03)

"""The numbers of the page for reviewers, from copies of what is published with other verdicts in them."""

import json
import shutil

import pytest

from experiments.places import Places
from paper_figures.report import reproducibility
from paper_figures.report.reproducibility import recipe_table
from surrogate.prediction.files import PUBLISHED


def test_the_page_says_what_seeds_decide_and_what_they_do_not(tmp_path):
    """One order decided, and the others not, whatever is published by now."""
    folder = PUBLISHED.parent
    for name in ("ranking.json", "model_forces.json", "feature_sets.json"):
        shutil.copy(folder / name, tmp_path)
    (tmp_path / "measurements").mkdir()
    shutil.copy(folder / "measurements" / "step_length.json", tmp_path / "measurements")
    for metrics in folder.glob("models/*/metrics.json"):
        target = tmp_path / "models" / metrics.parent.name
        target.mkdir(parents=True)
        for name in ("metrics.json", "run.json"):
            shutil.copy(metrics.parent / name, target)
    ranked = json.loads((tmp_path / "ranking.json").read_text(encoding="utf-8"))
    for pair in ranked["pairs"]:
        pair["probability"]["test_mse"] = 0.0 if pair["claim"] == "d_better_than_c" else None
    for name, claim in ranked["claims"].items():
        claim |= {"decision": "fails", "first": "C"} if name == "d_better_than_c" else {"decision": "not decided"}
    (tmp_path / "ranking.json").write_text(json.dumps(ranked), encoding="utf-8")
    run = tmp_path / "models" / "M1-concat-paper" / "run.json"
    content = json.loads(run.read_text(encoding="utf-8")) | {"ended_by": "recipe"}
    run.write_text(json.dumps(content), encoding="utf-8")
    places = Places(published=tmp_path)

    def text_of(name):
        function = getattr(reproducibility, name)
        return function(**places.arguments(function, "docs-numbers"))

    lines = {line.split(" | ")[0].strip("| "): line for line in text_of("statements_text").splitlines()}
    assert text_of("statements_text").startswith(
        "- **Hold**: none.\n- **Are ties**: none.\n- **Fail**: D better than C.\n- **Are not"
    )
    assert "| **fails** | 1 of 1 | D before C: < 0.001 | C |" in lines["D better than C"]
    assert "ended by the recipe |" in text_of("training_table")
    assert text_of("recipe_table").splitlines()[2].startswith("| M1-concat | 280 | recipe | ")
    inputs = text_of("inputs_table").splitlines()
    assert [line.split(" | ")[0] for line in inputs[2:]] == ["| A", "| B", "| C", "| D", "| E"]
    assert inputs[-1].startswith("| E | D + step length | 1.00 | 1.00 | 1.00 | ")
    (tmp_path / "model_forces.json").unlink()
    with pytest.raises(FileNotFoundError, match="`make model-forces` makes it"):
        text_of("forces_text")


def test_the_orders_by_both_recipes_are_stated(tmp_path):
    def trained(name, mse, **run):
        folder = tmp_path / f"{name}-paper"
        folder.mkdir()
        test = {"mse": {"mean": mse}, "pull_off_force_percent": {"median": 2.0}}
        (folder / "metrics.json").write_text(json.dumps({"epochs": 9, "test": test}), encoding="utf-8")
        (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")

    spread = {"pull_off_percent": {"median": 1.0}}
    ranked = {
        "models": {"M1-concat": [{}], "M3-FiLM": [{}]},
        "spread": {
            name: spread | {"test_mse": {"median": mse}} for name, mse in (("M1-concat", 1e-4), ("M3-FiLM", 2e-4))
        },
    }
    assert recipe_table(tmp_path, ranked) == "None yet."
    trained("M1-concat", 4e-4, ended_by="recipe")
    trained("M3-FiLM", 3e-4)
    trained("M4-concat", 3e-4)
    *rows, _, text = recipe_table(tmp_path, ranked).splitlines()
    assert [row.split(" | ")[:3] for row in rows[2:]] == [
        ["| M1-concat", "9", "recipe"],
        ["| M3-FiLM", "9", "EPOCHS"],
    ]
    assert text == "Order by held-out MSE: M3-FiLM, M1-concat by the recipe `paper`; M1-concat, M3-FiLM by the seeds."

"""The numbers of the page for reviewers, from what is published, with other verdicts in it."""

from pathlib import Path

import pytest

from experiments.common import read_result
from experiments.paper.model_comparison import PAPER_TRAINED_INPUTS
from paper_figures.report import reproducibility
from paper_figures.report.reproducibility import recipe_table
from tests.experiments.models import write_model


def test_page_states_decisions_by_seeds(tmp_path):
    """One order decided, and the others not, whatever is published by now."""
    ranked = read_result(Path("published/ranking.json"))
    for pair in ranked["pairs"]:
        pair["probability"]["test_mse"] = 0.0 if pair["claim"] == "d_better_than_c" else None
    for name, claim in ranked["claims"].items():
        claim |= {"decision": "fails", "first": "C"} if name == "d_better_than_c" else {"decision": "not decided"}
    text = reproducibility.statements_text(tmp_path, ranked)
    assert text.startswith("- **Hold**: none.\n- **Are ties**: none.\n- **Fail**: none.\n- **Are not decided**: best")
    lines = {line.split(" | ")[0].strip("| "): line for line in text.splitlines()}
    assert "| not yet: 2 to train | - | - | - | **fails** | C | D before C: < 0.001 |" in lines["D better than C"]
    for features, mse in ("C", 1e-4), ("D", 2e-4):
        label = PAPER_TRAINED_INPUTS[features]
        write_model(tmp_path / label, mse, ended_by="recipe")
    text = reproducibility.statements_text(tmp_path, ranked)
    assert "- **Fail**: D better than C.\n" in text
    lines = {line.split(" | ")[0].strip("| "): line for line in text.splitlines()}
    apart = max(row["max"] / row["min"] for row in (ranked["spread"][f"features-{name}"]["test_mse"] for name in "CD"))
    assert f"| **fails** | C | 2.00 | {apart:.2f} | **fails** | C |" in lines["D better than C"]
    assert reproducibility.changes_text(tmp_path, ranked).endswith("on: nothing.")
    ranked["claims"]["d_better_than_c"]["decision"] = "tie"
    assert reproducibility.changes_text(tmp_path, ranked).endswith("on: D better than C (fails; by seeds tie).")
    with pytest.raises(FileNotFoundError, match="`make model-forces` makes it"):
        read_result(tmp_path / "model_forces.json")


def test_orders_by_both_recipes_are_stated(tmp_path):
    spread = {"pull_off_percent": {"median": 1.0}}
    ranked = {
        "models": {"M1-concat": [{}], "M3-FiLM": [{}]},
        "spread": {
            name: spread | {"test_mse": {"median": mse}} for name, mse in (("M1-concat", 1e-4), ("M3-FiLM", 2e-4))
        },
    }
    assert recipe_table(tmp_path, ranked) == "None yet."
    write_model(tmp_path / "M1-concat-paper", 4e-4, ended_by="recipe")
    write_model(tmp_path / "M3-FiLM-paper", 3e-4, device="a GPU")
    write_model(tmp_path / "M4-concat-paper", 3e-4)
    *rows, _, text = recipe_table(tmp_path, ranked).splitlines()
    assert [row.split(" | ")[:3] for row in rows[2:]] == [
        ["| M1-concat", "2", "recipe"],
        ["| M3-FiLM", "2", "EPOCHS, on a GPU"],
    ]
    assert text == "Order by held-out MSE: M3-FiLM, M1-concat by the recipe `paper`; M1-concat, M3-FiLM by the seeds."


def test_paper_training_has_its_own_column(tmp_path):
    assert reproducibility.training_table(tmp_path) == "Not trained yet: `make model-paper-recipe`."
    write_model(tmp_path / "M1-concat-paper", 2e-4, ended_by="recipe")
    *_, errors = reproducibility.training_table(tmp_path).splitlines()[:4]
    assert errors == "| held-out MSE | 5.00e-04 | 2.00e-04 |"
    write_model(tmp_path / "M1-concat-as-worded", 1e-4, ended_by="--epochs")
    epochs, errors = reproducibility.training_table(tmp_path).splitlines()[2:4]
    assert epochs.endswith("| 2, ended by the recipe | 2, stopped before the recipe's own end |")
    assert errors == "| held-out MSE | 5.00e-04 | 2.00e-04 | 1.00e-04 |"


def test_hours_by_paper_recipe_of_batches(tmp_path):
    for name, more in {"M1-concat": {}, "M1-FiLM": {"device": "a GPU"}, "M3-FiLM": {"device": "a GPU"}}.items():
        recipe = {"name": "paper", "batch_size": 8}
        write_model(tmp_path / f"{name}-paper", recipe=recipe, ended_by="recipe", **more)
    speed = {"recipe": "swift", "models": {}, "by_paper_recipe": {"M3-FiLM": {"median": 300.0}}}
    # Two epochs of 6 batches; nothing is known of M1-FiLM.
    assert reproducibility.hours_text(tmp_path, speed) == "M1-concat 0.033, M3-FiLM 1; 1 for these 2"

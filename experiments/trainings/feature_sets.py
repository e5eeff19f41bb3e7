"""The paper's input representations A to D on the reference architecture, all else equal.

The study continues after an interruption, and keeps the trainings that the result file already holds. That file is
published, so that the figure can be drawn at once; without it, all models are trained again. Source: the paper's
appendix "Effects of training-set size and physics-guided input representation".
"""

from pathlib import Path
from typing import Any

from experiments import common
from experiments.common import Config, Dataset, Models
from experiments.trainings.variants import WORK, Variant, Work, train_variants

PAPER = ("A", "B", "C", "D")


def variants(config: dict[str, Any]) -> dict[str, Variant]:
    """One training for each feature set."""
    return {
        features: Variant(
            label=f"features-{features}",
            architecture=config["architecture"],
            recipe=config["recipe"],
            epochs=config["epochs"],
            features=features,
        )
        for features in config["sets"]
    }


def summary(sets: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Order of the paper's feature sets by validation error, and the factor between A and D."""
    errors = {name: sets[name]["validation_mse"] for name in PAPER if name in sets}
    order = sorted(errors, key=errors.__getitem__)
    statistics: dict[str, Any] = {"order": order, "best": order[0] if order else None}
    if {"A", "D"} <= errors.keys():
        statistics["factor_a_over_d"] = errors["A"] / errors["D"]
    if errors.keys() == set(PAPER):
        statistics["all_improve_over_a"] = all(errors[name] < errors["A"] for name in "BCD")
        statistics["d_better_than_c"] = errors["D"] < errors["C"]
    return statistics


def study(config: Config, dataset: Dataset, models: Models, out: Path, *, work: Work = WORK / "feature_sets") -> None:
    """Train on each feature set, or continue; the result file is written after each training."""
    planned = variants(config)

    def publish(trained: dict[str, dict[str, Any]]) -> None:
        if not trained:
            return
        sets = {name: trained[name] for name in planned if name in trained}
        compared = sets.keys() >= set(PAPER) & set(config["sets"])
        result = {"config": config, "complete": len(trained) == len(planned)}
        common.write_result(out, "feature_sets", result | {"summary": summary(sets) if compared else {}, "sets": sets})

    train_variants(planned, dataset=dataset, models=models, work=work, out=out, jobs=config["jobs"], publish=publish)

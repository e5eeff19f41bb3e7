"""The input representations A to D on the reference architecture, all else equal.

The study trains up to four models, continues after an interruption, and keeps the trainings that the result file
already holds. That file is published, so that the figure can be drawn at once; without it, all models are trained
again. Source: the paper's appendix "Effects of training-set size and physics-guided input representation".
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from experiments import common
from experiments.timing import DatasetFile, Out
from experiments.training.trainings import WORK, Variant, earlier_trainings, train_variants

CONFIG = common.CONFIGS / "feature_sets.toml"
OUT = Path("published/feature_sets.json")
KEYS = ("architecture", "recipe", "epochs", "sets", "jobs")


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
    """Order of the feature sets by validation error, and the factor between A and D."""
    order = sorted(sets, key=lambda name: sets[name]["validation_mse"])
    found: dict[str, Any] = {"order": order, "best": order[0]}
    errors = {name: sets[name]["validation_mse"] for name in order}
    if {"A", "B", "C", "D"} <= sets.keys():
        found["all_improve_over_a"] = all(errors[name] < errors["A"] for name in "BCD")
        found["d_better_than_c"] = errors["D"] < errors["C"]
    if {"A", "D"} <= sets.keys():
        found["factor_a_over_d"] = errors["A"] / errors["D"]
    return found


def main(
    config: Annotated[Path, typer.Option(help="TOML file.")] = CONFIG,
    dataset: DatasetFile = common.DATASET,
    models: Annotated[Path, typer.Option(help="Published models, used if trained in the same way.")] = common.MODELS,
    work: Annotated[Path, typer.Option(help="Folder in which the trainings are kept.")] = WORK / "feature_sets",
    out: Out = OUT,
) -> None:
    """Train on each feature set, or continue; the result file is written after each training."""
    settings = common.read_config(config, *KEYS)
    wanted = variants(settings)

    def publish(done: dict[str, dict[str, Any]]) -> None:
        sets = {name: done[variant.label] for name, variant in wanted.items() if variant.label in done}
        if sets:
            complete = len(sets) == len(wanted)
            found = summary(sets) if complete else {}
            content = {"config": settings, "complete": complete, "summary": found, "sets": sets}
            common.write_result(out, "feature_sets", content)

    train_variants(
        list(wanted.values()),
        dataset=dataset,
        work=work,
        models=models,
        published=earlier_trainings(out, lambda content: content["sets"].values()),
        jobs=settings["jobs"],
        publish=publish,
    )

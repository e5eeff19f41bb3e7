"""The input representations A to F on the reference architecture, and two kinds of measurement steps, all else equal.

A to D are the paper's, E and F are those of the pretrained models (`surrogate.data.features`). Some sets are trained
again on the same protocols at physical measurement steps, so that the gain from the steps alone and from the inputs
alone can be told apart. Validation and held-out errors compare models of the same steps only, since the forces at other
steps are others. Across steps, what a model predicts at its own steps is compared with the solver's own pull-off force
and hysteresis, on hidden protocols off the paper's grid, as long as its weights are kept. The solver's forces at the
steps, read in the same way, are the floor: no model of these steps is expected to be closer.

The study continues after an interruption, and keeps the trainings that the result file already holds. That file is
published, so that the figure can be drawn at once; without it, all models are trained again. Source: the paper's
appendix "Effects of training-set size and physics-guided input representation".
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem.dataset.designs import agree
from experiments import common
from experiments.cases import STEPS, Hidden, results_of
from experiments.common import Config, Dataset, Models
from experiments.measurements.statistics import quantiles
from experiments.surrogates.measurement_steps import READINGS, errors, reading_errors
from experiments.trainings.variants import WORK, Variant, Work, kept_folder, train_variants
from surrogate.data.dataset import TrajectoryDataset

PHYSICAL = Path("results/dataset/physical.h5")
PAPER = ("A", "B", "C", "D")
PARTS = {"sets": "uniform", "physical": "physical"}
"""Keys of the configuration and of the result that hold trainings, and their measurement steps."""


def variants(config: dict[str, Any], physical: Path = PHYSICAL) -> dict[tuple[str, str], Variant]:
    """One training for each feature set and kind of measurement steps, by the keys of its place in the result."""
    return {
        (group, features): Variant(
            label=f"features-{features}" + ("-physical" if group == "physical" else ""),
            architecture=config["architecture"],
            recipe=config["recipe"],
            epochs=config["epochs"],
            features=features,
            dataset=physical if group == "physical" else None,
        )
        for group in PARTS
        for features in config[group]
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


def check_physical(physical: Path, dataset: Path) -> None:
    """Check that a data set file holds the trajectories of another one at physical steps.

    Raises:
        FileNotFoundError: It does not exist.
        ValueError: It has other steps, other protocols or another material, or other trajectories failed.
    """
    if not physical.is_file():
        raise FileNotFoundError(f"data set {str(physical)!r} not found; `make feature-sets` makes it")
    received, expected = (TrajectoryDataset.load(path) for path in (physical, dataset))
    alike = len(received) == len(expected) and received.modulus_ratio == expected.modulus_ratio
    alike = alike and all(agree(values, received.protocols[name]) for name, values in expected.protocols.items())
    if received.steps != "physical" or not alike or not np.array_equal(received.completed, expected.completed):
        raise ValueError(
            f"data set {str(physical)!r} must hold the protocols of {str(dataset)!r} at physical steps; received "
            f"{len(received)} trajectories at {received.steps} steps: remove it, and `make feature-sets` makes it again"
        )


def hidden_errors(folders: Mapping[str, tuple[Path, str]], count: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors of models on hidden protocols in percent, from their directories and kinds of measurement steps.

    Returns:
        Count and quantiles of each of `READINGS` by model, and the same of the solver's forces by kind of steps.
    """
    hidden = Hidden.draw(count, common.MODULUS_RATIO)
    trajectories = list(hidden.simulated())
    grids = {steps: hidden.grid(steps) for steps in STEPS}

    def summed(columns: np.ndarray) -> dict[str, Any]:
        return {"count": count} | {name: quantiles(values) for name, values in zip(READINGS, columns, strict=True)}

    model_errors = {}
    for name, (folder, steps) in folders.items():
        model = common.load_surrogate(folder.name, folder.parent)
        force = common.predicted(model, *grids[steps], hidden.quantities["tabor"])
        model_errors[name] = summed(reading_errors(*grids[steps], force, STEPS[steps], results_of(trajectories).T))
    return model_errors, {steps: summed(errors(trajectories, *grids[steps], counts)) for steps, counts in STEPS.items()}


def study(
    config: Config,
    dataset: Dataset,
    models: Models,
    out: Path,
    *,
    work: Work = WORK / "feature_sets",
    physical: Annotated[Path, typer.Option(help="The same protocols at physical measurement steps.")] = PHYSICAL,
) -> None:
    """Train on each feature set, or continue; the result file is written after each training."""
    planned = variants(config, physical)
    if config["physical"] and dataset.is_file():
        check_physical(physical, dataset)
    floor = json.loads(out.read_text(encoding="utf-8")).get("floor", {}) if out.is_file() else {}

    def publish(trained: dict[tuple[str, str], dict[str, Any]]) -> None:
        if not trained:
            return
        results = {
            group: {name: trained[group, name] for of, name in planned if of == group and (group, name) in trained}
            for group in PARTS
        }
        compared = results["sets"].keys() >= set(PAPER) & set(config["sets"])
        result = {"config": config, "complete": len(trained) == len(planned)}
        result |= {"summary": summary(results["sets"]) if compared else {}, **results, "floor": floor}
        common.write_result(out, "feature_sets", result)

    folders = {"dataset": dataset, "models": models, "work": work}
    trained = train_variants(planned, **folders, out=out, jobs=config["jobs"], publish=publish)
    kept = {}
    for key, variant in planned.items():
        if trained[key].get("hidden", {}).get("count") != config["hidden"]:
            data = TrajectoryDataset.load(variant.dataset or dataset)
            folder = kept_folder(variant, data, work=work, models=models)
            if folder and (folder / "model.weights.h5").is_file():
                kept[variant.label] = (folder, PARTS[key[0]])
    if kept:
        errors, floor = hidden_errors(kept, config["hidden"])
        scored = {key: {"hidden": errors[variant.label]} for key, variant in planned.items() if variant.label in errors}
        publish({key: result | scored.get(key, {}) for key, result in trained.items()})

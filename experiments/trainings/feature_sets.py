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
from experiments.common import Config, Dataset, Models
from experiments.measurements.cases import STEPS, Hidden, results_of
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
        (part, features): Variant(
            label=f"features-{features}" + ("-physical" if part == "physical" else ""),
            architecture=config["architecture"],
            recipe=config["recipe"],
            epochs=config["epochs"],
            features=features,
            dataset=physical if part == "physical" else None,
        )
        for part in PARTS
        for features in config[part]
    }


def summary(sets: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Order of the paper's feature sets by validation error, and the factor between A and D."""
    errors = {name: sets[name]["validation_mse"] for name in PAPER if name in sets}
    order = sorted(errors, key=errors.__getitem__)
    found: dict[str, Any] = {"order": order, "best": order[0] if order else None}
    if {"A", "D"} <= errors.keys():
        found["factor_a_over_d"] = errors["A"] / errors["D"]
    if errors.keys() == set(PAPER):
        found["all_improve_over_a"] = all(errors[name] < errors["A"] for name in "BCD")
        found["d_better_than_c"] = errors["D"] < errors["C"]
    return found


def check_physical(physical: Path, dataset: Path) -> None:
    """Check that a data set file holds the trajectories of another one at physical steps.

    Raises:
        FileNotFoundError: It does not exist.
        ValueError: It has other steps, other protocols or another material, or other trajectories failed.
    """
    if not physical.is_file():
        raise FileNotFoundError(f"data set {str(physical)!r} not found; `make feature-sets` makes it")
    found, wanted = (TrajectoryDataset.load(path) for path in (physical, dataset))
    alike = len(found) == len(wanted) and found.modulus_ratio == wanted.modulus_ratio
    alike = alike and all(agree(values, found.protocols[name]) for name, values in wanted.protocols.items())
    if found.steps != "physical" or not alike or not np.array_equal(found.completed, wanted.completed):
        raise ValueError(
            f"data set {str(physical)!r} must hold the protocols of {str(dataset)!r} at physical steps; received "
            f"{len(found)} trajectories at {found.steps} steps: remove it, and `make feature-sets` makes it again"
        )


def hidden_errors(folders: Mapping[str, tuple[Path, str]], count: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors of models on hidden protocols in percent, from their directories and kinds of measurement steps.

    Returns:
        Count and quantiles of each of `READINGS` by model, and the same of the solver's forces by kind of steps.
    """
    hidden = Hidden.draw(count, common.MODULUS_RATIO)
    trajectories = list(hidden.simulated())
    grids = {kind: hidden.grid(kind) for kind in STEPS}

    def summed(found: np.ndarray) -> dict[str, Any]:
        return {"count": count} | {name: quantiles(values) for name, values in zip(READINGS, found, strict=True)}

    found = {}
    for name, (folder, kind) in folders.items():
        model = common.load_surrogate(folder.name, folder.parent)
        force = common.predicted(model, *grids[kind], hidden.quantities["tabor"])
        found[name] = summed(reading_errors(*grids[kind], force, STEPS[kind], results_of(trajectories).T))
    return found, {kind: summed(errors(trajectories, *grids[kind], counts)) for kind, counts in STEPS.items()}


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
    wanted = variants(config, physical)
    if config["physical"] and dataset.is_file():
        check_physical(physical, dataset)
    floor = json.loads(out.read_text(encoding="utf-8")).get("floor", {}) if out.is_file() else {}

    def publish(trained: dict[tuple[str, str], dict[str, Any]]) -> None:
        if not trained:
            return
        found = {
            part: {name: trained[part, name] for of, name in wanted if of == part and (part, name) in trained}
            for part in PARTS
        }
        compared = found["sets"].keys() >= set(PAPER) & set(config["sets"])
        content = {"config": config, "complete": len(trained) == len(wanted)}
        content |= {"summary": summary(found["sets"]) if compared else {}, **found, "floor": floor}
        common.write_result(out, "feature_sets", content)

    folders = {"dataset": dataset, "models": models, "work": work}
    trained = train_variants(wanted, **folders, out=out, jobs=config["jobs"], publish=publish)
    kept = {}
    for place, variant in wanted.items():
        if trained[place].get("hidden", {}).get("count") != config["hidden"]:
            data = TrajectoryDataset.load(variant.dataset or dataset)
            folder = kept_folder(variant, data, work=work, models=models)
            if folder and (folder / "model.weights.h5").is_file():
                kept[variant.label] = (folder, PARTS[place[0]])
    if kept:
        found, floor = hidden_errors(kept, config["hidden"])
        scored = {place: {"hidden": found[one.label]} for place, one in wanted.items() if one.label in found}
        publish({place: one | scored.get(place, {}) for place, one in trained.items()})

"""Train and publish `fast` and `accurate`, the models that know any standard linear solid and have bands.

    bem campaign --design sobol --count 65536 --modulus-ratio 0.01:1 --steps physical --out results/any_solid.h5
    python -m surrogate.training.pretrained fast accurate --dataset results/any_solid.h5

`make pretrained` runs both. An interrupted training is resumed by the same command. Of the trajectories, nine tenths
are for training, a twentieth chooses the epoch and fits the difficulty of the bands, and the rest calibrates them.
"""

from __future__ import annotations

import argparse
import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import keras
import numpy as np
from keras import layers

from bem._support.outputs import whole_file
from bem.dataset.designs import PAPER_RANGES
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor
from surrogate.backend import versions
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.examples import physical_channels, scaled_examples
from surrogate.data.scaling import Scaling
from surrogate.export.onnx import network_content
from surrogate.export.onnx_file import ONNX_NAME, seal_folder, session_of
from surrogate.prediction.bands import KNOWN, Bands, results
from surrogate.prediction.files import PUBLISHED_BANDED
from surrogate.prediction.networks import NetworkFile
from surrogate.training.fitting import Report, TrainingTask, fit, started, with_weights
from surrogate.training.progress import reporter
from surrogate.training.recipe import Cosine, Recipe
from surrogate.training.run_folder import locked, require_same_run

FEATURES = "F"
RUN_FORMAT = "viscoelastic-contact-pretrained"
RANGES = PAPER_RANGES | {"modulus_ratio": (0.01, 1.0)}
"""Of the design, which its trajectories fill."""
HELD_OUT = (0.05, 0.05)
"""Shares of the trajectories that choose the epoch, and that calibrate the bands."""


@dataclass(frozen=True)
class Definition:
    """What a pretrained model is.

    Args:
        units: Of each LSTM.
        trajectories: How many of the data set it uses, the first ones.
        recipe: How it is trained.
    """

    units: tuple[int, ...]
    trajectories: int
    recipe: Recipe


_RECIPE = Recipe(
    name="pretrained",
    seed=0,
    batch_size=64,
    epochs=40,
    learning_rate=5e-3,
    optimizer="soap",
    gradient_norm=1.0,
    weight_average=0.03,
    cosine=Cosine(warmup_epochs=0.5),
)
DEFINITIONS = {
    "fast": Definition((64,), 65_536, _RECIPE),
    "accurate": Definition((128, 64), 65_536, replace(_RECIPE, epochs=48, learning_rate=4e-3)),
}


def network(units: tuple[int, ...]) -> keras.Model:
    """Build an untrained network: LSTMs of so many units each, and the readout that all models share."""
    sequence, tabor = inputs(FEATURES)
    hidden = AppendTabor(name="append_tabor")(sequence, tabor)
    for number, size in enumerate(units, 1):
        hidden = layers.LSTM(size, return_sequences=True, name=f"lstm_{number}")(hidden)
    return keras.Model([sequence, tabor], readout(hidden))


def first(dataset: TrajectoryDataset, count: int) -> Split:
    """Divide the first trajectories of a data set.

    Raises:
        ValueError: it holds fewer, or other than physical steps and modulus ratios of their own.
    """
    if dataset.steps != "physical" or "modulus_ratio" not in dataset.protocols:
        raise ValueError("Expected a data set of physical steps and a range of modulus ratios. Received: another one")
    if len(dataset) < count:
        raise ValueError(f"Expected a data set of at least {count} trajectories. Received: {len(dataset)}")
    whole = dataset.split(seed=0, fractions=HELD_OUT)
    return Split(*(part[part < count] for part in (whole.train, whole.validation, whole.test)), seed=0)


def train_model(
    name: str,
    definition: Definition,
    dataset: TrajectoryDataset,
    folder: Path,
    *,
    command: str = "",
    report: Report = lambda *_: None,
) -> Path:
    """Train one model in `folder`, resuming what is there; return the directory `folder/NAME` of the finished one."""
    recipe, split = definition.recipe, first(dataset, definition.trajectories)
    model = started(lambda: network(definition.units), recipe.seed)
    scaling = Scaling.fit(
        physical_channels(dataset, split.train, FEATURES),
        tabor=dataset.protocols["tabor"][split.train],
        force=dataset.force[split.train],
        features=FEATURES,
        protocols={name: np.array(bounds) for name, bounds in RANGES.items()},
        dataset_sha256=dataset.sha256,
    )
    asked = {"units": definition.units, "dataset": dataset.sha256, "split": split.sha256, "recipe": recipe.as_dict()}
    with locked(folder):
        require_same_run(folder, asked)
        progress = fit(
            TrainingTask(
                model=model,
                training=scaled_examples(dataset, split.train, scaling),
                validation=scaled_examples(dataset, split.validation, scaling),
                recipe=recipe,
                folder=folder,
                facts=asked,
                report=report,
            )
        )
        target = folder / name
        target.mkdir(exist_ok=True)
        content = network_content(with_weights(network(definition.units), model), FEATURES, name)
        (target / ONNX_NAME).write_bytes(content)
        scaling.save(target / "scaling.json")
        shutil.copyfile(folder / "history.csv", target / "history.csv")
        run = {
            "format": RUN_FORMAT,
            "format_version": 1,
            "name": name,
            "features": FEATURES,
            "units": list(definition.units),
            "parameters": model.count_params(),
            "counts": list(dataset.points_per_phase),
            "training_trajectories": len(split.train),
            "calibration_trajectories": len(split.test),
            "seed": recipe.seed,
            "recipe": recipe.as_dict(),
            "best_epoch": progress.best_epoch,
            "validation_mse": progress.best_mse,
            "cpu_seconds": progress.cpu_seconds,
            "backend": keras.backend.backend(),
            "versions": versions(),
            "command": command,
            "dataset_sha256": dataset.sha256,
        }
        (target / "run.json").write_text(json.dumps(run, indent=1) + "\n", encoding="utf-8")
        calibrate(target, NetworkFile(content, session_of(content), scaling, name, 1), dataset, split)
        seal_folder(target)
    return target


def calibrate(folder: Path, trained: NetworkFile, dataset: TrajectoryDataset, split: Split) -> None:
    """Write `bands.npz` of a trained network, from the trajectories that were held out of its training."""
    scaling, chosen = trained.scaling, np.concatenate([split.validation, split.test])
    examples = scaled_examples(dataset, chosen, scaling)
    scaled = trained.scaled(examples.sequence, examples.tabor).astype(np.float64)
    times, indentations = dataset.grid(chosen)
    counts = np.array(dataset.points_per_phase)
    pull_off, _, sharpness, _ = results(times, indentations, scaling.unscale_force(scaled), counts)
    known = np.column_stack([*(dataset.protocols[name][chosen] for name in KNOWN), sharpness])
    true = dataset.scalars["pull_off_force"][chosen]
    bands = Bands.calibrate(
        known,
        np.abs(np.log(np.maximum(pull_off, 1e-6) / true)),
        np.abs(scaled - examples.force[..., 0]),
        len(split.validation),
    )
    with whole_file(folder / "bands.npz") as part, part.open("wb") as file:
        np.savez(file, **bands.as_arrays())


def main() -> None:
    """Train the models that the command line names, and publish them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="+", choices=sorted(DEFINITIONS))
    parser.add_argument("--dataset", type=Path, required=True, help="what `bem campaign` wrote, see above")
    parser.add_argument("--runs", type=Path, default=Path("results/pretrained"), help="where trainings are kept")
    parser.add_argument("--publish", type=Path, default=PUBLISHED_BANDED, help="where finished models go")
    parser.add_argument("--epochs", type=int, help="instead of those of the recipe; the rate falls to zero in these")
    chosen = parser.parse_args()
    dataset = TrajectoryDataset.load(chosen.dataset)
    for name in chosen.names:
        definition, more = DEFINITIONS[name], ""
        if chosen.epochs:
            definition = replace(definition, recipe=replace(definition.recipe, epochs=chosen.epochs))
            more = f" --epochs {chosen.epochs}"
        command = f"python -m surrogate.training.pretrained {name} --dataset {chosen.dataset}{more}"
        with reporter(name) as report:
            made = train_model(name, definition, dataset, chosen.runs / name, command=command, report=report)
        target = chosen.publish / name
        target.mkdir(parents=True, exist_ok=True)
        for file in made.iterdir():
            shutil.copyfile(file, target / file.name)
        print(f"{name}: {target}")


if __name__ == "__main__":
    main()

r"""Train and publish `fast` and `accurate`, the models that know any standard linear solid and have bands.

    python -m surrogate.training.pretrained fast --box b.h5 --edges e.h5 --deep d.h5 --faint f.h5 --corners c.h5 \
        --elastic n.h5

`make pretrained` simulates these data sets by `bem campaign`, with the designs `sobol`, `edges` and `corners`, modulus
ratios from 0.01 to 1 and physical steps, and then trains. An interrupted training is resumed by the same command. Most
protocols in the box, those at its edges, and those that press deep and unload fast (narrow peaks after large forces,
where networks err most), many of them at small Tabor parameters (faint peaks), are for training. Of the last ones in
the box, some choose the epoch, and others calibrate the bands, together with those in the corners and those of nearly
elastic solids, with modulus ratios from 0.95 to 1.
`--calibrate` judges published models on one more data set, and trains nothing.
"""

from __future__ import annotations

import argparse
import hashlib
import shlex
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import keras
import numpy as np

from bem._support.outputs import whole_file
from bem.dataset.designs import PAPER_RANGES
from surrogate.backend import versions
from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.examples import Part, joined_examples, physical_channels, pieces, scaled_examples
from surrogate.data.scaling import Scaling
from surrogate.files import PUBLISHED_BANDED, read_run, write_run
from surrogate.intervals import KNOWN, Bands, result_errors, results
from surrogate.loading import load_banded
from surrogate.networks import OnnxNetwork
from surrogate.onnx.export import network_content
from surrogate.onnx.file import ONNX_NAME, sha256
from surrogate.training.fitting import fit, started
from surrogate.training.pretrained_networks import (
    FEATURES,
    NETWORKS,
    Layers,
    Member,
    members_of,
    network,
    telling_steps,
)
from surrogate.training.recipe import Cosine, Recipe
from surrogate.training.run_folder import Progress, Report, locked, print_epoch

RUN_FORMAT = "viscoelastic-contact-pretrained"
RANGES = PAPER_RANGES | {"modulus_ratio": (0.01, 1.0)}
"""Of the design, which its trajectories fill."""
FITTED = 8_000
"""Trajectories at the edges to which the expected errors of the bands are fitted."""
SCALED = 60_000
"""Trajectories in the box from which the scaling of a new model is computed."""
HELD_OUT = (8_000, 14_016)
"""How many of the last trajectories in the box choose the epoch, and how many calibrate the bands."""
_RECIPE = Recipe(
    name="pretrained",
    seed=0,
    batch_size=128,
    epochs=12,
    learning_rate=3e-3,
    optimizer="soap",
    gradient_norm=1.0,
    weight_average=0.03,
    peak_weight=20.0,
    cosine=Cosine(warmup_epochs=0.1),
)
RECIPES = {"dense": replace(_RECIPE, batch_size=512, epochs=120), "LSTM": _RECIPE}


@dataclass(frozen=True)
class Data:
    """Data sets: in the box, at its edges, deep and unloaded fast, with faint peaks, in its corners, nearly elastic.

    Raises:
        ValueError: one of them has other steps, or no modulus ratios of its own.
    """

    box: TrajectoryDataset
    edges: TrajectoryDataset
    deep: TrajectoryDataset
    faint: TrajectoryDataset
    corners: TrajectoryDataset
    elastic: TrajectoryDataset

    def __post_init__(self) -> None:
        for dataset in vars(self).values():
            if dataset.steps != "physical" or "modulus_ratio" not in dataset.protocols:
                raise ValueError(
                    "data sets must be of physical steps and a range of modulus ratios; received another one"
                )

    @property
    def sha256(self) -> str:
        """Digest of what all of them are of."""
        return hashlib.sha256("".join(dataset.sha256 for dataset in vars(self).values()).encode()).hexdigest()

    def divided(self, held_out: tuple[int, int]) -> tuple[list[Part], list[Part], list[Part]]:
        """Return the parts for training, to choose the epoch and, by and by, to fit and to calibrate the bands.

        Raises:
            ValueError: the box holds no more than what is held out.
        """
        rows, (chosen, calibrated) = self.box.completed, held_out
        if len(rows) <= chosen + calibrated:
            raise ValueError(f"the box must hold more than {chosen + calibrated} trajectories; received {len(rows)}")
        train, choose, calibrate = np.split(rows, [-chosen - calibrated, -calibrated])
        edges = self.edges.completed
        return (
            [(self.box, train), (self.edges, edges)] + [(data, data.completed) for data in (self.deep, self.faint)],
            [(self.box, choose)],
            [(self.edges, edges[:FITTED]), (self.box, calibrate)]
            + [(data, data.completed) for data in (self.corners, self.elastic)],
        )


def train_model(
    name: str,
    networks: Sequence[Layers],
    recipes: Mapping[str, Recipe],
    data: Data,
    folder: Path,
    *,
    held_out: tuple[int, int] = HELD_OUT,
    start: Path | None = None,
    command: str = "",
    report: Report = lambda *_: None,
) -> Path:
    """Train in `folder` the networks whose mean is the model, each by the recipe of its kind, and resume what is there.

    With `start`, the folder of a published model, training goes on from the weights of its first networks, as many as
    `networks`, in its scaling. Those of a kind without a recipe stay as they are.

    Returns:
        The directory `folder/NAME` of the finished model.

    Raises:
        ValueError: the networks of `start` are others, or a kind has no recipe and there is no `start`.
    """
    training, choosing, calibrating = data.divided(held_out)
    begin = members_of(start)[: len(networks)] if start else []
    theirs = [(record["layers"], tuple(record["units"])) for _, record in begin]
    if theirs != list(networks) and (start or any(layer not in recipes for layer, _ in networks)):
        raise ValueError(f"--start must hold the networks {list(networks)}; received {theirs or 'none'}")
    scaling = _scaling(data, training[0][1], start)
    with locked(folder):
        choose = joined_examples(choosing, scaling)
        examples = joined_examples(training, scaling) if recipes else choose
        members: list[Member] = []
        for number, (layer, units) in enumerate(networks):
            if layer in recipes:
                recipe = replace(recipes[layer], seed=recipes[layer].seed + number)
                facts = {"units": list(units), "dataset": data.sha256, "recipe": recipes[layer].as_dict()}
                facts |= {"published": sha256(start / ONNX_NAME)} if start else {}
                model = started(partial(network, layer, units, data.box.points_per_phase), recipe.seed)
                if start:
                    model.set_weights(begin[number][0].get_weights())
                progress = fit(model, examples, choose, recipe, folder / f"{number}", facts=facts, report=report)
                members.append(_member(model, layer, units, recipe, progress, data, start, command))
            else:
                members.append(begin[number])
        target = folder / name
        target.mkdir(exist_ok=True)
        trained = [number for number, (layer, _) in enumerate(networks) if layer in recipes]
        last = folder / f"{trained[-1]}" if trained else start
        shutil.copyfile(last / "history.csv", target / "history.csv")
        mean = _write_network(target, members, scaling)
        residual = mean.scaled(choose.sequence, choose.tabor) - choose.force[..., 0]
        counted = {
            "training_trajectories": sum(len(rows) for _, rows in training),
            "calibration_trajectories": sum(len(rows) for _, rows in calibrating[1:]),
        }
        run = _run(name, members, data, counted, float(np.mean(residual**2)), command)
        calibration = judged(mean, calibrating)
        _write_bands(target, Bands.calibrate(scaling.ranges, *calibration, len(calibrating[0][1])))
        write_run(target, run)
    return target


def _scaling(data: Data, rows: np.ndarray, start: Path | None) -> Scaling:
    """Return the scaling of a published model, or that of the first trajectories in the box."""
    if start:
        return replace(Scaling.load(start / "scaling.json"), dataset_sha256=data.sha256)
    rows = rows[:SCALED]
    return Scaling.fit(
        physical_channels(data.box, rows, FEATURES),
        tabor=data.box.protocols["tabor"][rows],
        force=data.box.force[rows],
        features=FEATURES,
        protocols={name: np.array(bounds) for name, bounds in RANGES.items()},
        dataset_sha256=data.sha256,
    )


def _member(
    model: keras.Model,
    layer: str,
    units: Sequence[int],
    recipe: Recipe,
    progress: Progress,
    data: Data,
    start: Path | None,
    command: str,
) -> Member:
    """Return a trained network without its optimizer, and its record."""
    bare = network(layer, units, data.box.points_per_phase)
    bare.set_weights(model.get_weights())
    return bare, {
        "layers": layer,
        "units": list(units),
        "recipe": recipe.as_dict(),
        "best_epoch": progress.best_epoch,
        "validation_mse": progress.best_mse,
        "cpu_seconds": progress.spent("cpu_seconds"),
        "command": command,
        "start_sha256": sha256(start / ONNX_NAME) if start else None,
        "dataset_sha256": data.sha256,
    }


def _write_network(target: Path, members: list[Member], scaling: Scaling) -> OnnxNetwork:
    """Write the mean of the networks with its scaling, and return it."""
    model_bytes = network_content([member for member, _ in members], FEATURES, target.name)
    (target / ONNX_NAME).write_bytes(model_bytes)
    scaling.save(target / "scaling.json")
    return OnnxNetwork(model_bytes, scaling, target.name)


def _run(
    name: str, members: list[Member], data: Data, counted: dict[str, int], validation_mse: float, command: str
) -> dict[str, Any]:
    """Return the content of `run.json`."""
    counts = data.box.points_per_phase
    run = {
        "format": RUN_FORMAT,
        "format_version": 1,
        "name": name,
        "features": FEATURES,
        "members": [record for _, record in members],
        "parameters": sum(member.count_params() for member, _ in members),
        "counts": list(counts),
        **counted,
        "validation_mse": validation_mse,
        "backend": keras.backend.backend(),
        "versions": versions(),
        "command": command,
    }
    alone = all(record["layers"] == "dense" for _, record in members)
    return run | ({"steps": telling_steps(counts)} if alone else {})


def calibrate_published(folder: Path, dataset: TrajectoryDataset) -> None:
    """Take the quantiles of the cells that a data set fills, in a folder of a published model."""
    model = load_banded(folder)
    _write_bands(folder, model.bands.recalibrated(*judged(model.network, [(dataset, dataset.completed)])))
    write_run(folder, read_run(folder)[0])


def judged(trained: OnnxNetwork, parts: list[Part]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what is known of trajectories, and errors of results and forces, as `Bands.calibrate` takes them."""
    scaling, batches = trained.scaling, []
    for dataset, rows in pieces(parts):
        examples = scaled_examples(dataset, rows, scaling)
        scaled = trained.scaled(examples.sequence, examples.tabor).astype(np.float64)
        times, indentations = dataset.grid(rows)
        counts = np.array(dataset.points_per_phase)
        predicted = results(times, indentations, scaling.unscale_force(scaled), counts)
        true = np.stack([dataset.scalars[name][rows] for name in ("pull_off_force", "pull_off_time", "hysteresis")])
        predictors = np.column_stack([*(dataset.protocols[name][rows] for name in KNOWN), predicted[3]])
        errors = result_errors(predicted, true, times[:, counts[:2].sum() - 1])
        batches.append((predictors, errors.T, np.abs(scaled - examples.force[..., 0])))
    predictors, errors, force = map(np.concatenate, zip(*batches, strict=True))
    return predictors, errors.T, force


def _write_bands(folder: Path, bands: Bands) -> None:
    with whole_file(folder / "bands.npz") as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **bands.as_arrays())


def main() -> None:
    """Train the models that the command line names, and publish them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="+", choices=sorted(NETWORKS))
    for field in Data.__annotations__:
        parser.add_argument(f"--{field}", type=Path, help="what `bem campaign` wrote, see above")
    parser.add_argument("--start", type=Path, help="folder of models, such as --publish, whose weights are trained on")
    parser.add_argument("--runs", type=Path, default=Path("results/pretrained"), help="where trainings are kept")
    parser.add_argument("--publish", type=Path, default=PUBLISHED_BANDED, help="where finished models go")
    parser.add_argument("--calibrate", type=Path, help="data set to judge published models on, instead of training")
    parser.add_argument("--epochs", type=int, help="instead of the recipe's; 0: only publish again what is there")
    chosen = parser.parse_args()
    if chosen.calibrate:
        for name in chosen.names:
            calibrate_published(chosen.publish / name, TrajectoryDataset.load(chosen.calibrate))
        return
    if missing := [f"--{field}" for field in Data.__annotations__ if getattr(chosen, field) is None]:
        parser.error(f"a training needs {', '.join(missing)}")
    if chosen.epochs == 0 and not chosen.start:
        parser.error("--epochs 0 trains nothing, so it needs --start")
    data = Data(*(TrajectoryDataset.load(getattr(chosen, field)) for field in Data.__annotations__))
    epochs = {} if chosen.epochs is None else {"epochs": chosen.epochs}
    recipes = {} if chosen.epochs == 0 else {layer: replace(recipe, **epochs) for layer, recipe in RECIPES.items()}
    for name in chosen.names:
        read = {key: getattr(chosen, key) for key in (*Data.__annotations__, "epochs", "start")}
        arguments = [word for key, value in read.items() if value is not None for word in (f"--{key}", str(value))]
        made = train_model(
            name,
            NETWORKS[name],
            recipes,
            data,
            chosen.runs / name,
            start=chosen.start and chosen.start / name,
            command=shlex.join(["python", "-m", "surrogate.training.pretrained", name, *arguments]),
            report=print_epoch,
        )
        shutil.copytree(made, chosen.publish / name, dirs_exist_ok=True)
        print(f"{name}: {chosen.publish / name}")


if __name__ == "__main__":
    main()

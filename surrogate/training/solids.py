r"""Train a model of any linear solid in two stages: scalar results first, then the curve around the pull-off.

    bem campaign --solids prony:1-4 --design sobol --modulus-ratio 0.01:1 --steps pull-off --count 400000 --seed 71 \
        --out prony.h5
    python -m surrogate.training.solids --data prony.h5 --runs results/solids/fast --publish published/pretrained/fast

Stage one maps the features of `surrogate.data.solid_features` to pull-off force and time, hysteresis and largest
compression. Stage two maps the features and what stage one says to the force at steps around the pull-off
(`bem.dataset.pull_off_steps`), beside that without adhesion; fronts place its jumps (`surrogate.data.fronts`). It
learns at the steps around the true pull-off and is read at those around the predicted one, so that its peak is where
the scalars say.
An interrupted training is resumed by the same command.
"""

from __future__ import annotations

import argparse
import hashlib
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import keras
import numpy as np
from keras import layers

from bem.dataset.file import load_dataset
from bem.dataset.lee_radok import relaxation_spectra
from surrogate.architectures.layers import AppendTabor
from surrogate.backend import versions
from surrogate.data.dense import Stage
from surrogate.data.examples import Examples
from surrogate.data.fronts import PLACE, Front, front_steps, places
from surrogate.data.fronts import UNITS as FRONT_UNITS
from surrogate.data.polynomial import Polynomial
from surrogate.data.reach import Reach
from surrogate.data.solid_features import forces_without_adhesion, solid_features
from surrogate.onnx.file import sha256
from surrogate.solids import SCALARS, curve_targets, scalar_targets, write_model
from surrogate.training.fitting import fit, started
from surrogate.training.recipe import Cosine, Recipe
from surrogate.training.run_folder import Report, locked, print_epoch

UNITS = (256, 256, 256)
HELD_OUT = 0.04
"""Share of the trajectories that choose the epoch."""
SOURCE = ("solids", "design", "ranges", "modulus_ratio", "seed", "accuracy")
"""What the record of a model says of each campaign."""
RECIPE = Recipe(
    name="solids",
    seed=0,
    batch_size=1024,
    epochs=55,
    learning_rate=3e-3,
    optimizer="soap",
    gradient_norm=1.0,
    weight_average=0.03,
    cosine=Cosine(warmup_epochs=1.0),
)
RECIPES = (RECIPE, replace(RECIPE, epochs=60))
"""Of the two stages."""


@dataclass(frozen=True)
class SolidData:
    """Completed trajectories of data sets with steps around the pull-off.

    Args:
        features: Shape (n, features).
        scalars: What stage one learns, shape (n, 4).
        curve: What stage two learns, shape (n, steps).
        places: Where the steps of the fronts lie (`surrogate.data.fronts`), shape (n, steps of both, PLACE).
        counts: Points of loading, dwell and unloading.
        sha256: Digest of the files.
        sources: Of each file the solids, seed and ranges of its campaign, and how many of its trajectories completed.
    """

    features: np.ndarray
    scalars: np.ndarray
    curve: np.ndarray
    places: np.ndarray
    counts: tuple[int, int, int]
    sha256: str
    sources: list[dict[str, Any]]

    @classmethod
    def load(cls, paths: Sequence[Path]) -> SolidData:
        """Read data sets.

        Raises:
            ValueError: one of them has other steps.
        """
        columns, sources = [], []
        for path in paths:
            dataset = load_dataset(path)
            if dataset.steps != "pull-off":
                raise ValueError(f"data sets must have steps around the pull-off; received {path}")
            rows = dataset.completed
            protocols = {name: values[rows] for name, values in dataset.protocols.items()}
            strengths, times = (values[rows] for values in dataset.solids)
            instants, indentations = (values[rows] for values in dataset.grid())
            scalars = {name: dataset.scalars[name][rows] for name in SCALARS}
            begin = instants[:, sum(dataset.counts[:2]) - 1]
            spectra = relaxation_spectra(strengths, times)
            features = solid_features(protocols, strengths, times, spectra)
            without = forces_without_adhesion(instants, indentations, protocols["tabor"], *spectra)
            rate = protocols["unloading_rate"]
            targets = scalar_targets(scalars, begin, rate)
            curve = curve_targets(dataset.force[rows], without, scalars["pull_off_force"], dataset.counts)
            where = (instants, indentations, protocols["tabor"], rate, scalars["pull_off_time"])
            fronts = [places(*where, steps) for steps in front_steps(dataset.counts)]
            columns.append((features, targets, curve.astype(np.float32), np.concatenate(fronts, axis=1)))
            campaign = dataset.attributes["campaign"]
            sources.append({name: campaign[name] for name in SOURCE} | {"trajectories": len(rows)})
        digest = hashlib.sha256("".join(map(sha256, paths)).encode()).hexdigest()
        joined = [np.concatenate(parts) for parts in zip(*columns, strict=True)]
        # So that those that choose the epoch are of all files.
        order = np.random.default_rng(0).permutation(len(joined[0]))
        return cls(*(values[order] for values in joined), dataset.counts, digest, sources)


def network(
    inputs: int, outputs: int, units: Sequence[int] = UNITS, fronts: Sequence[tuple[int, int]] = ()
) -> keras.Model:
    """Build an untrained network of dense layers on one step of features, the first of them as `tabor`.

    After the features, the sequence holds the places of the steps of each front, which are given by first and end.
    """
    width = sum(end - first for first, end in fronts) * PLACE
    sequence, first_input = keras.Input((1, inputs - 1 + width), name="sequence"), keras.Input((1,), name="tabor")
    hidden = AppendTabor(name="append_tabor")(sequence[..., : inputs - 1], first_input)
    for number, size in enumerate(units, 1):
        hidden = layers.Dense(size, activation="gelu", name=f"dense_{number}")(hidden)
    parts, at = [layers.Dense(outputs, name="targets")(hidden)], inputs - 1
    for number, (first, end) in enumerate(fronts):
        place = layers.Reshape((end - first, PLACE))(sequence[..., at : at + (end - first) * PLACE])
        at += (end - first) * PLACE
        units_of_front = layers.Dense(FRONT_UNITS, name=f"front_{number}_hidden")(hidden)
        place = layers.Dense(FRONT_UNITS, use_bias=False, name=f"front_{number}_place")(place)
        inner = layers.Activation("relu")(layers.Add()([units_of_front, place]))
        inner = layers.Dense(FRONT_UNITS, activation="relu", name=f"front_{number}_second")(inner)
        added = layers.Dense(1, name=f"front_{number}_out")(inner)
        parts.append(layers.Reshape((1, outputs))(layers.ZeroPadding1D((first, outputs - end))(added)))
    return keras.Model([sequence, first_input], layers.Add()(parts) if fronts else parts[0])


def train_stage(
    features: np.ndarray,
    targets: np.ndarray,
    recipe: Recipe,
    folder: Path,
    facts: dict,
    report: Report,
    *,
    units: Sequence[int] = UNITS,
    fronts: Sequence[slice] = (),
    where: np.ndarray | None = None,
) -> tuple[Stage, float]:
    """Train one stage in `folder`, or resume it; `where` are the places of the steps of its fronts.

    Returns:
        The stage, and processor seconds of the training.
    """
    polynomial = Polynomial.fit(features, targets)
    z, left = polynomial.standardised(features), polynomial.left(features, targets)[:, np.newaxis]
    sequence = z[:, 1:] if where is None else np.column_stack([z[:, 1:], where.reshape(len(z), -1)])
    count = round(HELD_OUT * len(z))
    training, choosing = (Examples(sequence[part, np.newaxis], z[part, :1], left[part]) for part in _parts(count))
    ends = [(steps.start, steps.stop) for steps in fronts]
    model = started(partial(network, z.shape[1], left.shape[2], units, fronts=ends), recipe.seed)
    more = facts | {"recipe": recipe.as_dict()}
    progress = fit(model, training, choosing, recipe, folder, facts=more, report=report)
    return stage_of(polynomial, model), progress.spent("cpu_seconds")


def stage_of(polynomial: Polynomial, model: keras.Model) -> Stage:
    """The stage of a polynomial and of a `network`, which reads the first feature last."""
    dense = {layer.name: layer.get_weights() for layer in model.layers if isinstance(layer, layers.Dense)}
    kernels, biases = ([own[at] for name, own in dense.items() if "front" not in name] for at in (0, 1))
    fronts = [
        Front(*(values for part in ("hidden", "place", "second", "out") for values in dense[f"front_{number}_{part}"]))
        for number in range(sum(name.endswith("_place") for name in dense))
    ]
    return Stage(polynomial, [np.roll(kernels[0], 1, axis=0), *kernels[1:]], biases, fronts)


def _parts(held_out: int) -> tuple[slice, slice]:
    return slice(None, -held_out), slice(-held_out, None)


def train(
    data: SolidData,
    runs: Path,
    target: Path,
    *,
    recipes: Sequence[Recipe] = RECIPES,
    units: Sequence[int] = UNITS,
    report: Report = lambda *_: None,
) -> Path:
    """Train both stages in `runs`, or resume them, and write the model to the folder `target`."""
    facts = {"dataset": data.sha256}
    with locked(runs):
        part = (data.features, data.scalars, recipes[0], runs / "scalars", facts, report)
        scalars, seconds = train_stage(*part, units=units)
        inputs = np.column_stack([data.features, scalars(data.features)])
        steps = front_steps(data.counts)
        part = (inputs, data.curve, recipes[1], runs / "curve", facts, report)
        curve, more_seconds = train_stage(*part, units=units, fronts=steps, where=data.places)
    facts |= {"training_trajectories": len(data.features), "sources": data.sources}
    facts |= {"cpu_seconds": seconds + more_seconds}
    facts |= {
        "recipes": [recipe.as_dict() for recipe in recipes],
        "command": f"python -m surrogate.training.solids {shlex.join(sys.argv[1:])}",
    }
    stages = (scalars, curve)
    moments = ("mean", "deviation", "offset", "scale")
    facts["parameters"] = sum(
        values.size
        for name, values in (scalars.as_arrays("scalars") | curve.as_arrays("curve")).items()
        if not name.endswith(moments)
    )
    write_model(target, stages, Reach.of(data.features), data.counts, facts | {"versions": versions()})
    return target


def main() -> None:
    """Train the model that the command line describes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, nargs="+", required=True, help="what `bem campaign` wrote, see above")
    parser.add_argument("--runs", type=Path, default=Path("results/solids"), help="where trainings are kept")
    parser.add_argument("--publish", type=Path, required=True, help="folder of the finished model")
    parser.add_argument("--epochs", type=int, nargs=2, help="of the two stages, instead of those of `RECIPES`")
    parser.add_argument("--units", type=int, nargs="+", default=UNITS, help="of the layers (default: %(default)s)")
    chosen = parser.parse_args()
    epochs_by_stage = chosen.epochs or [recipe.epochs for recipe in RECIPES]
    recipes = [replace(recipe, epochs=epochs) for recipe, epochs in zip(RECIPES, epochs_by_stage, strict=True)]
    data = SolidData.load(chosen.data)
    train(data, chosen.runs, chosen.publish, recipes=recipes, units=chosen.units, report=print_epoch)
    print(chosen.publish)


if __name__ == "__main__":
    main()

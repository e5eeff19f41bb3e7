"""Which published models were trained on the forces of the shipped data set file, and which on an earlier version.

The digest that trainings have always recorded (`dataset_sha256`) covers what was simulated, not what came out. A model
belongs to the shipped file where the statistics of the training forces in its `scaling.json` are those of that file,
and where its weights err on the test part of that file as its `test_errors.csv` says. The statistics cannot be taken
again where a second data set joined the training; the errors alone then decide.
"""

from __future__ import annotations

import csv
import json
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from experiments import common
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.features import edge_from_counts
from surrogate.data.scaling import Scaling, symlog
from surrogate.inference.validity import ExtrapolationWarning

SAME = 1e-9
"""Relative difference of two means up to which they are taken from the same forces; the earlier forces' is 7e-6."""
SAME_ERROR = 0.03
"""Difference of a trajectory's MSE, as a share of the mean over the test part, up to which the forces are the same.

Networks compute in single precision: over the published models the largest difference is 0.009 on the same forces and
0.075 at least on the earlier ones (`make model-forces` prints them).
"""


def forces_agree(folder: Path, data: TrajectoryDataset, train: np.ndarray) -> bool:
    """Whether a model's scaling was taken from these training forces."""
    values = symlog(data.force[train])
    mean, deviation = Scaling.load(folder / "scaling.json").force
    return math.isclose(mean, values.mean(), rel_tol=SAME) and math.isclose(deviation, values.std(), rel_tol=SAME)


def error_difference(folder: Path, data: TrajectoryDataset) -> float:
    """How far the test MSE of a trajectory that a model wrote is from that of its weights on a data set.

    Returns:
        the largest difference of a trajectory, as a share of the mean over the test part.
    """
    with (folder / "test_errors.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    indices = np.array([int(row["trajectory"]) for row in rows])
    trained = common.load_surrogate(folder.name, folder.parent)
    times, indentations = data.grid(indices)
    edge = edge_from_counts(data.points_per_phase, len(indices))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        force = trained.predict(times, indentations, tabor=data.protocols["tabor"][indices], edge=edge)
    scale = trained.scaling.scale_force
    found = np.mean((scale(force) - scale(data.force[indices])) ** 2, axis=1)
    written = np.array([float(row["mse"]) for row in rows])
    return float(np.abs(found - written).max() / written.mean())


def standing(folder: Path, data: TrajectoryDataset) -> dict[str, Any]:
    """Whether one model belongs to a data set, with what that rests on."""
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    train = Split.load(folder / "split.json").train
    agree = None if run.get("extra_dataset_sha256") else forces_agree(folder, data, train)
    difference = error_difference(folder, data)
    return {
        "belongs": agree is not False and difference <= SAME_ERROR,
        "scaling_agrees": agree,
        "largest_error_difference": difference,
        "force_mean": Scaling.load(folder / "scaling.json").force[0],
    }


def study(dataset: Path, models: Path) -> dict[str, Any]:
    """Compare every published model with the shipped file."""
    data = TrajectoryDataset.load(dataset)
    found = {}
    for path in sorted(models.glob("[!.]*/run.json")):
        found[path.parent.name] = one = standing(path.parent, data)
        words, difference = "the shipped" if one["belongs"] else "other", one["largest_error_difference"]
        print(f"{path.parent.name}: {words} forces, errors differ by {difference:.2g} at most", flush=True)
    others = [name for name, one in found.items() if not one["belongs"]]
    return {"forces_sha256": data.forces_sha256, "models": found, "others": others}

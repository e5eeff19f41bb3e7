"""Which published models were trained on the forces of the shipped data set file, up to the solver's accuracy.

The digest that all trainings record (`dataset_sha256`) covers the protocols, not the simulated forces, which another
version of the solver changes within its accuracy. A model belongs to the shipped file if two conditions hold: the
statistics of the training forces in its `scaling.json` are those of the file, and the mean error of its weights on the
test part of the file is the mean of its recorded errors. The statistics cannot be computed again if a second data set
joined the training, the errors if the weights are not published; the other condition alone then decides.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.text_files import read_json
from experiments import common
from experiments.common import Dataset, Models
from experiments.harness import progress
from experiments.run_folders import read_table
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.scaling import Scaling, symlog

SAME = 1e-3
"""Largest relative difference of two means of the same forces: half the accuracy at which the file is computed."""
SAME_ERROR = 0.05
"""Largest relative difference of the mean test MSE."""


def forces_agree(folder: Path, data: TrajectoryDataset, train: np.ndarray) -> bool:
    """Whether the scaling of a model was computed from the forces of the trajectories `train`."""
    values = symlog(data.force[train])
    mean, deviation = Scaling.load(folder / "scaling.json").force
    return math.isclose(mean, values.mean(), rel_tol=SAME) and math.isclose(deviation, values.std(), rel_tol=SAME)


def error_difference(folder: Path, data: TrajectoryDataset) -> float:
    """Relative difference between the recorded mean test MSE and that of the model's weights on a data set."""
    errors = read_table(folder, "test_errors")
    indices = errors["trajectory"].astype(int)
    trained = common.load_surrogate(folder.name, folder.parent)
    force = common.predicted(trained, *data.grid(indices), data.protocols["tabor"][indices])
    scale = trained.scaling.scale_force
    squares = np.mean((scale(force) - scale(data.force[indices])) ** 2, axis=1)
    return float(abs(squares.mean() / errors["mse"].mean() - 1.0))


def study(dataset: Dataset, models: Models) -> dict[str, Any]:
    """Compare every published model with the shipped file."""
    data, comparisons = TrajectoryDataset.load(dataset), {}
    for path in progress(sorted(models.glob("[!.]*/run.json")), "models"):
        folder, two = path.parent, read_json(path).get("extra_dataset_sha256")
        agree = two or forces_agree(folder, data, Split.of(folder).train)
        weights = (folder / "model.weights.h5").is_file()
        difference = error_difference(folder, data) if weights else None
        belongs = agree and (difference or 0.0) <= SAME_ERROR
        comparisons[folder.name] = {"belongs": bool(belongs), "error_difference": difference}
    foreign = [name for name, comparison in comparisons.items() if not comparison["belongs"]]
    return {"forces_sha256": data.forces_sha256, "models": comparisons, "others": foreign}

"""Statistics of the data set: cost, failures, jumps, and the resolution floor of the measurement steps.

The resolution floor is the error of the pull-off force that the fixed measurement steps alone cause: the largest force
at the steps of the unloading phase, compared with the largest force at the solver's own time steps. A surrogate that
predicts the steps cannot be distinguished from the solver below this error.

A trajectory is still attached at its end if its end force exceeds the far-field attraction there
(`bem.results.trajectory.far_field`); its pull-off force is then the largest force so far.

Cost is given as the seconds of the solver; as the seconds of the workers on trajectories, which include measuring and
saving, over these; and as the whole run, wall time times workers, over these. The parallel efficiency is the share of
the whole run that was spent on trajectories. The force ratio, pull-off force over largest compression, is undefined for
a trajectory that is never compressed; such trajectories are counted and left out.
"""

from typing import Any

import numpy as np
from scipy.stats import spearmanr

from bem._support.validation import FloatArray
from bem.dataset.file import Dataset, load_dataset
from bem.problem.protocol import default_start_indentation
from bem.results.trajectory import far_field
from experiments.common import DATASET
from experiments.common import Dataset as DatasetFile
from experiments.paper_numbers import stated
from surrogate.data.metrics import pull_off

PERCENTILES = {"median": 50.0, "p90": 90.0, "p99": 99.0, "largest": 100.0}


def percentiles(values: FloatArray) -> dict[str, float]:
    """Median, 90th and 99th percentile, and maximum of the values."""
    return {name: float(np.percentile(values, percent)) for name, percent in PERCENTILES.items()}


def resolution_floor(dataset: Dataset) -> dict[str, FloatArray]:
    """Relative error of pull-off force and pull-off time on the measurement steps, each of shape (completed,)."""
    rows = dataset.completed
    # The peak is the first point of the unloading phase.
    first = dataset.counts[0] + dataset.counts[1] - 1
    grid_force, grid_time = pull_off(dataset.grid()[0][rows], dataset.force[rows].astype(np.float64), first)
    force, time = (dataset.scalars[name][rows] for name in ("pull_off_force", "pull_off_time"))
    return {
        "pull_off_force": np.abs(grid_force - force) / np.abs(force),
        "pull_off_time": np.abs(grid_time - time) / time,
    }


def force_ratio(dataset: Dataset) -> FloatArray:
    """Pull-off force over largest compression of the completed trajectories that are ever compressed."""
    force, compression = (dataset.scalars[name][dataset.completed] for name in ("pull_off_force", "max_compression"))
    compressed = compression < 0.0
    return force[compressed] / -compression[compressed]


def still_attached(dataset: Dataset) -> np.ndarray:
    """Whether each completed trajectory ends attached, judged by its end force: bool, of shape (completed,)."""
    rows = dataset.completed
    end = default_start_indentation(dataset.protocols["tabor"][rows])
    return ~far_field(dataset.scalars["end_force"][rows], end)


def rank_correlation(first: FloatArray, second: FloatArray) -> float:
    """Spearman's rank correlation; zero where a column is constant."""
    return float(spearmanr(first, second).statistic) if np.ptp(first) and np.ptp(second) else 0.0


def statistics(dataset: Dataset) -> dict[str, Any]:
    """The statistics of a data set that the tables show."""
    rows, scalars = dataset.completed, dataset.scalars
    floor = resolution_floor(dataset)
    force, seconds = scalars["pull_off_force"][rows], scalars["solver_seconds"]
    ratio = force_ratio(dataset)
    attributes = dataset.attributes
    workers_seconds = attributes["wall_seconds"] * attributes["workers"]
    columns = np.stack(list(dataset.protocols.values()), axis=1)
    return {
        "trajectories": len(dataset),
        "completed": len(rows),
        "distinct_protocols": len(np.unique(columns, axis=0)),
        "ranges": {name: [float(values.min()), float(values.max())] for name, values in dataset.protocols.items()},
        "solver_seconds": {
            "mean": float(seconds.mean()),
            "sum": float(seconds.sum()),
            "range": [float(seconds.min()), float(seconds.max())],
            **percentiles(seconds),
        },
        **{name: attributes[name] for name in ("core_seconds", "wall_seconds", "workers", "host", "accuracy")},
        "trajectories_over_solver": float(attributes["core_seconds"] / seconds.sum()),
        "run_over_solver": float(workers_seconds / seconds.sum()),
        "parallel_efficiency": float(attributes["core_seconds"] / workers_seconds),
        "peak_memory": attributes.get("peak_memory"),
        "with_jumps": float(np.mean(scalars["jump_count"][rows] > 0)),
        "still_attached": float(np.mean(still_attached(dataset))),
        "end_force_above_half_pull_off": float(np.mean(scalars["end_force"][rows] > 0.5 * force)),
        "pull_off_time": [float(bound) for bound in np.percentile(scalars["pull_off_time"][rows], [0.0, 100.0])],
        "pull_off_after_paper_longest": float(
            np.mean(scalars["pull_off_time"][rows] > stated("dataset:longest_pull_off_time"))
        ),
        "cost_grows": {
            "with tabor": rank_correlation(dataset.protocols["tabor"], seconds),
            "with peak_indentation": rank_correlation(dataset.protocols["peak_indentation"], seconds),
            "with slow unloading": -rank_correlation(dataset.protocols["unloading_rate"], seconds),
        },
        "never_compressed": len(rows) - len(ratio),
        "force_ratio": [float(ratio.min()), float(ratio.max())] if len(ratio) else None,
        "resolution_floor": {name: percentiles(values) for name, values in floor.items()},
        "floor_above_20_percent": float(np.mean(floor["pull_off_force"] > 0.2)),
    }


def study(dataset: DatasetFile = DATASET) -> dict[str, Any]:
    """The statistics of a data set."""
    return {"dataset": dataset.name, **statistics(load_dataset(dataset))}

"""How well an input representation of the surrogates shows the length of a measurement step.

The force after a step depends on how long the step lasts. A representation shows the length if a linear function of the
scaled inputs of the step and of the one before, as a network's first layer computes, gives its logarithm. The study
reports the share of the variance that this function explains (R^2) on the test set, after a least-squares fit to the
training set. During the dwell the indentation is constant, the velocity is zero, and only time can show the length.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from experiments.common import DATASET, write_result
from experiments.timing import MEASUREMENTS, DatasetFile, Out
from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.scaling import Scaling
from surrogate.training.evaluation import physical_channels

OUT = MEASUREMENTS / "step_length.json"
SETS = "ABCDE"
PHASES = ("loading", "dwell", "unloading")


def phases(counts: tuple[int, int, int]) -> dict[str, np.ndarray]:
    """Steps of each phase whose step before is in the same phase, as indices of their last points.

    The last point of a phase is the first one of the next.
    """
    bounds = np.cumsum((0, *counts))
    bounds[1:] -= 1
    steps = (np.arange(first + 2, last + 1) for first, last in pairwise(bounds))
    return dict(zip(PHASES, steps, strict=True))


def seen_and_lengths(scaled: np.ndarray, times: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scaled inputs of each step and of the one before, and the logarithm of the step's length.

    Args:
        scaled: Scaled channels of shape (n, N, channels).
        times: Instants of shape (n, N).
        steps: Indices of k steps, above zero.

    Returns:
        Arrays of shape (n k, 2 channels) and (n k,).
    """
    inputs = np.concatenate([scaled[:, steps], scaled[:, steps - 1]], axis=-1)
    return inputs.reshape(-1, inputs.shape[-1]), np.log(times[:, steps] - times[:, steps - 1]).ravel()


def explained(data: TrajectoryDataset, features: str) -> dict[str, float]:
    """Share of the variance of log step length that one feature set explains, for each phase."""
    from sklearn.linear_model import LinearRegression

    split = data.split()
    fitted = Scaling.fit(
        physical_channels(data, split.train, features),
        tabor=data.protocols_of(split.train)["tabor"],
        force=data.force[split.train],
        features=features,
    )

    def prepared(indices: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        scaled = fitted.scale_channels(physical_channels(data, indices, features))
        return seen_and_lengths(scaled, data.grid(indices)[0], steps)

    return {
        phase: float(LinearRegression().fit(*prepared(split.train, steps)).score(*prepared(split.test, steps)))
        for phase, steps in phases(data.points_per_phase).items()
    }


def main(
    dataset: DatasetFile = DATASET,
    out: Out = OUT,
) -> None:
    """Measure how well the inputs A to E show the length of a step (half a minute)."""
    data = TrajectoryDataset.load(dataset)
    sets: dict[str, Any] = {}
    for features in SETS:
        sets[features] = explained(data, features)
        print(features, *(f"{phase} {share:.3f}" for phase, share in sets[features].items()), flush=True)
    write_result(out, "step_length", {"sets": sets})

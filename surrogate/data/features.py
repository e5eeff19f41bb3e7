"""Input channels of the sequence models, computed from an indentation history.

The paper compares four feature sets (its appendix "Effects of Training-Set Size and Physics-Guided Input
Representation", Config A to Config D):

====  ==========================================  ========
set   channels                                    count
====  ==========================================  ========
A     time, indentation                           2
B     time, indentation, velocity                 3
C     time, indentation, velocity, acceleration   4
D     time, indentation, velocity, edge           4
====  ==========================================  ========

D is the default. Velocity is the backward difference of indentation over time, which is causal; the first velocity is
zero, because the sphere starts from rest. Acceleration is the backward difference of the velocity, smoothed by an
exponential moving average; the paper states no smoothing factor, and `ACCELERATION_SMOOTHING` is the one used here.
Edge is one at the first and at the last point of the dwell and zero elsewhere (the paper's section "Surrogate-model
inputs and targets"). All arrays are dimensionless and of shape `(batch, steps)`.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from bem._support.wording import shown

ACCELERATION_SMOOTHING = 0.3
"""Weight of the newest value in the moving average of the acceleration."""

FEATURE_SETS: dict[str, tuple[str, ...]] = {
    "A": ("time", "indentation"),
    "B": ("time", "indentation", "velocity"),
    "C": ("time", "indentation", "velocity", "acceleration"),
    "D": ("time", "indentation", "velocity", "edge"),
}
PLATEAU_TOLERANCE = 1e-9
"""Largest change between two points of a plateau, relative to the largest indentation; it allows for rounding."""


def channel_names(features: str) -> tuple[str, ...]:
    """Return the channel names of a feature set.

    Raises:
        ValueError: the feature set is unknown; the message lists the known ones.
    """
    if features not in FEATURE_SETS:
        raise ValueError(f"features must be one of {', '.join(FEATURE_SETS)}; received {shown(features)}")
    return FEATURE_SETS[features]


def plateau(indentation: np.ndarray) -> tuple[int, int] | None:
    """Return the plateau of one history: its longest run of constant indentation.

    Args:
        indentation: A 1D array of shape `(steps,)`.

    Returns:
        Indices of the first and the last point of the run; the first run, if several are equally long. `None`, if no
        two neighbouring points are equal up to rounding.
    """
    tolerance = PLATEAU_TOLERANCE * float(np.max(np.abs(indentation), initial=0.0))
    still = np.concatenate([[False], np.abs(np.diff(indentation)) <= tolerance, [False]])
    changes = np.flatnonzero(still[1:] != still[:-1])
    if changes.size == 0:
        return None
    starts, ends = changes[::2], changes[1::2]
    longest = int(np.argmax(ends - starts))
    return int(starts[longest]), int(ends[longest])


def edge_from_indentations(indentations: np.ndarray) -> np.ndarray:
    """Return the edge channel of histories, with the plateau of each history as its dwell.

    Args:
        indentations: A 2D array of shape `(batch, steps)`.

    Returns:
        An array of the same shape: one at the first and the last point of each plateau, zero elsewhere. It is zero
        throughout a history without a plateau.
    """
    edge = np.zeros_like(indentations, dtype=np.float64)
    for row, indentation in zip(edge, indentations, strict=True):
        ends = plateau(indentation)
        if ends is not None:
            row[list(ends)] = 1.0
    return edge


def edge_from_counts(points_per_phase: tuple[int, int, int], batch: int) -> np.ndarray:
    """Return the edge channel of histories on fixed measurement steps.

    Args:
        points_per_phase: Number of points in loading, dwell and unloading, `(50, 20, 50)` in the paper. The last point
            of loading is the first point of the dwell.
        batch: Number of histories.

    Returns:
        An array of shape `(batch, steps)`: one at the first and the last point of the dwell, zero elsewhere.
    """
    loading, dwell, unloading = points_per_phase
    edge = np.zeros((batch, loading + dwell + unloading))
    edge[:, [loading - 1, loading + dwell - 1]] = 1.0
    return edge


def channels(times: np.ndarray, indentations: np.ndarray, edge: np.ndarray, features: str = "D") -> np.ndarray:
    """Return the physical (unscaled) channels of a feature set.

    Args:
        times: A 2D array of shape `(batch, steps)`, strictly increasing along the steps.
        indentations: An array of the same shape.
        edge: An array of the same shape, from `edge_from_indentations` or `edge_from_counts`.
        features: The feature set, `"A"` to `"D"`.

    Returns:
        A 3D array of shape `(batch, steps, channels)`, float64.

    Raises:
        ValueError: the feature set is unknown.
    """
    names = channel_names(features)
    since = times - times[:, :1]
    velocity = _slope(since, indentations)
    columns = {"time": since, "indentation": indentations, "velocity": velocity, "edge": edge}
    if "acceleration" in names:
        weights = [ACCELERATION_SMOOTHING], [1.0, ACCELERATION_SMOOTHING - 1.0]
        columns["acceleration"] = lfilter(*weights, _slope(since, velocity), axis=1)
    return np.stack([columns[name] for name in names], axis=2).astype(np.float64)


def _slope(times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Backward differences along the steps; the first one is zero."""
    slope = np.zeros(values.shape)
    slope[:, 1:] = np.diff(values) / np.diff(times)
    return slope

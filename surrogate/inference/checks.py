"""Checks of the inputs to a trained model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.validation import real_array
from bem.protocol import LARGEST_INDENTATION, LARGEST_RATE, LONGEST_DWELL, SMALLEST_RATE

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

LONGEST_HISTORY = LONGEST_DWELL + 4.0 * LARGEST_INDENTATION / SMALLEST_RATE
"""Duration of the slowest protocol, in retardation times."""

SHORTEST_STEP = 1e-24
"""Far below what any allowed motion needs, and far above where divisions by it overflow."""


def real_number(name: str, value: Any) -> float:
    """Return one number as a float, NaN and infinity included.

    Raises:
        ValueError: no real number, or several.
    """
    number = real_array(name, value)
    if number.size != 1:
        raise ValueError(f"Expected one number as {name}. Received: shape {number.shape}")
    return float(number.item())


def checked_tabor(tabor: ArrayLike, count: int) -> np.ndarray:
    """Return one Tabor parameter per history, shape `(count,)`.

    Raises:
        ValueError: a number of them that does not fit, or one that is not real, finite and above zero.
    """
    tabor = real_array("tabor", tabor)
    if tabor.ndim > 1 or tabor.size not in (1, count):
        raise ValueError(f"Expected one Tabor parameter per history ({count}). Received: shape {tabor.shape}")
    tabor = np.broadcast_to(tabor.reshape(-1), (count,))
    bad = np.flatnonzero(~(np.isfinite(tabor) & (tabor > 0.0)))
    if bad.size:
        value = float(tabor[bad[0]])
        raise ValueError(f"Expected finite Tabor parameters above zero. Received: tabor={value!r} of history {bad[0]}")
    return tabor


def check_history(times: np.ndarray, indentations: np.ndarray) -> None:
    """Check times and indentations of shape `(batch, steps)`.

    Raises:
        ValueError: other shapes, NaN or infinity, times that do not increase, or numbers beyond the bounds of
            `bem.protocol`.
    """
    if times.ndim != 2 or times.shape != indentations.shape or times.size == 0:
        raise ValueError(
            "Expected times and indentations of one shape (batch, steps). "
            f"Received: times of shape {times.shape}, indentations of shape {indentations.shape}"
        )
    for name, values in (("times", times), ("indentations", indentations)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if bad.size:
            raise ValueError(f"Expected finite {name}. Received: NaN or infinity in history {bad[0]}")
    # As the models see them, from the first on, where close times of a distant clock may coincide.
    since = times - times[:, :1]
    steps = np.diff(since, axis=1)
    bad = np.flatnonzero((steps <= 0.0).any(axis=1))
    if bad.size:
        step = int(np.argmax(steps[bad[0]] <= 0.0)) + 1
        raise ValueError(
            "Expected times that increase strictly. "
            f"Received: {float(times[bad[0], step])!r} after {float(times[bad[0], step - 1])!r} in history {bad[0]}"
        )
    _within("indentations", indentations, -LARGEST_INDENTATION, LARGEST_INDENTATION)
    _within("times after the first", since, 0.0, LONGEST_HISTORY)
    _within("time steps", steps, SHORTEST_STEP, LONGEST_HISTORY)
    _within("rates", np.diff(indentations, axis=1) / steps, -LARGEST_RATE, LARGEST_RATE)


def checked_edge(edge: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    """Return edge marks as float64.

    Raises:
        ValueError: another shape, or a mark that is neither zero nor one.
    """
    edge = real_array("edge", edge)
    if edge.shape != shape:
        raise ValueError(f"Expected edge marks of shape {shape}. Received: shape {edge.shape}")
    bad = edge[~((edge == 0.0) | (edge == 1.0))]
    if bad.size:
        raise ValueError(f"Expected edge marks of zero or one. Received: {bad[0]:g}")
    return edge


def _within(name: str, values: np.ndarray, low: float, high: float) -> None:
    if values.size and not (values.min() >= low and values.max() <= high):
        row, column = np.argwhere((values < low) | (values > high))[0]
        raise ValueError(
            f"Expected {name} within {low:g} and {high:g}. Received: {float(values[row, column])!r} in history {row}"
        )

"""Checks of the inputs of a trained model; quantities are dimensionless, as in `bem.protocol`."""

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
"""Smallest time step: far below that of any allowed motion, and far above that at which a division overflows."""


def real_number(name: str, value: Any) -> float:
    """Return a value as a float; NaN and infinity are allowed.

    Args:
        name: Name of the quantity, for the error message.
        value: A number, or an array with one element.

    Raises:
        ValueError: the value is not one real number.
    """
    number = real_array(name, value)
    if number.size != 1:
        raise ValueError(f"Expected one number as {name}. Received: shape {number.shape}")
    return float(number.item())


def checked_tabor(tabor: ArrayLike, count: int) -> np.ndarray:
    """Return one Tabor parameter per history, shape `(count,)`, from one per history or one for all.

    Raises:
        ValueError: the number of values is neither one nor `count`, or a value is not real, finite and above zero.
    """
    return _one_each("tabor", tabor, count, "Tabor parameter per history", "finite Tabor parameters above zero")


def checked_modulus_ratio(modulus_ratio: ArrayLike, count: int) -> np.ndarray:
    """Return one modulus ratio per history, shape `(count,)`, from one per history or one for all.

    Raises:
        ValueError: they are neither, or lie outside (0, 1].
    """
    words = "modulus ratio per protocol", "modulus ratios in (0, 1]"
    return _one_each("modulus_ratio", modulus_ratio, count, *words, most=1.0)


def _one_each(name: str, given: ArrayLike, count: int, each: str, allowed: str, most: float = np.inf) -> np.ndarray:
    """One value per history, finite, above zero and at most `most`; the words are those of the error messages."""
    values = real_array(name, given)
    if values.ndim > 1 or values.size not in (1, count):
        raise ValueError(f"Expected one {each} ({count}). Received: shape {values.shape}")
    values = np.broadcast_to(values.reshape(-1), (count,))
    bad = np.flatnonzero(~(np.isfinite(values) & (values > 0.0) & (values <= most)))
    if bad.size:
        place = _place(f"of {each.split()[-1]}", bad[0], count)
        raise ValueError(f"Expected {allowed}. Received: {name}={float(values[bad[0]])!r}{place}")
    return values


def check_history(times: np.ndarray, indentations: np.ndarray) -> None:
    """Check times and indentations of shape `(batch, steps)`.

    Raises:
        ValueError: the shapes differ, a value is NaN or infinite, times do not increase strictly, or a value is outside
            the bounds of `bem.protocol`.
    """
    if times.ndim != 2 or times.shape != indentations.shape or times.size == 0:
        raise ValueError(
            "Expected times and indentations of the same shape (batch, steps). "
            f"Received: times of shape {times.shape}, indentations of shape {indentations.shape}"
        )
    for name, values in (("times", times), ("indentations", indentations)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if bad.size:
            raise ValueError(
                f"Expected finite {name}. Received: NaN or infinity{_place('in history', bad[0], len(values))}"
            )
    # Models use the time since the first point; by rounding, two late times may have the same one.
    since = times - times[:, :1]
    steps = np.diff(since, axis=1)
    bad = np.flatnonzero((steps <= 0.0).any(axis=1))
    if bad.size:
        step = int(np.argmax(steps[bad[0]] <= 0.0)) + 1
        found = f"{float(times[bad[0], step])!r} after {float(times[bad[0], step - 1])!r}"
        place = _place("in history", bad[0], len(times))
        raise ValueError(f"Expected times that increase strictly. Received: {found}{place}")
    _within("indentations", indentations, -LARGEST_INDENTATION, LARGEST_INDENTATION)
    _within("times after the first", since, 0.0, LONGEST_HISTORY)
    _within("time steps", steps, SHORTEST_STEP, LONGEST_HISTORY)
    _within("rates", np.diff(indentations, axis=1) / steps, -LARGEST_RATE, LARGEST_RATE)


def checked_edge(edge: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    """Return edge marks of shape `shape` as float64.

    Raises:
        ValueError: the shape is another one, or a mark is neither zero nor one.
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
        place = _place("in history", row, len(values))
        raise ValueError(
            f"Expected {name} within {low:g} and {high:g}. Received: {float(values[row, column])!r}{place}"
        )


def _place(words: str, index: int, count: int) -> str:
    """Where a value is, in words; nothing if there is only one place."""
    return f" {words} {index}" if count > 1 else ""

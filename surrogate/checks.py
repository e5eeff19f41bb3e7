"""What a user may ask of a trained model, and which protocol an indentation history is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from surrogate.features import plateau

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def checked_tabor(tabor: ArrayLike, count: int) -> np.ndarray:
    """Return one Tabor parameter per history, shape `(count,)`.

    Raises:
        ValueError: a number of them that does not fit, or one that is not finite and above zero.
    """
    tabor = np.asarray(tabor, dtype=np.float64)
    if tabor.ndim > 1 or tabor.size not in (1, count):
        raise ValueError(f"Expected one Tabor parameter per history ({count}). Received: shape {tabor.shape}")
    tabor = np.broadcast_to(tabor.reshape(-1), (count,))
    if not (np.isfinite(tabor).all() and (tabor > 0).all()):
        raise ValueError(f"Expected finite Tabor parameters above zero. Received: tabor={tabor}")
    return tabor


def protocol_quantities(times: np.ndarray, indentations: np.ndarray) -> dict[str, np.ndarray]:
    """Recover peak, rates and dwell time of every history; NaN where a phase is absent."""
    rows = []
    for time, indentation in zip(times, indentations, strict=True):
        peak = int(np.argmax(indentation))
        onset, end = plateau(indentation) or (peak, peak)
        loading = (indentation[onset] - indentation[0]) / (time[onset] - time[0]) if onset else np.nan
        last = len(time) - 1
        unloading = (indentation[end] - indentation[last]) / (time[last] - time[end]) if end < last else np.nan
        rows.append((indentation[peak], loading, time[end] - time[onset], unloading))
    keys = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
    return dict(zip(keys, np.array(rows).T, strict=True))


def check_history(times: np.ndarray, indentations: np.ndarray) -> None:
    """Check times and indentations of shape `(batch, steps)`.

    Raises:
        ValueError: other shapes, NaN or infinity, or times that do not increase.
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
    bad = np.flatnonzero((np.diff(times, axis=1) <= 0).any(axis=1))
    if bad.size:
        step = int(np.argmax(np.diff(times[bad[0]]) <= 0)) + 1
        raise ValueError(
            "Expected times that increase strictly. "
            f"Received: {times[bad[0], step]!r} after {times[bad[0], step - 1]!r} in history {bad[0]}"
        )

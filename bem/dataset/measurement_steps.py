"""Fixed measurement steps (FMS): where a protocol is sampled; `Trajectory.at` gives the force there.

Each phase receives a prescribed number of equally spaced points, by default 50, 20 and 50. Source: paper, section "Data
mapping" and the appendix on FMS resolution. Units as in `bem.problem.protocol`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bem._support.validation import FloatArray, whole_number
from bem._support.wording import shown
from bem.problem.protocol import default_start_indentation

FMS = (50, 20, 50)
PULL_OFF = (22, 8, 72)
"""Points of loading, dwell and unloading of `bem.dataset.pull_off_steps`: fewer than `FMS` in all."""
STEPS = ("uniform", "pull-off")
"""Kinds of measurement steps: as the paper's, and around the pull-off that was found (`bem.dataset.pull_off_steps`)."""
FIRST_UNLOADING = FMS[0] + FMS[1] - 1
"""Index of the step at which the dwell ends and the unloading begins."""


def proportional_counts(total: int) -> tuple[int, int, int]:
    """Points for loading, dwell and unloading in the proportion 50 : 20 : 50, adding up to `total` >= 6."""
    total = whole_number("total", total, low=6)
    ramp = round(total * FMS[0] / sum(FMS))
    return ramp, total - 2 * ramp, ramp


def checked_counts(counts: Sequence[int]) -> tuple[int, int, int]:
    """Return the counts of loading, dwell and unloading points when they are whole numbers and enough.

    Raises:
        ValueError: naming what is allowed and what was received.
    """
    entries = list(counts) if np.iterable(counts) else []
    integers = [int(count) for count in entries if isinstance(count, int | np.integer) and not isinstance(count, bool)]
    if not len(integers) == len(entries) == 3 or any(
        count < least for count, least in zip(integers, (2, 0, 1), strict=True)
    ):
        raise ValueError(
            "counts must be three integers, at least 2 (loading), 0 (dwell) and 1 (unloading); "
            f"received {shown(counts)}"
        )
    return integers[0], integers[1], integers[2]


def measurement_grid(
    *,
    tabor: ArrayLike,
    peak_indentation: ArrayLike,
    loading_rate: ArrayLike,
    dwell_time: ArrayLike,
    unloading_rate: ArrayLike,
    counts: Sequence[int] = FMS,
    start_indentation: ArrayLike | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Measurement instants and indentations of many protocols at once.

    Loading points include the start and the peak, dwell points the end of the dwell but not its beginning, unloading
    points the end but not their beginning, so that no instant is listed twice.

    Args:
        tabor, peak_indentation, loading_rate, dwell_time, unloading_rate: one value for each of B protocols, shape (B,)
            or scalar.
        counts: points in the loading, dwell and unloading phases, N in all.
        start_indentation: shape (B,) or scalar; by default -pi^(2/3) mu.

    Returns:
        times and indentations, each of shape (B, N) and float64.

    Raises:
        ValueError: when a peak does not lie above its start, dwell points are asked of a protocol without dwell, or
            instants coincide in double precision.
    """
    n_load, n_dwell, n_unload = checked_counts(counts)
    if start_indentation is None:
        start_indentation = default_start_indentation(np.asarray(tabor, dtype=np.float64))
    quantities = (start_indentation, peak_indentation, loading_rate, dwell_time, unloading_rate)
    columns = (np.atleast_1d(np.asarray(values, dtype=np.float64))[:, np.newaxis] for values in quantities)
    delta_0, delta_l, v_load, dwell, v_unload = np.broadcast_arrays(*columns)
    if np.any(backward := ~(delta_l > delta_0)):
        row = int(np.flatnonzero(backward)[0])
        raise ValueError(
            "peak_indentation must lie above the start indentation; received protocol "
            f"{row} with {float(delta_l[row, 0])!r} and a start of {float(delta_0[row, 0])!r}"
        )
    loading = np.linspace(0.0, 1.0, n_load)
    dwelling = np.arange(1, n_dwell + 1) / max(n_dwell, 1)
    unloading = np.arange(1, n_unload + 1) / n_unload
    travel = delta_l - delta_0
    t1 = travel / v_load
    t2 = t1 + dwell
    t3 = t2 + travel / v_unload
    times = np.concatenate([t1 * loading, t1 + (t2 - t1) * dwelling, t2 + (t3 - t2) * unloading], axis=1)
    flat = np.ones(n_dwell)
    # Weights rather than differences, so that peak and start are met exactly.
    rise = np.concatenate([loading, flat, 1.0 - unloading])
    indentations = delta_0 * (1.0 - rise) + delta_l * rise
    require_steps(times, n_dwell, dwell, np.concatenate([t1, t2, t3], axis=1), "phase times")
    return times, indentations


def require_steps(times: FloatArray, points: int, dwell_time: FloatArray, quantities: FloatArray, name: str) -> None:
    """Refuse instants (B, N) that coincide, and dwell `points` of protocols, of any shape, that have no dwell.

    The `quantities` (B, m) of each protocol are shown, by their `name`.

    Raises:
        ValueError: naming the protocol, or points and dwell.
    """
    if points and (dwell_time <= 0.0).any():
        raise ValueError(
            "counts must ask for no dwell points where dwell_time is 0; "
            f"received {points} with a dwell_time of {float(dwell_time.min())!r}"
        )
    if not (rises := times[:, 1:] > times[:, :-1]).all():
        row = int(rises.all(axis=1).argmin())
        raise ValueError(
            "measurement times must be strictly increasing in double precision; received protocol "
            f"{row} with {name} {', '.join(map(repr, quantities[row].tolist()))}"
        )

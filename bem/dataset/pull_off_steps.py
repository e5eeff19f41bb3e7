"""Measurement steps around a pull-off that is known, for any linear solid.

Fifty equally spaced unloading points step over a narrow pull-off peak. Where a simulation has found the pull-off, or a
surrogate has predicted it, one step of the unloading lies at it, and the others are spaced evenly in log s around it, s
the indentation below the crossing of the force of Lee and Radok. Loading points are equally spaced; those of the dwell
and of the unloading before the crossing are spaced half by time, half by the change of that force. Units as in
`bem.problem.protocol`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import kernel
from bem._support.validation import FloatArray
from bem.dataset.lee_radok import held_to_unloading, relaxation_spectra, to_crossing
from bem.dataset.measurement_steps import PULL_OFF, checked_counts, require_steps
from bem.problem.protocol import default_start_indentation

BEFORE_CROSSING = 0.22  # share of the unloading points before the crossing
_FIRST = 0.05  # smallest offset after the crossing, in h0
_RANGES = np.array([-1.2, -0.4, -0.12, 0.0, 0.12, 0.4])  # bounds of ranges after it, less the log s of the pull-off
_SHARES = np.array([0.0, 0.08, 0.2, 0.32, 0.5, 0.68, 0.8, 1.0])  # of the points after the crossing up to each bound


def pull_off_grid(
    *,
    tabor: ArrayLike,
    peak_indentation: ArrayLike,
    loading_rate: ArrayLike,
    dwell_time: ArrayLike,
    unloading_rate: ArrayLike,
    strengths: ArrayLike,
    retardation_times: ArrayLike,
    pull_off_time: ArrayLike,
    counts: Sequence[int] = PULL_OFF,
    start_indentation: ArrayLike | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Measurement instants and indentations of many protocols at once.

    Args:
        tabor, peak_indentation, loading_rate, dwell_time, unloading_rate: one value for each of B protocols, shape (B,)
            or scalar.
        strengths, retardation_times: of each solid, shape (B, m); terms of strength zero are left out.
        pull_off_time: instant of the pull-off, shape (B,); where it is NaN, all instants after the crossing are.
        counts: points in the loading, dwell and unloading phases, N in all.
        start_indentation: shape (B,) or scalar; by default -pi^(2/3) mu.

    Returns:
        times and indentations, each of shape (B, N) and float64.

    Raises:
        ValueError: fewer than 16 unloading points, dwell points asked of a protocol without dwell, or instants that
            coincide in double precision.
    """
    counts = checked_counts(counts)
    if counts[2] < 16:
        raise ValueError(f"counts must ask for at least 16 unloading points; received {counts[2]}")
    quantities = (tabor, peak_indentation, loading_rate, dwell_time, unloading_rate, start_indentation, pull_off_time)
    protocols = protocol_rows(quantities)
    spectra = relaxation_spectra(*(np.asarray(terms, dtype=np.float64) for terms in (strengths, retardation_times)))
    times, indentations = around_pull_off(protocols, *spectra, np.array(counts))
    certain = np.isfinite(protocols[6])
    require_steps(times[certain], counts[1], protocols[3], protocols[:5].T, "the quantities")
    return times, indentations


def protocol_rows(quantities: Sequence[ArrayLike | None]) -> FloatArray:
    """Quantities of B protocols, each of shape (B,) or scalar, as rows (7, B).

    They are the five of a protocol, the start, by default (`None`) -pi^(2/3) mu, and another.
    """
    start = default_start_indentation(np.asarray(quantities[0], dtype=np.float64))
    filled = [start if values is None else values for values in quantities]
    return np.array(np.broadcast_arrays(*np.atleast_1d(*filled)), dtype=np.float64)


@kernel
def around_pull_off(
    protocols: np.ndarray, moduli: np.ndarray, relaxations: np.ndarray, counts: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Instants and indentations (B, N).

    Args:
        protocols: the five quantities, the start and the pull-off time, float64 (7, B).
        moduli, relaxations: relaxation strengths and times, (B, m).
        counts: points of loading, dwell and unloading, (3,).

    Returns:
        Instants, from 0 on, and indentations.
    """
    batch = protocols.shape[1]
    loading, dwell, unloading = counts
    times = np.empty((batch, loading + dwell + unloading))
    indentations = np.empty_like(times)
    for row in range(batch):
        _, peak, up, dwelt, down, start, pull_off_time = protocols[:, row]
        onset = (peak - start) / up
        turn = onset + dwelt
        for i in range(loading):
            share = i / (loading - 1)
            times[row, i] = onset * share
            indentations[row, i] = start * (1.0 - share) + peak * share
        memory, instants, forces, _, _ = held_to_unloading(peak, up, dwelt, moduli[row], relaxations[row])
        if dwell > 0:
            times[row, loading : loading + dwell] = onset + spread_evenly(instants, forces, dwell)
            indentations[row, loading : loading + dwell] = peak
        travels, forces, _, _ = to_crossing(peak, down, moduli[row], relaxations[row], memory)
        before = max(int(BEFORE_CROSSING * unloading + 0.5), 1)
        travel = np.empty(unloading)
        travel[:before] = spread_evenly(travels, forces, before)
        crossing, room = travels[-1], peak - start
        pull_off = min(max((pull_off_time - turn) * down, 1e-3 * travel[0]), room)
        travel[before:] = crossing + _after(room - crossing, pull_off - crossing, unloading - before)
        travel[unloading - 1] = room
        # One step lies at the pull-off, also where it comes before or barely after the crossing.
        travel[np.argmin(np.abs(travel - pull_off))] = pull_off
        times[row, loading + dwell :] = turn + travel / down
        indentations[row, loading + dwell :] = peak - travel
        indentations[row, loading + dwell + unloading - 1] = start
    return times, indentations


@kernel
def spread_evenly(positions: np.ndarray, force: np.ndarray, count: int) -> np.ndarray:
    """`count` of increasing `positions` (n,), the last included, spaced half by them, half by the change of `force`."""
    n = positions.size
    cumulated = np.zeros(n)
    total = 1e-300
    for i in range(1, n):
        total += abs(force[i] - force[i - 1])
    for i in range(1, n):
        cumulated[i] = (
            cumulated[i - 1]
            + 0.5 * (positions[i] - positions[i - 1]) / (positions[n - 1] - positions[0])
            + 0.5 * abs(force[i] - force[i - 1]) / total
        )
    levels = np.arange(1, count + 1) / count * cumulated[n - 1]
    spread = np.interp(levels, cumulated, positions)
    spread[count - 1] = positions[n - 1]
    return spread


@kernel
def _after(room: float, pull_off: float, count: int) -> np.ndarray:
    """Offsets (count,) below the crossing, the last one down to the start."""
    last = _SHARES.size - 1
    knots = np.empty(last + 1)
    knots[last] = np.log(room)
    knots[0] = min(np.log(_FIRST), knots[last] - 3.0)
    expected = min(np.log(max(pull_off, 1e-300)), knots[last])
    for i in range(1, last):
        knots[i] = min(max(expected + _RANGES[i - 1], knots[i - 1] + 0.05), knots[last] - 0.05 * (last - i))
    return np.exp(np.interp(np.arange(count), np.rint(_SHARES * (count - 1)), knots))

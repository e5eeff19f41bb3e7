"""Measurement steps that follow the physics: most of them where the contact separates.

Fifty equally spaced unloading points step over a narrow pull-off peak (`experiments.surrogates.measurement_steps`
measures by how much). These steps know protocol, Tabor parameter and modulus ratio alone. They rest on the force of Lee
and Radok without adhesion, whose memory of indentation^(3/2) is carried on through the unloading: it crosses zero
shortly before the pull-off. With offsets s of the indentation below that crossing,

- loading points are equally spaced;
- dwell points, and a quarter of the unloading points before the crossing, are spaced half by time, half by the change
  of that force;
- the other unloading points are spaced evenly in log s within ranges around the place where the pull-off is to be
  expected, most of them close to it.

The expected log s is a polynomial of fourth degree in six logarithms: Tabor parameter, unloading rate, modulus ratio,
the travel left after the crossing, the slope of that force at the crossing, and the share of the peak travelled before
it. `make measure-pull-off-place` fits its coefficients to simulations in the paper's ranges and their
corners, and writes them with what is left to `pull_off_place.json` beside this module. Units as in
`bem.problem.protocol`; forces of Lee and Radok are in units of the relaxed Hertz force at indentation 1. Source: Lee
and Radok, J. Appl. Mech. 27 (1960) 438; Johnson, Contact Mechanics (1985), section 6.5.
"""

import json
from collections.abc import Sequence
from importlib import resources
from itertools import chain, combinations_with_replacement

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import kernel
from bem._support.validation import FloatArray
from bem.dataset.measurement_steps import PHYSICAL, checked_counts, require_steps
from bem.problem.materials import StandardLinearSolid
from bem.problem.protocol import default_start_indentation

_FIRST = 0.05  # smallest offset after the crossing, in h0
BEFORE_CROSSING = 0.22  # share of the unloading points before the crossing
_RANGES = (-1.2, -0.4, -0.12, 0.12, 0.4)  # bounds of ranges after it, less the expected log s
_SHARES = (0.0, 0.08, 0.2, 0.32, 0.68, 0.8, 1.0)  # of the other points up to each bound, both ends included
_LEAST_SLOPE = 0.3  # added to the slope at the crossing before its logarithm is taken
# Where the force is computed, as shares of a phase: even in the logarithm, because the fastest relaxation may be far
# faster than the dwell; in the unloading, from fine steps to even ones.
LOADING = np.linspace(0.0, 1.0, 41)
DWELL = np.append(0.0, np.exp(np.linspace(-12.0, 0.0, 40)))
UNLOADING = np.sinh(np.linspace(0.0, 6.0, 81)) / np.sinh(6.0)
_FEATURES, _DEGREE = 6, 4
_TERMS = chain.from_iterable(combinations_with_replacement(range(_FEATURES), size) for size in range(_DEGREE + 1))
FACTORS = np.array([term + (_FEATURES,) * (_DEGREE - len(term)) for term in _TERMS])
"""Features that each term of the polynomial multiplies, shape (210, 4); the number 6 stands for a factor of 1."""
_PLACE = np.array(
    json.loads(resources.files("bem.dataset").joinpath("pull_off_place.json").read_text())["coefficients"]
)


def physical_grid(
    *,
    tabor: ArrayLike,
    peak_indentation: ArrayLike,
    loading_rate: ArrayLike,
    dwell_time: ArrayLike,
    unloading_rate: ArrayLike,
    modulus_ratio: ArrayLike,
    counts: Sequence[int] = PHYSICAL,
    start_indentation: ArrayLike | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Measurement instants and indentations of many protocols at once.

    Args:
        tabor, peak_indentation, loading_rate, dwell_time, unloading_rate: one value for each of B protocols, shape (B,)
            or scalar.
        modulus_ratio: shape (B,) or scalar, of standard linear solids.
        counts: points in the loading, dwell and unloading phases, N in all.
        start_indentation: shape (B,) or scalar; by default -pi^(2/3) mu.

    Returns:
        times and indentations, each of shape (B, N) and float64; the same instants that `measurement_grid` has at the
        start, at the peak, at the end of the dwell and at the end.

    Raises:
        ValueError: a modulus ratio not above 0 and at most 1, fewer than 8 unloading points, dwell points asked of a
            protocol without dwell, a peak not above zero, a start not below it, or instants that coincide in double
            precision.
    """
    counts = checked_counts(counts)
    if counts[2] < 8:
        raise ValueError(f"counts must ask for at least 8 unloading points; received {counts[2]}")
    quantities = (tabor, peak_indentation, loading_rate, dwell_time, unloading_rate, start_indentation, modulus_ratio)
    protocols = protocol_rows(quantities)
    if not (sound := (protocols[6] > 0.0) & (protocols[6] <= 1.0)).all():
        StandardLinearSolid(float(protocols[6, sound.argmin()]))  # says what is allowed
    if not (sound := (protocols[1] > 0.0) & (protocols[5] < 0.0)).all():
        row = int(sound.argmin())
        raise ValueError(
            "peak_indentation must lie above 0, and the start indentation below; received protocol "
            f"{row} with {float(protocols[1, row])!r} and a start of {float(protocols[5, row])!r}"
        )
    times, indentations, *_ = on_steps(protocols, np.array(counts), _PLACE)
    require_steps(times, counts[1], protocols[3], protocols[:5].T, "the quantities")
    return times, indentations


def protocol_rows(quantities: Sequence[ArrayLike | None]) -> FloatArray:
    """Quantities of B protocols, each of shape (B,) or scalar, as rows (7, B).

    They are the five of a protocol, the start, by default (`None`) -pi^(2/3) mu, and another.
    """
    start = default_start_indentation(np.asarray(quantities[0], dtype=np.float64))
    filled = [start if values is None else values for values in quantities]
    return np.array(np.broadcast_arrays(*np.atleast_1d(*filled)), dtype=np.float64)


@kernel
def hertz_power(indentation: float) -> float:
    """The indentation to the power 3/2 in contact, otherwise zero."""
    return indentation * np.sqrt(indentation) if indentation > 0.0 else 0.0


@kernel
def carried(memory: float, rate: float, dt: float, change: float) -> float:
    """A memory int exp(-r (t - s)) du(s) after a step in which u changes linearly: the recursion of all memories."""
    lost = -np.expm1(-rate * dt)
    return memory + (lost / (rate * dt) * change - lost * memory)


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
def _after(room: float, features: np.ndarray, coefficients: np.ndarray, count: int) -> np.ndarray:
    """Offsets (count,) below the crossing, the last one down to the start."""
    expected = 0.0
    for term in range(coefficients.size):
        product = coefficients[term]
        for factor in FACTORS[term]:
            product *= features[factor]
        expected += product
    last = len(_RANGES) + 1
    knots = np.empty(last + 1)
    knots[last] = np.log(room)
    knots[0] = min(np.log(_FIRST), knots[last] - 3.0)
    for i in range(1, last):
        bound = min(expected, knots[last]) + _RANGES[i - 1]
        knots[i] = min(max(bound, knots[i - 1] + 0.05), knots[last] - 0.05 * (last - i))
    offsets = np.exp(np.interp(np.arange(count) / (count - 1), np.array(_SHARES), knots))
    offsets[count - 1] = room
    return offsets


@kernel
def on_steps(
    protocols: np.ndarray, counts: np.ndarray, coefficients: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Steps where the pull-off is expected by the `coefficients` of a polynomial.

    Args:
        protocols: the five quantities, the start and the modulus ratio, float64 (7, B).
        counts: points of loading, dwell and unloading, (3,).
        coefficients: (210,).

    Returns:
        instants and indentations (B, N), the crossings (B,), and the features of the polynomial with 1, (B, 7).
    """
    batch = protocols.shape[1]
    loading, dwell, unloading = counts
    times = np.empty((batch, loading + dwell + unloading))
    indentations = np.empty_like(times)
    crossings, features = np.zeros(batch), np.ones((batch, _FEATURES + 1))
    where, force = np.empty(UNLOADING.size), np.empty(UNLOADING.size)
    for row in range(batch):
        tabor, peak, up, dwelt, down, start, ratio = protocols[:, row]
        rate = 1.0 / ratio  # of relaxation; the strength is one less
        onset = (peak - start) / up
        turn = onset + dwelt
        for i in range(loading):
            share = i / (loading - 1)
            times[row, i] = onset * share
            indentations[row, i] = start * (1.0 - share) + peak * share
        memory = 0.0
        for i in range(1, LOADING.size):
            high, low = peak * LOADING[i], peak * LOADING[i - 1]
            memory = carried(memory, rate, (high - low) / up, hertz_power(high) - hertz_power(low))
        if dwelt > 0.0:
            for i in range(DWELL.size):
                where[i] = dwelt * DWELL[i]
                if i > 0:
                    memory = carried(memory, rate, where[i] - where[i - 1], 0.0)
                force[i] = hertz_power(peak) + (rate - 1.0) * memory
            if dwell > 0:
                spread = spread_evenly(where[: DWELL.size], force[: DWELL.size], dwell)
                times[row, loading : loading + dwell] = onset + spread
            indentations[row, loading : loading + dwell] = peak
        crossing, slope, last = _crossing(peak, down, rate, memory, where, force)
        room = crossing - start
        steep = max(slope, 0.0) + _LEAST_SLOPE
        features[row, :_FEATURES] = np.log(np.array([tabor, down, ratio, room, steep, (peak - crossing) / peak]))
        before = max(int(BEFORE_CROSSING * unloading + 0.5), 1)
        travel = np.empty(unloading)
        travel[:before] = spread_evenly(where[: last + 1], force[: last + 1], before)
        travel[before:] = (peak - crossing) + _after(room, features[row], coefficients, unloading - before)
        travel[unloading - 1] = peak - start
        times[row, loading + dwell :] = turn + travel / down
        indentations[row, loading + dwell :] = peak - travel
        indentations[row, loading + dwell + unloading - 1] = start
        crossings[row] = crossing
    return times, indentations, crossings, features


@kernel
def _crossing(
    peak: float, down: float, rate: float, memory: float, where: np.ndarray, force: np.ndarray
) -> tuple[float, float, int]:
    """Indentation at which the force vanishes, and the slope there; leaves travels in `where`, forces in `force`."""
    strength = rate - 1.0
    where[0], force[0] = 0.0, hertz_power(peak) + strength * memory
    slope = 1.5 * np.sqrt(peak) * rate + strength * rate * memory / down
    for i in range(UNLOADING.size - 1):
        where[i + 1] = peak * UNLOADING[i + 1]
        left = max(peak - where[i + 1], 0.0)
        change = hertz_power(left) - hertz_power(peak - where[i])
        memory = carried(memory, rate, (where[i + 1] - where[i]) / down, change)
        force[i + 1] = hertz_power(left) + strength * memory
        before = slope
        slope = 1.5 * np.sqrt(left) * rate + strength * rate * memory / down
        if force[i + 1] <= 0.0:
            share = force[i] / (force[i] - force[i + 1])
            where[i + 1] = where[i] + share * (where[i + 1] - where[i])
            force[i + 1] = 0.0
            return peak - where[i + 1], before + share * (slope - before), i + 1
    return 0.0, slope, UNLOADING.size - 1

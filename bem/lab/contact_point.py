"""Baseline, noise and contact point of a measured force curve, from its approach.

Before contact the force is a constant. Its mean over the first part of the approach is the baseline, and the scatter
there the noise. The contact begins where the force leaves the baseline permanently, by attraction or by compression.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bem._support.validation import FloatArray

if TYPE_CHECKING:
    from bem.lab.curve import ForceCurve

FEWEST = 10
"""Points of baseline needed, and of contact."""

_FIRST_PART = 0.2  # of the approach, taken for the baseline at first
_LEAVES = 4.0  # standard deviations off the baseline
_DRIFT = 0.1  # of the largest force, between the halves of a baseline
_NONE = 1e-300  # N; stands for a baseline without noise
_STANDS_OUT = 8.0  # standard deviations that the largest force must be off it


@dataclass(frozen=True)
class Contact:
    """Where a curve meets the surface."""

    contact_point: float
    """Indentation, in m, as the curve counts it, at which the force leaves the baseline."""
    force_offset: float
    """Force of the baseline, in N, in the curve's own sign."""
    noise: float
    """Standard deviation of the force on the baseline, in N."""
    index: int
    """First point in contact."""


def find_contact(curve: ForceCurve) -> Contact:
    """Find baseline, noise and contact point of a curve.

    Raises:
        ValueError: the curve has no contact, or no baseline before it.
    """
    deepest = int(np.argmax(curve.indentation))
    force = curve.force[: deepest + 1]
    if force.size < 2 * FEWEST:
        raise ValueError(
            f"a force curve must have at least {2 * FEWEST} points up to its deepest one; received {force.size}"
        )
    first = max(FEWEST, int(_FIRST_PART * force.size))
    offset, noise = _level(force[:first])
    # The attraction before contact, and a longer baseline than the first part, change both a little.
    index = _leaves(force, offset, noise)
    if index >= FEWEST:
        offset, noise = _level(force[:index])
        index = _leaves(force, offset, noise)
    largest = float(np.max(np.abs(force - offset)))
    if not largest > _STANDS_OUT * noise or index >= force.size:
        raise ValueError(
            f"the curve shows no contact: its force stays within {largest:.3g} N of the baseline, whose noise is "
            f"{noise if noise > _NONE else 0.0:.3g} N"
        )
    halves = force[: index // 2], force[index // 2 : index]
    drift = float(np.median(halves[1]) - np.median(halves[0])) if index >= FEWEST else 0.0
    if index < FEWEST or abs(drift) > _DRIFT * largest:
        raise ValueError(
            f"a force curve must begin with at least {FEWEST} points before contact, at one force; received {index}, "
            f"over which the force changes by {drift:.3g} N"
        )
    return Contact(float(curve.indentation[index]), offset, noise, index)


def noise_of(values: FloatArray) -> float:
    """Standard deviation of noise that is independent from point to point, on a smooth curve; robust against jumps."""
    if values.size < 3:
        return 0.0
    second = values[2:] - 2.0 * values[1:-1] + values[:-2]
    return float(1.4826 * np.median(np.abs(second - np.median(second))) / np.sqrt(6.0))


def _level(force: FloatArray) -> tuple[float, float]:
    level = float(np.median(force))
    return level, max(float(1.4826 * np.median(np.abs(force - level))), _NONE)


def _leaves(force: FloatArray, offset: float, noise: float) -> int:
    """Index of the first point after the baseline, by a mean over neighbours, up to the deepest point."""
    away = force - offset
    # A mean over a few points detects a departure earlier than one point does, and a single outlier does not move it.
    width = min(5, force.size)
    mean = np.convolve(away, np.full(width, 1.0 / width), mode="valid")
    threshold = max(_LEAVES * noise / np.sqrt(width), 1e-3 * float(np.max(np.abs(away))))
    out = np.abs(mean) > threshold
    # A force that changes from attraction to compression crosses the baseline once; half of the range is surely
    # contact.
    strong = np.flatnonzero(np.abs(mean) > max(0.5 * _STANDS_OUT * noise, 0.05 * float(np.max(np.abs(mean)))))
    if strong.size == 0:
        return force.size
    quiet = np.flatnonzero(~out[: strong[0] + 1])
    return int(quiet[-1]) + width if quiet.size else int(strong[0])

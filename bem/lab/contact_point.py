"""Baseline, noise and contact point of a measured force curve, from its approach.

Before contact the force is a line, flat or with the tilt of an instrument. The one through the first part of the
approach is the baseline, and the scatter about it the noise. The contact begins where the force leaves the baseline
permanently, by attraction or by compression. A curve that has no baseline begins at contact, at force zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem._support.validation import FloatArray

FEWEST = 10
"""Points of baseline needed, and of contact."""

_FIRST_PART = 0.2  # of the approach, taken for the baseline at first
_SAFE = 0.7  # of the points before contact, in which a force that noise hides does not bend the baseline
_LEAVES = 4.0  # standard deviations off the baseline
_DRIFT = 0.1  # of the largest force, between the halves of a baseline
_RISES = 0.5  # of the range of the force, from which a line through the first part is no baseline
_REACHED = 0.95  # of the largest force, at which an approach surely ends
_SHORTEST = 0.05  # of the approach, for a baseline: noise hides the beginning of a contact
_BEGINS = 0.05  # of the range of the force, up to which a curve without baseline begins at contact
_NONE = 1e-30  # N; stands for a baseline without noise
STANDS_OUT = 8.0  # standard deviations that the largest force must be off it


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
    """First point in contact; zero for a curve without baseline."""


def find_contact(indentation: FloatArray, measured: FloatArray) -> Contact:
    """Find baseline, noise and contact point of a curve.

    Args:
        indentation: in m, shape (n,).
        measured: the force at it, in N, in the curve's own sign.

    Raises:
        ValueError: the curve has no contact, or begins in it.
    """
    deepest = int(np.argmax(indentation))
    # A sphere that creeps under a force is deepest long after its approach.
    pressed = np.abs(measured - np.median(measured[:3]))
    reached = int(np.argmax(pressed >= _REACHED * pressed.max()))
    deepest = reached if 2 * FEWEST <= reached < deepest else deepest
    force = measured[: deepest + 1]
    if force.size < 2 * FEWEST:
        raise ValueError(
            f"a force curve must have at least {2 * FEWEST} points up to its deepest one; received {force.size}"
        )
    first = max(FEWEST, int(_FIRST_PART * force.size))
    line = np.polynomial.Polynomial.fit(np.arange(first), force[:first], 1)
    rise, noise = float(line(first) - line(0)), float(np.std(force[:first] - line(np.arange(first))))
    if abs(rise) * force.size / first > _RISES * float(np.ptp(force)) and abs(rise) > STANDS_OUT * noise:
        return _from_contact_on(indentation, force)
    # The attraction before contact, and a longer baseline than the first part, change the line a little.
    for _ in range(3):
        away, noise, unsure = _off_line(force, first)
        index = _leaves(away, noise, unsure)
        if index < FEWEST:
            break
        first = max(FEWEST, int(_SAFE * index))
    offset = float(np.median(force[:first]))
    largest = float(np.max(np.abs(away)))
    if not largest > STANDS_OUT * noise or index >= force.size:
        later = float(np.max(np.abs(measured[deepest:] - offset), initial=0.0))
        after = f", though it changes by {later:.3g} N later" if later > STANDS_OUT * noise else ""
        raise ValueError(
            f"the approach shows no contact: its force stays within {largest:.3g} N of the baseline, whose noise is "
            f"{noise if noise > _NONE else 0.0:.3g} N{after}"
        )
    halves = away[: index // 2], away[index // 2 : index]
    drift = float(np.median(halves[1]) - np.median(halves[0])) if index >= FEWEST else 0.0
    if index < max(FEWEST, _SHORTEST * force.size):
        return _from_contact_on(indentation, force)
    if abs(drift) > _DRIFT * largest:
        raise ValueError(
            f"the force before contact must be level or drift less than a tenth of the largest; received one that "
            f"changes by {drift:.3g} N, of {largest:.3g} N"
        )
    return Contact(float(indentation[index]), offset, noise, index)


def _from_contact_on(indentation: FloatArray, force: FloatArray) -> Contact:
    """The contact of a curve without baseline, which begins at contact.

    Raises:
        ValueError: it begins in contact.
    """
    if abs(begin := float(np.median(force[:3]))) > _BEGINS * float(np.ptp(force)) + _LEAVES * noise_of(force):
        raise ValueError(
            f"a force curve must begin before contact or at it; received one that begins with {begin:.3g} N, of "
            f"{np.ptp(force):.3g} N at most"
        )
    return Contact(float(indentation[0]), 0.0, noise_of(force), 0)


def noise_of(values: FloatArray) -> float:
    """Standard deviation of noise that is independent from point to point, on a smooth curve; robust against jumps."""
    if values.size < 3:
        return 0.0
    second = values[2:] - 2.0 * values[1:-1] + values[:-2]
    return float(1.4826 * np.median(np.abs(second - np.median(second))) / np.sqrt(6.0))


def _off_line(force: FloatArray, first: int) -> tuple[FloatArray, float, FloatArray]:
    """A force without the line through its first points; their scatter; and the line's own standard deviation (n,)."""
    number = (np.arange(force.size) - 0.5 * (first - 1)) / first
    slope = float(12.0 * (number[:first] @ force[:first]) / first) if first >= 2 * FEWEST else 0.0
    level = float(np.median(force[:first] - slope * number[:first]))
    away = force - level - slope * number
    noise = max(float(1.4826 * np.median(np.abs(away[:first]))), _NONE)
    return away, noise, noise * np.sqrt((1.0 + 12.0 * number**2 * (first >= 2 * FEWEST)) / first)


def _leaves(away: FloatArray, noise: float, unsure: FloatArray) -> int:
    """Index of the first point after the baseline, by a mean over neighbours, up to the deepest point."""
    # A mean over a few points detects a departure earlier than one point does, and a single outlier does not move it.
    width = min(5, away.size)
    mean = np.convolve(away, np.full(width, 1.0 / width), mode="valid")
    unsure = unsure[width - 1 :]
    threshold = np.maximum(_LEAVES * np.hypot(noise / np.sqrt(width), unsure), 1e-3 * float(np.max(np.abs(away))))
    out = np.abs(mean) > threshold
    # A force that changes from attraction to compression crosses the baseline once; half of the range is surely
    # contact.
    strong = np.flatnonzero(np.abs(mean) > max(0.5 * STANDS_OUT * noise, 0.05 * float(np.max(np.abs(mean)))))
    if strong.size == 0:
        return away.size
    quiet = np.flatnonzero(~out[: strong[0] + 1])
    return int(quiet[-1]) + width if quiet.size else int(strong[0])

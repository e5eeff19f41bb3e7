"""Tables of what an edge takes to open and gives on closing, and what they say at a speed, an age or a run.

Speeds V and lengths are those of `bem.methods.sharp_crack.zone`. The toughness is that of the zone over the elastic
value: 1 at an opening edge at rest, 1/k at a fast one; 1 at a closing edge at rest, k at a fast one.

An edge that opens from rest leaves the strains of its resting zone behind, in the wake. `started` is the toughness of a
fast edge against the way that it has run from there, the strain that was left, and the speed at which that zone had
closed.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.sharp_crack.tail import ZONE_LENGTH, Tail, tail_effects
from bem.methods.sharp_crack.zone import RUN_OFFSET

_FINITE = 1.0 / 6.0  # share of its relative length by which a zone of constant stress takes more
_RELAXED, _RELAXED_SHORT = 2.0, 0.8  # the same where the wake relaxes: of Lennard-Jones and others, fitted
_LONGEST = 0.25  # zone, over the radius, of which the correction makes sense


class EdgeLaw(NamedTuple):
    """Tables of one traction law and one Prony series."""

    ratio: float  # k
    strengths: np.ndarray  # (m,)
    times: np.ndarray  # (m,)
    tail: Tail  # of the traction outside of the zone
    log_speed: np.ndarray  # (v,)
    opening: np.ndarray  # (v,): toughness of an opening edge
    log_transit: np.ndarray  # (v,): logarithm of the time in which it opens a zone's length, falling
    closing: np.ndarray  # (v,): toughness of a closing edge
    behind: np.ndarray  # (v,): g at the inner end of its zone, over the far value
    strains: np.ndarray  # (v, m): strains there
    reach: np.ndarray  # (v,): how far behind the edge that end lies
    log_run: np.ndarray  # (r,)
    log_closed: np.ndarray  # (w,): logarithm of the speed at which the resting zone closed; the first stands for rest
    left: np.ndarray  # (w, u): strains that were left, over sqrt(a / 2)
    started: np.ndarray  # (w, u, r): toughness
    log_softness: np.ndarray  # (s,): logarithm of mu^1.5 times the compliance, rising
    log_snap: np.ndarray  # (s,): logarithm of the gap at which the surfaces then jump into contact


@kernel
def interpolated(points: np.ndarray, values: np.ndarray, point: float) -> float:
    """Linear interpolation of `values` (n,) at rising `points` (n,), constant beyond the ends."""
    low, high = 0, points.size - 1
    if point <= points[low]:
        return values[low]
    if point >= points[high]:
        return values[high]
    while high - low > 1:
        middle = (low + high) // 2
        if points[middle] <= point:
            low = middle
        else:
            high = middle
    part = (point - points[low]) / (points[high] - points[low])
    return (1.0 - part) * values[low] + part * values[high]


@kernel
def _logarithm(value: float) -> float:
    return np.log(max(value, 1e-300))


@kernel
def aged_toughness(law: EdgeLaw, speed: float, age: float) -> float:
    """Toughness of an edge that opens steadily, at least that of a zone that is passed within the `age` of its bond."""
    log_speed = _logarithm(speed)
    transit, log_age = law.log_transit, _logarithm(age)
    if log_age <= transit[0]:
        low, high = 0, transit.size - 1
        while high - low > 1:
            middle = (low + high) // 2
            if transit[middle] >= log_age:
                low = middle
            else:
                high = middle
        part = min((transit[low] - log_age) / (transit[low] - transit[high]), 1.0)
        log_speed = max(log_speed, (1.0 - part) * law.log_speed[low] + part * law.log_speed[high])
    return interpolated(law.log_speed, law.opening, log_speed)


@kernel
def closing_toughness(law: EdgeLaw, speed: float) -> float:
    """Toughness of an edge that closes steadily: the work that it gives."""
    return interpolated(law.log_speed, law.closing, _logarithm(speed))


@kernel
def inner_toughness(law: EdgeLaw, speed: float) -> float:
    """The same with g at the inner end of the zone in place of the far value."""
    log_speed = _logarithm(speed)
    return interpolated(law.log_speed, law.closing, log_speed) * interpolated(law.log_speed, law.behind, log_speed) ** 2


@kernel
def lagging_speed(law: EdgeLaw, before: float, speed: float, run: float) -> float:
    """Speed to which the zone's inner end belongs, after a `run` at a new speed from `before`, 0 for any.

    The strains there are those of an edge that has moved steadily over the distance between.
    """
    if before <= 0.0 or speed <= 0.0:
        return speed
    share = np.exp(-run / interpolated(law.log_speed, law.reach, _logarithm(speed)))
    return before**share * speed ** (1.0 - share)


@kernel
def started_toughness(law: EdgeLaw, run: float, strain: float, closed: float) -> float:
    """Toughness of a fast edge after a `run` from rest.

    Args:
        law: the tables.
        run: in beta / mu^2.
        strain: by which the strain drops at the place of rest, over sqrt(a / 2).
        closed: speed at which the zone closed, 0 if it relaxed at rest.
    """
    scale, log_run = law.log_closed, np.log(max(run, 0.0) + RUN_OFFSET)
    if log_run >= law.log_run[law.log_run.size - 1]:
        return 1.0 / law.ratio
    log_closed, row = min(max(_logarithm(closed), scale[0]), scale[scale.size - 1]), 0
    while row < scale.size - 2 and scale[row + 1] <= log_closed:
        row += 1
    part = (log_closed - scale[row]) / (scale[row + 1] - scale[row])
    total = 0.0
    for neighbour in range(2):
        weight, left, toughness = (
            part if neighbour else 1.0 - part,
            law.left[row + neighbour],
            law.started[row + neighbour],
        )
        i = 0
        while i < left.size - 2 and left[i + 1] <= strain:
            i += 1
        share = min(max((strain - left[i]) / (left[i + 1] - left[i]), 0.0), 1.0)
        first, last = (
            interpolated(law.log_run, toughness[i], log_run),
            interpolated(law.log_run, toughness[i + 1], log_run),
        )
        total += weight * ((1.0 - share) * first + share * last)
    return total


@kernel
def finite_zone(
    law: EdgeLaw, toughness: float, radius: float, tabor: float, growth: float, share: float
) -> tuple[float, float]:
    """How much more an edge of a contact of this radius takes, because its zone is not small, and the force outside.

    `growth` and `share` are those of `bem.methods.sharp_crack.tail`.
    """
    eta = min(max(ZONE_LENGTH * toughness / (tabor * tabor * max(radius, 1e-9)), 1e-12), _LONGEST)
    relaxed = (1.0 - share) * eta
    if law.tail.strength == 0.0:
        return 1.0 + _FINITE * eta + _RELAXED_SHORT * relaxed, 0.0
    more, force = tail_effects(law.tail, eta, growth, share)
    return 1.0 + max(more, -0.5) + _RELAXED * relaxed, force


@kernel
def snap_in_depth(law: EdgeLaw, tabor: float, rate: float) -> float:
    """Depth at which surfaces that approach at a `rate` > 0 jump into contact, in mu h0.

    The compliance is that after the time in which the attraction grows.
    """
    depth = 0.0
    for _ in range(8):
        compliance = 1.0
        for i in range(law.times.size):
            compliance -= law.strengths[i] * np.exp(-abs(depth) / rate / law.times[i])
        depth = (1.0 - np.exp(interpolated(law.log_softness, law.log_snap, np.log(compliance * tabor**1.5)))) / tabor
    return depth

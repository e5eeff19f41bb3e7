"""What an edge takes to open and gives on closing, in tables for one traction law and one Prony series.

Speeds V and lengths are those of `bem.methods.sharp_crack.zone`. The toughness is that of the zone over the elastic
value: 1 at an opening edge at rest, 1/k at a fast one; 1 at a closing edge at rest, k at a fast one.

An edge that opens from rest leaves the strains of its resting zone behind, in the wake. `started` tabulates the
toughness of a fast edge against the way that it has run from there, the strain that was left, and the speed at which
that zone had closed.
"""

import functools
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.validation import FloatArray
from bem.methods.sharp_crack.tail import ZONE_LENGTH, Tail, tail_effects, tail_of
from bem.methods.sharp_crack.zone import RUN_OFFSET, Zone, ZoneEquations, tractions_and_slopes
from bem.problem.materials import Material, StandardLinearSolid
from bem.problem.tractions import Law, LennardJones, TractionLaw, law_of

_FINITE = 1.0 / 6.0  # share of its relative length by which a zone of constant stress takes more
_RELAXED, _RELAXED_SHORT = 2.0, 0.8  # the same where the wake relaxes: of Lennard-Jones and others, fitted
_LONGEST = 0.25  # zone, over the radius, of which the correction makes sense
_PER_DECADE = 3.5
_SLOWEST, _FASTEST = 1e-4, 1e3
_RESTED = (0.9, 0.7, 0.5, 0.3, 0.12, 0.03)  # shares of its strain that a zone has, which closed at the speeds tabulated
_RUNS = 12
_SNAP_IN = 2.641**3.5 / 4.0
_NODES = tuple(0.96 / 2.0**n for n in range(7))  # modulus ratios, between which tables are interpolated
_NODE_SPEEDS = 37
_EMPTY = 0.02  # opening, over the far value, at the inner end of a zone


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


_interpolating = ContextVar("_interpolating", default=False)


@functools.lru_cache(maxsize=32)
def _tables(adhesion: LennardJones | TractionLaw, material: Material) -> EdgeLaw:
    return _tabulate(law_of(adhesion), np.array(material.strengths), np.array(material.times))


def edge_law(adhesion: LennardJones | TractionLaw, material: Material) -> EdgeLaw:
    """The tables of an adhesion and a viscoelastic material, which take about a second; the last of a process are kept.

    Raises:
        ZoneError: where no zone is found.
    """
    if _interpolating.get() and isinstance(adhesion, LennardJones) and isinstance(material, StandardLinearSolid):
        return _between(material.modulus_ratio)
    return _tables(adhesion, material) if isinstance(adhesion, Hashable) else _tables.__wrapped__(adhesion, material)


@contextmanager
def interpolated_tables() -> Iterator[None]:
    """Let `edge_law` interpolate between the tables of seven standard linear solids under Lennard-Jones traction.

    For a search, which asks for hundreds of modulus ratios: forces change by less than 1e-4.
    """
    before = _interpolating.set(True)
    try:
        yield
    finally:
        _interpolating.reset(before)


@functools.lru_cache(maxsize=32)
def _between(ratio: float) -> EdgeLaw:
    """Tables between those of the next two nodes, linear in the logarithm of the modulus ratio."""
    place = min(max(np.log2(_NODES[0] / ratio), 0.0), len(_NODES) - 1.001)
    share = place - int(place)
    low, high = (_node(_NODES[int(place) + n]) for n in (0, 1))
    fields: dict[str, Any] = {"ratio": ratio, "strengths": np.array([1.0 - ratio]), "times": low.times}
    for name in EdgeLaw._fields[4:]:
        one, other = getattr(low, name), getattr(high, name)
        # Toughness scales with a power of the ratio; the others are logarithms already, or go through zero.
        power = name in ("opening", "closing", "reach", "started")
        fields[name] = one ** (1.0 - share) * other**share if power else (1.0 - share) * one + share * other
    return EdgeLaw(tail=low.tail, **fields)


@functools.cache
def _node(ratio: float) -> EdgeLaw:
    return _tabulate(law_of(LennardJones()), np.array([1.0 - ratio]), np.ones(1), _NODE_SPEEDS)


def _tabulate(law: Law, strengths: FloatArray, times: FloatArray, count: int = 0) -> EdgeLaw:
    equations = ZoneEquations(law, strengths, times)
    ratio, z = equations.ratio, equations.z
    low, high = _SLOWEST / times.max(), _FASTEST / ratio**2 / times.min()
    speeds = np.geomspace(low, high, count or int(_PER_DECADE * np.log10(high / low)) + 1)
    elastic = equations.elastic()
    # Over the elastic value, most of the error of the mesh cancels.
    unit = elastic.far_value**2

    opened = equations.follow(np.append(speeds, np.geomspace(high, 1e4 * high, 10)[1:]), elastic, closing=False)
    glassy, opening = opened[-1], [zone.far_value**2 / unit for zone in opened[: speeds.size]]
    open_work = np.clip(opening, 1.0, 1.0 / ratio)

    closing, ends, shapes, reach = [], [], [], []
    for speed, zone in zip(speeds, equations.follow(speeds, elastic, closing=True), strict=True):
        closing.append(zone.far_value**2 / unit)
        openings = equations.openings(float(speed), zone)
        end = int(np.flatnonzero(openings[: equations.edge + 1] > _EMPTY * zone.far_value)[0])
        strain = equations.closing_strains(float(speed), zone)
        ends.append(strain[:, end])
        reach.append(max(-z[end], ZONE_LENGTH * closing[-1]))
        total = strain.sum(axis=0)
        shapes.append(np.where(z > z[end], np.clip(1.0 - total / max(total[end], 1e-12), 0.0, 1.0), 0.0))
    close_work, strains = np.clip(closing, ratio, 1.0), np.array(ends)
    total = strains.sum(axis=1)

    full = (1.0 - ratio) * elastic.far_value
    chosen = np.searchsorted(-total, -(1.0 - ratio) * np.array(_RESTED))
    chosen = np.unique(np.minimum(chosen, speeds.size - 1))
    own = np.append(0.95 * full, total[chosen] * np.sqrt(np.pi * np.array(closing)[chosen]))
    left = np.array([np.concatenate([[0.0, 0.5 * strain], np.linspace(strain, 1.3 * full, 4)]) for strain in own])
    runs = np.append(np.geomspace(30.0 / ratio, 0.03, _RUNS), 0.0)
    wakes = [1.0 - equations.pull(elastic.gaps) / elastic.far_value, *(shapes[j] for j in chosen)]
    started = [_started(equations, glassy, wake, row, runs) for wake, row in zip(wakes, left, strict=True)]
    return EdgeLaw(
        ratio,
        strengths,
        times,
        tail_of(0.0 if law.tabulated else 1.0),
        np.log(speeds),
        open_work,
        np.log(ZONE_LENGTH * open_work / speeds),
        close_work,
        (1.0 - total) / ratio,
        strains,
        np.array(reach),
        np.log(runs[::-1] + RUN_OFFSET),
        np.log(np.append(speeds[chosen[0]] / 100.0, speeds[chosen])),
        left,
        np.array(started),
        *_snap_in(law),
    )


def _snap_in(law: Law) -> tuple[FloatArray, FloatArray]:
    """Logarithms of softness and gap (s,) at which attraction outgrows the stiffness of the half-space.

    The patch that is attracted is as wide as the traction's slope lets it be: the softness is
    1 / (c |s'| sqrt(s' / s'')), with c from the gap 2.641 mu^(3/7) of Lennard-Jones.
    """
    far = float(law.numbers[-1, 0]) if law.tabulated else 1e3
    gaps = np.geomspace(far, law.peak_gap, 2000)[1:-1]
    slopes = -tractions_and_slopes(law, gaps)[1]
    slopes = np.maximum(slopes, 1e-30)
    length = slopes / np.maximum(-np.gradient(slopes, gaps), 1e-3 * slopes)
    softness = 1.0 / (_SNAP_IN * slopes * np.sqrt(length))
    first = np.flatnonzero(softness < 1e12)[0]
    log_softness = np.log(np.minimum.accumulate(softness[first:]))[::-1]
    keep = np.append(True, np.diff(log_softness) > 0.0)
    return log_softness[keep], np.log(gaps[first:])[::-1][keep]


def _started(
    equations: ZoneEquations, glassy: Zone, wake: FloatArray, left: FloatArray, runs: FloatArray
) -> FloatArray:
    """Toughness (u, r) for strains (u,) that were left and falling runs (r,), in the order of rising ones."""
    toughness = np.empty((left.size, runs.size))
    for row, strain in zip(toughness, left, strict=True):
        for j, zone in enumerate(equations.started(float(strain), wake, runs, glassy)):
            row[j] = max(zone.far_value, 0.0) ** 2 / (equations.ratio * glassy.far_value**2)
    return toughness[:, ::-1]


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

"""The tables of `bem.methods.sharp_crack.edge_tables` for one traction law and one Prony series."""

import functools
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

from bem._support.validation import FloatArray
from bem.methods.sharp_crack.edge_tables import EdgeLaw
from bem.methods.sharp_crack.tail import ZONE_LENGTH, tail_of
from bem.methods.sharp_crack.zone import RUN_OFFSET, Zone, ZoneEquations, tractions_and_slopes
from bem.problem.materials import Material, StandardLinearSolid
from bem.problem.tractions import Law, LennardJones, TractionLaw, law_of

_PER_DECADE = 3.5
_SLOWEST, _FASTEST = 1e-4, 1e3
_RESTED = (0.9, 0.7, 0.5, 0.3, 0.12, 0.03)  # shares of its strain that a zone has, which closed at the speeds tabulated
_RUNS = 12
_SNAP_IN = 2.641**3.5 / 4.0
_NODES = tuple(0.96 / 2.0**n for n in range(7))  # modulus ratios, between which tables are interpolated
_NODE_SPEEDS = 37
_EMPTY = 0.02  # opening, over the far value, at the inner end of a zone


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

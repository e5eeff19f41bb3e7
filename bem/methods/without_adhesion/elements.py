"""Contact without adhesion as a row of independent elements: the method of dimensionality reduction.

A sphere pressed into a half-space has the force, the contact radius and the indentation of the profile
mu x^2 pressed into a row of springs that do not know of each other; an indenter of another power n has those of
s mu x^n, with the `depth_factor` s of `bem.problem.indenter`. An element at x has the displacement w(x, t) and
the load g(x, t), related by the material,

    w = g - sum_i c_i q_i,    q_i = int exp(-(t - s)/tau_i) dg(s),        P = -(2 / (pi mu)) int_0^inf g dx.

Either it touches, w = delta - mu x^2 and g >= 0, or it is free, g = 0 and w > delta - mu x^2. A touching element is
advanced in the variables of the relaxation modulus 1 + sum_j e_j exp(-t/theta_j), g = w + sum_j e_j r_j; a free one in
the q_i. Both relax independently of each other, so that a step is exact however long, for an indentation linear in it;
the instant at which an element touches or is released within the step is solved for.

The row is exact for every history: the gap of an element never falls, and its load never grows, with x. (The elements
at two places differ by a constant in the obstacle; a constant displacement needs a load of its own sign, as the
relaxation modulus is positive and falls. The maximum principle for that kernel gives both.) Contact is a disc, no
surfaces overlap, and pressure is nowhere negative.

Units: x in beta, w, g and delta in h0, force in pi R dgamma. Source: Popov and Hess, Method of Dimensionality Reduction
in Contact Mechanics and Friction (2015), chapter 7; Ting, J. Appl. Mech. 33 (1966) 845, for one cycle.
"""

import functools
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem._support.linear_algebra import dot
from bem.problem.indenter import PARABOLOID, depth_factor
from bem.problem.materials import PronySeries, StandardLinearSolid, relaxation_spectrum

_MOST_TRIALS = 60


class Solid(NamedTuple):
    """A material of m terms in both forms."""

    strengths: np.ndarray  # (m,) c_i
    times: np.ndarray  # (m,) tau_i
    moduli: np.ndarray  # (m,) e_j
    relaxations: np.ndarray  # (m,) theta_j
    released: np.ndarray  # (m, m): q = released @ r
    touched: np.ndarray  # (m, m): r = touched @ q
    glassy: float  # instantaneous modulus, over the relaxed one


class Places(NamedTuple):
    """Where the elements are, equally spaced from the axis."""

    tabor: float
    spacing: float
    heights: np.ndarray  # (n,) of the profile
    weights: np.ndarray  # (n,) in an integral of lines in x^2 between the elements, over the spacing


class Row(NamedTuple):
    """The elements at one instant."""

    touching: np.ndarray  # (n,) bool
    memory: np.ndarray  # (n, m) r_j of those that touch, q_i of the free ones
    load: np.ndarray  # (n,) g; of a free element minus its gap, times the instantaneous modulus


class Push(NamedTuple):
    """The indentation over one step, delta + rate s + curve s^2."""

    rate: float
    curve: float
    step: float


@kernel
def _crossing(push: Push, start: float, amplitudes: np.ndarray, times: np.ndarray, last: float) -> float:
    """Zero within the step of start + what is pushed + sum amplitudes exp(-s/times), which ends with the value `last`.

    Newton's method with bisection, from the secant.
    """
    first = start
    for j in range(times.size):
        first += amplitudes[j]
    low, high, rising = 0.0, push.step, last > 0.0
    s = push.step * first / (first - last) if (first < 0.0) == rising else 0.0
    for _ in range(_MOST_TRIALS):
        value, slope = start + s * (push.rate + push.curve * s), push.rate + 2.0 * push.curve * s
        for j in range(times.size):
            term = amplitudes[j] * np.exp(-s / times[j])
            value, slope = value + term, slope - term / times[j]
        if (value < 0.0) == rising:
            low = s
        else:
            high = s
        before, s = s, s - value / slope if slope != 0.0 else low
        if not low < s < high:
            s = 0.5 * (low + high)
        if abs(s - before) <= 1e-7 * push.step:
            break
    return s


@kernel
def relaxed(push: Push, time: float, memory: float, begin: float, end: float) -> float:
    """The variable r of a relaxation time of an element that touches, at `end`, from its value at `begin`."""
    elapsed = end - begin
    ratio = elapsed / time
    mean, moment = 1.0 - 0.5 * ratio, 0.5
    if ratio > 1e-6:
        mean = -np.expm1(-ratio) / ratio
        moment = (1.0 - mean) / ratio
    rate = push.rate + 2.0 * push.curve * begin
    return np.exp(-ratio) * memory + elapsed * (rate * mean + 2.0 * push.curve * elapsed * moment)


@kernel
def advance(solid: Solid, row: Row, heights: np.ndarray, depth: float, push: Push, new: Row) -> None:
    """Advance the row from the indentation `depth` by one step into `new`; `heights` (n,) is the profile."""
    m, step = solid.times.size, push.step
    end = depth + step * (push.rate + push.curve * step)
    kept, pushed, faded, amplitudes = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    for j in range(m):
        kept[j], faded[j] = np.exp(-step / solid.relaxations[j]), np.exp(-step / solid.times[j])
        pushed[j] = relaxed(push, solid.relaxations[j], 0.0, 0.0, step)
    held, memory, moduli, strengths = row.memory, new.memory, solid.moduli, solid.strengths
    for i in range(heights.size):
        touching, load, strain = row.touching[i], end - heights[i], end - heights[i]
        if touching:
            for j in range(m):
                memory[i, j] = kept[j] * held[i, j] + pushed[j]
                load += moduli[j] * memory[i, j]
        else:
            for j in range(m):
                memory[i, j] = faded[j] * held[i, j]
                strain += strengths[j] * memory[i, j]
        if touching and load < 0.0:  # released within the step
            s = _release(solid, push, depth - heights[i], held[i], load, amplitudes)
            touching, strain = False, end - heights[i]
            for j in range(m):
                memory[i, j] = np.exp((s - step) / solid.times[j]) * dot(solid.released[j], amplitudes)
                strain += strengths[j] * memory[i, j]
        elif not touching and strain > 0.0:  # touched within the step
            for j in range(m):
                amplitudes[j] = strengths[j] * held[i, j]
            s = _crossing(push, depth - heights[i], amplitudes, solid.times, strain)
            touching, load = True, end - heights[i]
            for j in range(m):
                amplitudes[j] = held[i, j] * np.exp(-s / solid.times[j])
            for j in range(m):
                memory[i, j] = relaxed(push, solid.relaxations[j], dot(solid.touched[j], amplitudes), s, step)
                load += moduli[j] * memory[i, j]
        new.touching[i] = touching
        new.load[i] = max(load, 0.0) if touching else min(solid.glassy * strain, 0.0)


@kernel
def _release(solid: Solid, push: Push, above: float, memory: np.ndarray, last: float, at_release: np.ndarray) -> float:
    """When an element loses contact, `above` the surface at the start of the step; r then into `at_release` (m,)."""
    straight, start = 0.0, above
    for j in range(memory.size):
        bend = 2.0 * push.curve * solid.relaxations[j]
        level = solid.relaxations[j] * (push.rate - bend)
        at_release[j] = solid.moduli[j] * (memory[j] - level)
        start, straight = start + solid.moduli[j] * level, straight + solid.moduli[j] * bend
    s = _crossing(Push(push.rate + straight, push.curve, push.step), start, at_release, solid.relaxations, last)
    for j in range(memory.size):
        at_release[j] = relaxed(push, solid.relaxations[j], memory[j], 0.0, s)
    return s


@kernel
def force_of_row(places: Places, row: Row, glassy: float) -> tuple[float, float]:
    """Force and contact radius, by lines in x^2, as Hertz's load is, between elements and up to the edge.

    For the force the edge is where the load of the last two falls to zero, or the surface outside meets the sphere, the
    further of both: it is then continuous in the state. The contact ends no further out than where the sphere would
    meet a surface as high as that of the first element outside, which while it grows is the edge.
    """
    load, last, total = row.load, -1, 0.0
    for i in range(load.size):
        if load[i] > 0.0:
            last, total = i, total + places.weights[i] * load[i]
    if last < 0:
        return 0.0, 0.0
    outer = load[last]
    share = outer / (outer - min(load[min(last + 1, load.size - 1)], 0.0))
    if last > 0:
        fall = load[last - 1] - outer
        inside = outer * (2 * last - 1) / (2 * last + 1)
        share = max(share, min(inside / fall, 1.0) if fall > inside else 1.0)
    edge = np.sqrt(last * last + share * (2 * last + 1))
    edge_weight = (edge - last) * (2.0 * edge + last) / (3.0 * (edge + last)) - (3.0 * last + 2.0) / (6.0 * last + 3.0)
    force = -2.0 / (np.pi * places.tabor) * places.spacing * (total + outer * edge_weight)
    if last + 1 < load.size and load[last + 1] < 0.0:
        inner, free = places.heights[last], places.heights[last + 1]
        met = max(free + load[last + 1] / glassy - inner, 0.0) / (free - inner)
        edge = min(edge, np.sqrt(last * last + met * (2 * last + 1)))
    return force, places.spacing * edge


@functools.lru_cache(maxsize=256)
def solid_of(material: StandardLinearSolid | PronySeries) -> Solid:
    """Both forms of a material and the change from one to the other."""
    strengths, times = np.array(material.strengths), np.array(material.times)
    if isinstance(material, StandardLinearSolid):
        k = material.modulus_ratio
        moduli, relaxations = np.array([1.0 / k - 1.0]), np.array([k])
    else:
        moduli, relaxations = relaxation_spectrum(material)
    apart = times[:, np.newaxis] - relaxations
    released = moduli * times[:, np.newaxis] / apart
    touched = (strengths[:, np.newaxis] * relaxations / apart).T.copy()
    return Solid(strengths, times, moduli, relaxations, released, touched, 1.0 + moduli.sum())


def places_of(tabor: float, reach: float, count: int, exponent: float = PARABOLOID) -> Places:
    """Places of `count` intervals up to the radius `reach`, and of one element beyond."""
    spacing, numbers = reach / count, np.arange(count + 2.0)
    outer = (3.0 * numbers + 1.0) / (6.0 * numbers + 3.0)  # of the outer end of an interval
    weights = 1.0 - outer
    weights[1:] += outer[:-1]
    heights = tabor * uncompiled(depth_factor)(exponent) * (spacing * numbers) ** exponent
    return Places(tabor, spacing, heights, weights)

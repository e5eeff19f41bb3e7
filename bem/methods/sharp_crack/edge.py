"""The edge of a sharp crack: whether it opens or closes, and how far.

At the edge a, with the speed V = mu^2 |da/dt| and the far strains sum e on the side from which the edge comes,

    opening   2 g(a)^2 / (pi a) = toughness,        closing   2 (y(a) - sum e)^2 / (pi a) = toughness.

Units: as in `bem.methods.sharp_crack.far_field`. Sources: see `bem.methods.sharp_crack.zone`.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.sharp_crack.edge_tables import (
    EdgeLaw,
    aged_toughness,
    closing_toughness,
    finite_zone,
    inner_toughness,
    started_toughness,
)
from bem.methods.sharp_crack.far_field import HeldStep, Relaxation, surface
from bem.methods.sharp_crack.tail import strain_ahead

_LEAST_TRAVEL = 1e-8  # of an edge that moves, over its radius
_GROWTH = 2.5  # of the travel that is tried
_SHORT, _MOST_AT_FIRST = 0.03, 1e-3  # of the travel that is usual, which is tried first, and of the radius
_MOST_TRIALS, _PRECISION = 45, 1e-5
_LEAST_TOUGHNESS = 1e-6
CELLS = 4  # between nodes behind the edge, whose weights a state has


class Contact(NamedTuple):
    """What does not change during a history."""

    tabor: float
    law: EdgeLaw
    relaxation: Relaxation
    radii: np.ndarray  # (n,) nodes from 0, at one spacing
    pulls: np.ndarray  # (n,) scratch: g at the nodes
    step: HeldStep  # scratch: of all nodes
    part: HeldStep  # scratch: of one node
    work: np.ndarray  # (4, m) scratch


class State(NamedTuple):
    """The contact at one instant; strains are those of the m terms."""

    time: float
    depth: float
    force: float
    radius: float  # of the edge, 0 without contact
    zone: float  # length of the process zone, over the radius
    rest_radius: float  # where the edge last rested
    left_rest: float  # when it left that place, opening
    bonded: float  # when the surfaces at the edge met
    closed: float  # speed V at which the zone at rest closed, 0 if it has relaxed
    mark: tuple[float, float]  # place and instant from which the speed of a closing edge is measured
    next_mark: tuple[float, float]
    strains: np.ndarray  # (n, m) at the nodes
    births: np.ndarray  # (n,): when the surfaces met
    inner: np.ndarray  # (m,) just inside of the edge
    outer: np.ndarray  # (m,) just outside
    rest: np.ndarray  # (m,) outside of the place of rest
    weights: np.ndarray  # (c,) of the outer of two values of g in their mean, in the cells next to the edge


class Opening(NamedTuple):
    """An edge that is to open."""

    depth: float
    radius: float  # of the edge before
    pull: float  # g there
    inside: int  # nodes in the contact
    dt: float
    age: float  # since it left its rest
    rest_radius: float
    strain: float  # left at the place of rest, over sqrt(a / 2)
    closed: float
    bond: float  # age of the bond
    growth: float  # relative, of the opening over the radius
    around: float  # strain around the contact


@kernel
def new_state(nodes: int, terms: int, time: float, depth: float) -> State:
    """Separate surfaces without memory."""
    mark = (0.0, time)
    return State(
        time, depth, 0.0, 0.0, 0.0, 0.0, time, time, 0.0, mark, mark,
        np.zeros((nodes, terms)), np.full(nodes, time),
        np.zeros(terms), np.zeros(terms), np.zeros(terms), np.full(CELLS, 0.5),
    )  # fmt: skip


@kernel
def nodes_inside(radii: np.ndarray, radius: float) -> int:
    """Number of nodes (n,) at less than a radius."""
    count = min(int(radius / radii[1]) + 1, radii.size)
    while count > 0 and radii[count - 1] >= radius:
        count -= 1
    return count


@kernel
def total_of(values: np.ndarray) -> float:
    """Sum of the strains (m,) of all terms."""
    total = 0.0
    for i in range(values.size):
        total += values[i]
    return total


@kernel
def _pull_at(contact: Contact, opening: Opening, radius: float) -> float:
    """G at a radius up to the edge."""
    radii, pulls = contact.radii, contact.pulls
    low = max(min(int(radius / radii[1]), opening.inside - 1), 0)
    last = low == opening.inside - 1
    right, end = (opening.radius, opening.pull) if last else (radii[low + 1], pulls[low + 1])
    part = (radius - radii[low]) / max(right - radii[low], 1e-300)
    return pulls[low] + part * (end - pulls[low])


@kernel
def excess(contact: Contact, opening: Opening, radius: float) -> float:
    """By how much the edge is pulled more than it takes, if it opens up to a radius in this step."""
    law, unit = contact.law, contact.tabor * contact.tabor
    k = law.ratio
    pull = max(_pull_at(contact, opening, radius), 0.0)
    speed = (opening.radius - radius) * unit / opening.dt
    moved = 1.0 / aged_toughness(law, speed, opening.age) - k
    run = (opening.rest_radius - radius) * unit
    # What was left at the place of rest may open the edge of itself, without any pull.
    started = 1.0 / max(started_toughness(law, run, opening.strain, opening.closed), _LEAST_TOUGHNESS) - k
    toughness = 1.0 / (k + moved + started * max(1.0 - moved / (1.0 - k), 0.0))
    toughness = min(toughness, aged_toughness(law, speed, opening.bond))
    wake = wake_share(radius, pull, surface(radius, opening.depth) - opening.around)
    factor = finite_zone(law, toughness, radius, contact.tabor, opening.growth, wake)[0]
    return 2.0 * pull * pull / (np.pi * max(radius, 1e-12)) - toughness * factor


@kernel
def first_travel(usual: float) -> float:
    """A travel over the radius that an edge exceeds, if it moves about as far as is usual: the first root is sought."""
    return min(max(_SHORT * usual, _LEAST_TRAVEL), _MOST_AT_FIRST)


@kernel
def between(low: float, low_value: float, high: float, high_value: float, trial: int) -> float:
    """Where a line through two values of opposite sign is zero, or each fourth time the middle."""
    if trial % 4 == 3 or low_value == high_value:
        return 0.5 * (low + high)
    return high - high_value * (high - low) / (high_value - low_value)


@kernel
def opened_radius(contact: Contact, opening: Opening) -> float:
    """First radius going inwards at which the edge is held; 0 if there is none."""
    edge = opening.radius
    usual = (opening.rest_radius - edge) / max(opening.age - opening.dt, 1e-300) * opening.dt / edge
    free, pulled, travel = edge, excess(contact, opening, edge), first_travel(usual)
    while travel < 1.0:
        held = edge * (1.0 - travel)
        short = excess(contact, opening, held)
        if short <= 0.0:
            break
        free, pulled, travel = held, short, travel * _GROWTH
    else:
        return 0.0
    radius, enough, side = held, _PRECISION * (pulled - short), 0
    for trial in range(_MOST_TRIALS):
        if free - held <= _PRECISION * (edge - held):
            break
        radius = between(held, short, free, pulled, trial)
        value = excess(contact, opening, radius)
        if abs(value) <= enough:
            break
        if value <= 0.0:
            held, short, pulled, side = radius, value, pulled * (0.5 if side < 0 else 1.0), -1
        else:
            free, pulled, short, side = radius, value, short * (0.5 if side > 0 else 1.0), 1
    return radius


@kernel
def strain_outside(contact: Contact, new: State, first: int, edge: float, radius: float, term: int) -> float:
    """Strain of a term outside of the edge, at a radius; from the `first` node on the strains are those of nodes."""
    radii = contact.radii
    low = min(int(radius / radii[1]), radii.size - 2)
    right = new.strains[low + 1, term]
    left_place, left = (radii[low], new.strains[low, term]) if low >= first else (edge, new.outer[term])
    part = (radius - left_place) / max(radii[low + 1] - left_place, 1e-300)
    return left + min(part, 1.0) * (right - left)


@kernel
def _resistance(
    contact: Contact, new: State, first: int, edge: float, mark: tuple, radius: float, time: float, depth: float
) -> float:
    """By how much the surfaces lie too far apart to close up to a radius in this step."""
    law = contact.law
    far = surface(radius, depth)
    for i in range(law.times.size):
        far -= strain_outside(contact, new, first, edge, radius, i)
    far = max(far, 0.0)
    place, instant = mark
    speed = (radius - place) * contact.tabor**2 / max(time - instant, 1e-300)
    growth = radius * radius / max(far, 1e-300)
    factor = finite_zone(law, inner_toughness(law, speed), radius, contact.tabor, growth, 1.0)[0]
    if law.tail.strength > 0.0 and speed > 0.0 and far > 0.0:
        toughness = closing_toughness(law, speed)
        balanced = np.sqrt(0.5 * np.pi * radius * toughness)
        factor = 1.0 + (factor - 1.0) * law.ratio * np.sqrt(inner_toughness(law, speed) / toughness)
        for i in range(law.times.size):
            reach = speed * law.times[i] / contact.tabor**2
            factor += law.strengths[i] * strain_ahead(law.tail, balanced, radius, contact.tabor, reach)
        factor = max(factor, 0.3)
    return 2.0 * far * far / (np.pi * radius) - closing_toughness(law, speed) * factor


@kernel
def closed_radius(
    contact: Contact, new: State, first: int, edge: float, mark: tuple, time: float, dt: float, depth: float
) -> float:
    """Radius up to which the edge closes; that of the edge if it does not."""
    largest, start = contact.radii[-1], max(edge, 1e-6)
    free, held, near, apart = start, start, 0.0, 0.0
    if edge == 0.0:  # beyond the barrier of nucleation
        held = largest
        for i in range(1, 200):
            free = largest * (1.0 - i / 200.0)
            near = _resistance(contact, new, first, edge, mark, free, time, depth)
            if near < 0.0:
                break
            held, apart = free, near
        else:
            return 0.0
        if held == largest:
            return held
    else:
        near = _resistance(contact, new, first, edge, mark, edge, time, depth)
        if near >= 0.0:
            return edge
        place, instant = mark
        travel = first_travel((edge - place) / max(time - dt - instant, 1e-300) * dt / edge)
        while True:
            held = min(edge * (1.0 + travel), largest)
            apart = _resistance(contact, new, first, edge, mark, held, time, depth)
            if apart >= 0.0:
                break
            if held == largest:
                return held
            free, near, travel = held, apart, travel * _GROWTH
    radius, enough, side = held, _PRECISION * (apart - near), 0
    for trial in range(_MOST_TRIALS):
        if held - free <= _PRECISION * max(held - edge, 1e-12):
            break
        radius = between(free, near, held, apart, trial)
        value = _resistance(contact, new, first, edge, mark, radius, time, depth)
        if abs(value) <= enough:
            break
        if value < 0.0:
            free, near, apart, side = radius, value, apart * (0.5 if side < 0 else 1.0), -1
        else:
            held, apart, near, side = radius, value, near * (0.5 if side > 0 else 1.0), 1
    return radius


@kernel
def wake_share(radius: float, pull: float, around: float) -> float:
    """Opening at an edge in balance, over that `around` the contact."""
    return min(0.5 * np.pi * radius / max(pull * around, 1e-12), 1.0)

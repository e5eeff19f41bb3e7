"""Attraction outside of the process zone, where the Lennard-Jones law falls as the third power of the gap.

It acts over the whole gap around the contact, not only near the edge. With H = D h(r / a) the gap around a contact of
radius a, in mu h0, and s = (8/3) / (mu H)^3 its energy is, in dgamma beta^2,

    E = -(8 pi / 3) (a / (mu D))^2 J,       J = int_1^inf r dr / h^2,
    h(r) = (4 / pi) (arccos(1/r) + q / 2 ((r^2 / 2 - 1) arccos(1/r) + sqrt(r^2 - 1) / 2)),

D the opening y - sum e at the edge and q = a D' / D how fast it grows outwards; an edge of toughness Gamma in balance
has D^2 = pi a / (2 Gamma). J is cut off within the zone, whose length is eta a: J = J_0(q) - (pi^2 / 32) ln(c eta). The
edge takes -dE/dA more than its toughness, and the force is larger by -dE/d(depth). The number c is fitted to elastic
contacts at all depths, b of `strain_ahead` to viscoelastic ones that are loaded.

Units: as in `bem.methods.sharp_crack.far_field`. Source: Abel transforms as there; first order in eta.
"""

import functools
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.problem.tractions import PEAK_TRACTION

ZONE_LENGTH = np.pi / (4.0 * PEAK_TRACTION**2)
"""Length of a zone of constant stress and toughness 1, in beta / mu^2."""
_CUT = 0.8  # c
_STEEP_ZONE = 0.15  # growth within the zone beyond which the first order in eta is meaningless
_AHEAD = 3.3  # b
_LOGARITHM = np.pi**2 / 32.0
_FACTOR = 8.0 / (3.0 * np.pi)
_FLATTEST, _STEEPEST, _POINTS = 0.05, 100.0, 64


class Tail(NamedTuple):
    """J_0 against q."""

    strength: float  # 1 for Lennard-Jones, 0 for laws that end
    log_growth: np.ndarray  # (q,)
    shape: np.ndarray  # (q,) J_0
    slope: np.ndarray  # (q,) dJ_0 / d ln q


@functools.lru_cache(maxsize=2)
def tail_of(strength: float) -> Tail:
    """The table."""
    growths = np.geomspace(_FLATTEST, _STEEPEST, _POINTS)
    shape = np.array([_shape(growth) for growth in growths])
    return Tail(strength, np.log(growths), shape, np.gradient(shape, np.log(growths)))


def _shape(growth: float) -> float:
    """J_0: the integral in the logarithm of r - 1, without what it has near the edge."""
    t = np.linspace(np.log(1e-8), np.log(1e5), 4001)
    r = 1.0 + np.exp(t)
    angle = np.arctan2(np.sqrt((r - 1.0) * (r + 1.0)), 1.0)
    gap = angle + 0.5 * growth * ((0.5 * r * r - 1.0) * angle + 0.5 * np.sqrt((r - 1.0) * (r + 1.0)))
    integrand = r * np.exp(t) / (4.0 / np.pi * gap) ** 2
    integral = 0.5 * np.sum((integrand[1:] + integrand[:-1]) * np.diff(t))
    return float(integral - _LOGARITHM * np.log(1e8))


@kernel
def tail_effects(tail: Tail, eta: float, growth: float, share: float) -> tuple[float, float]:
    """By how much the edge takes more, over its toughness, and by how much the force is larger.

    Args:
        tail: the table.
        eta: length of the zone over the radius.
        growth: q.
        share: opening at the edge, over that of the gap around the contact, where the wake has relaxed; at most 1.
    """
    log_growth = np.log(max(min(growth, _STEEP_ZONE / eta), 1e-300))
    place = (log_growth - tail.log_growth[0]) / (tail.log_growth[1] - tail.log_growth[0])
    place = min(max(place, 0.0), tail.shape.size - 1.0)
    q = np.exp(tail.log_growth[0] + place * (tail.log_growth[1] - tail.log_growth[0]))
    low = min(int(place), tail.shape.size - 2)
    part = place - low
    slope = tail.slope[low] + part * (tail.slope[low + 1] - tail.slope[low])
    integral = tail.shape[low] + part * (tail.shape[low + 1] - tail.shape[low]) - _LOGARITHM * np.log(_CUT * eta)
    scale = tail.strength * _FACTOR * eta / ZONE_LENGTH
    more = scale * ((2.0 - 2.0 * q) * integral + (2.0 - q) * slope + 2.0 * _LOGARITHM * q)
    return more * share**3, share**2 * scale * q * (2.0 * integral + slope - 2.0 * _LOGARITHM)


@kernel
def strain_ahead(tail: Tail, opening: float, radius: float, tabor: float, reach: float) -> float:
    """Relative excess of the toughness of a closing edge by a term whose strain ahead of it is less than on a flat.

    On a flat the attraction pulls at the surface far ahead; the curved gap around a contact opens faster. To first
    order, for a unit strength, with D the `opening` y - sum e at the edge:

        -(8 / 3) (pi / 4)^3 a^2 / (L mu^2 D^4) ln(1 + b q L / a).

    Args:
        tail: the table.
        opening: D.
        radius: a.
        tabor: mu.
        reach: L, the way that the edge makes in the retardation time.
    """
    growth = radius * radius / opening
    logarithm = np.log(1.0 + _AHEAD * growth * reach / radius)
    return -tail.strength * 8.0 / 3.0 * (np.pi / 4.0) ** 3 * radius**2 / (reach * tabor**2 * opening**4) * logarithm

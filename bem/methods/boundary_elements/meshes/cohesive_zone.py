"""Width of the cohesive zone at the contact edge, and bounds of the contact radius.

Units: radii and widths in beta. The width sets the mesh: on a mesh that does not resolve it the edge sticks at
each node.
Sources: cohesive-zone length of a crack E* dgamma / sigma_0^2, in these units 2.48/mu^2 with its usual prefactor
(Maugis, Contact, Adhesion and Rupture of Elastic Solids, 2000, section 3.3.5); gap outside a Hertz contact, Johnson,
Contact Mechanics, 1985, Eq. (3.42a).
"""

import math

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem.problem.indenter import PARABOLOID, depth_factor

CRACK_LENGTH = 2.48
_OPENING = 0.3  # of the zone of a relaxed contact, in which the surfaces part by h0 more


@kernel
def edge_width(contact_radius: float, tabor: float, exponent: float = PARABOLOID) -> float:
    """Length over which the traction changes at the edge of a contact: the shortest adhesion and geometry allow."""
    crack = CRACK_LENGTH / (tabor * tabor)
    if exponent == PARABOLOID:
        opening = 0.7 * math.sqrt(2.0 / tabor)  # where the gap of an undeformed sphere has grown by half of h0
        if contact_radius > 0.0:
            # the gap outside a Hertz contact, about 0.6 mu a^(1/2) x^(3/2) at a distance x, reaches h0
            opening = min(opening, (0.6 * tabor * math.sqrt(contact_radius)) ** (-2.0 / 3.0))
    else:
        # flat tips rise late and steeply
        opening = min(2.0 / exponent, 1.0) * (0.49 * exponent / tabor) ** (1.0 / exponent)
        if contact_radius > 0.0:  # as the indentation grows with the radius
            growth = depth_factor(exponent) * exponent * contact_radius ** (exponent - 1.5)
            opening = min(opening, (0.3 * tabor * growth) ** (-2.0 / 3.0))
    return 1.0 / (1.0 / crack + 1.0 / opening)


@kernel
def contact_edge(radii, gap, peak_gap) -> float:
    """Outermost radius at which the gap passes the one of largest tension, 0 where the surfaces do not touch."""
    for j in range(gap.size - 2, -1, -1):
        if gap[j] < peak_gap:
            share = (peak_gap - gap[j]) / (gap[j + 1] - gap[j])
            return radii[j] + share * (radii[j + 1] - radii[j])
    return 0.0


@kernel
def zone_width(width: float, edge: float, radii: np.ndarray, gap: np.ndarray, peak_gap: float) -> float:
    """Width of the cohesive zone of a state: that of a relaxed contact, or more where a fast crack meets a glass."""
    return max(width, (contact_edge(radii, gap, peak_gap + 1.0) - edge) / _OPENING)


@kernel
def nonadhesive_edge(radii: np.ndarray, tractions: np.ndarray) -> float:
    """Contact radius: half-way from the last node that presses to the next one; 0 where nothing touches."""
    for j in range(tractions.size - 1, -1, -1):
        if tractions[j] < 0.0:
            return 0.5 * (radii[j] + radii[min(j + 1, radii.size - 1)])
    return 0.0


def largest_contact_radius(peak_indentation: float, tabor: float, exponent: float = PARABOLOID) -> float:
    """Upper estimate of the contact radius at the deepest indentation: JKR and a margin."""
    factor = uncompiled(depth_factor)(exponent)
    radius = _root(max(peak_indentation, 0.0) / tabor / factor, exponent) + 1.0
    for _ in range(50):  # s a^n = delta/mu + sqrt(2 pi a), JKR's indentation solved by fixed-point iteration
        pressed = max(peak_indentation / tabor + math.sqrt(2.0 * math.pi * radius), 0.25)
        before, radius = radius, _root(pressed / factor, exponent)
        if radius == before:
            break
    return radius + 0.4


def far_radius(radius: float, gap: float, tabor: float, exponent: float = PARABOLOID) -> float:
    """Radius at which the profile is a `gap` higher than at a contact `radius`."""
    return _root(radius**exponent + exponent * gap / tabor, exponent)


def _root(value: float, exponent: float) -> float:
    return math.sqrt(value) if exponent == PARABOLOID else value ** (1.0 / exponent)


def edge_resistance(
    tabor: float,
    contact_radius: float,
    slowest: float | np.ndarray,
    strengths: np.ndarray,
    times: np.ndarray,
    exponent: float = PARABOLOID,
) -> np.ndarray:
    """How much viscosity holds a moving contact edge back, from 0 (elastic, or slow) to 1.

    An edge that nothing holds back sticks at the nodes of a mesh that is too coarse for it. What counts is how far the
    edge travels in the shortest retardation time, in widths of its cohesive zone, and how much the material creeps. The
    slope of one half per decade, and the tenth of a width from which the resistance of a solid that creeps tenfold is
    full, are measured.

    Args:
        tabor: Tabor parameter.
        contact_radius: the largest, in beta.
        slowest: smallest speeds of indentation, in h0 per unit time, of any shape; 0 where it never changes.
        strengths, times: (m,) of the material; none are elastic.
        exponent: of the indenter.
    """
    if strengths.size == 0:
        return np.zeros(np.shape(slowest))
    glassy = 1.0 - float(np.sum(strengths))
    creep = float(np.sum(strengths)) / glassy
    delay = float(np.min(times)) * min(creep / 9.0, 1.0)
    width = uncompiled(edge_width)(contact_radius, tabor, exponent)
    growth = contact_radius if exponent == PARABOLOID else contact_radius ** (exponent - 1.0)
    travel = slowest * delay / (exponent * uncompiled(depth_factor)(exponent) * tabor * growth * width)
    resistance = min(creep, 1.0) * np.clip(1.0 + 0.5 * np.log10(np.maximum(travel, 1e-300) / 0.1), 0.0, 1.0)
    return np.round(resistance, 3)  # so that the rounding of a material's numbers does not choose another grid

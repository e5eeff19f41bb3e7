"""The interface of one contact: what its Tabor parameter and traction law make of gaps on a mesh.

At fixed indentation an equilibrium minimises

    U = 2 int (mu phi(h) + sigma u / 2) r dr,        phi(h) = -int_h^inf sigma dh',        dU = -P d(delta).

The work put into an elastic contact is therefore the change of U plus what the jumps lose. The integral of P d(delta)
says the same, but along a deep loop it is the small difference of two large areas.

For an indenter other than the paraboloid a part is added, the same for all gaps, so that nothing changes without it.

Units: tractions in dgamma/(mu h0), radii in beta, forces in pi R dgamma, energies in h0 pi R dgamma; see
`bem.problem.tractions`. Source: Greenwood, Proc. R. Soc. A 453 (1997) 1277, on the energy of the branches.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import dot
from bem.problem.indenter import PARABOLOID
from bem.problem.tractions.law import Law, potential_at, tail_energy_at, tail_force_at, traction_at
from bem.problem.tractions.laws import HardContact, LennardJones, TractionLaw, law_of
from bem.problem.tractions.lennard_jones import traction


class Interface(NamedTuple):
    """What acts between the surfaces of one scene."""

    tabor: float
    law: Law
    nonadhesive: bool  # impenetrable surfaces that do not attract each other; the law is not used then
    exponent: float = PARABOLOID  # of the indenter
    reach: float = 0.0  # radius at which the mesh ends


def interface_of(
    tabor: float, adhesion: LennardJones | HardContact | TractionLaw, exponent: float = PARABOLOID
) -> Interface:
    """The interface of a scene with this Tabor parameter, adhesion and indenter."""
    return Interface(tabor, law_of(adhesion), isinstance(adhesion, HardContact), exponent)


@kernel
def deviation(interface: Interface, radius: float) -> float:
    """By how much the indenter is higher at a radius than the paraboloid."""
    power = interface.exponent
    return 0.0 if power == PARABOLOID else interface.tabor * (radius**power / power - 0.5 * radius * radius)


@kernel
def reshape(interface: Interface, scale: float, radii: np.ndarray, out: np.ndarray) -> None:
    """Add the `deviation` at `scale` times the `radii` (n,) to `out` (n,)."""
    if interface.exponent != PARABOLOID:
        for i in range(out.size):
            out[i] += deviation(interface, scale * radii[i])


@kernel
def tail_share(interface: Interface, radius: float, gap: float) -> float:
    """Force beyond a node, over that of a paraboloid with the same gap there, 2 int sigma r^(2-n) dh.

    For a traction that falls as h^-3; exact for the cone, and for all where the surfaces just touch.
    """
    if interface.exponent == PARABOLOID:
        return 1.0
    return radius ** (2.0 - interface.exponent) * (1.0 + tail_bend(interface, radius) * gap)


@kernel
def tail_bend(interface: Interface, radius: float) -> float:
    """How much the `tail_share` grows with the gap."""
    power = interface.exponent
    return (2.0 - power) / (3.0 * power - 2.0) * power / (interface.tabor * radius**power)


@kernel
def tractions_of(interface: Interface, gap: np.ndarray, out: np.ndarray) -> None:
    """Traction of every node with adhesion, from its gap (n,), into `out` (n,)."""
    if interface.law.tabulated:
        for i in range(gap.size):
            out[i] = interface.tabor * traction_at(interface.law, gap[i])
    else:  # a loop without a choice, which the compiler vectorises
        for i in range(gap.size):
            out[i] = interface.tabor * traction(gap[i])


@kernel
def force_of(interface: Interface, weights: np.ndarray, gap: np.ndarray, tractions: np.ndarray) -> float:
    """Force P, with the closed-form tail beyond the last node; all arrays (n,)."""
    if interface.nonadhesive:
        return dot(weights, tractions)
    last = gap[gap.size - 1]
    tail = tail_share(interface, interface.reach, last) * tail_force_at(interface.law, last)
    return dot(weights, tractions) + tail


@kernel
def stored_energy(
    interface: Interface, radii: np.ndarray, weights: np.ndarray, depth: float, gap: np.ndarray, tractions: np.ndarray
) -> float:
    """U of an elastic equilibrium `gap`, `tractions` (n,) at the indentation `depth`."""
    tabor, law = interface.tabor, interface.law
    total, higher = 0.0, np.zeros(gap.size)
    reshape(interface, 1.0, radii, higher)
    for i in range(gap.size):
        lifted = 1.0 - depth + 0.5 * tabor * radii[i] ** 2 - gap[i] + higher[i]
        surface = 0.0 if interface.nonadhesive else tabor * potential_at(law, gap[i])
        total += weights[i] * (surface + 0.5 * tractions[i] * lifted)
    if interface.nonadhesive:
        return total
    last = gap[gap.size - 1]
    beyond = tail_energy_at(law, last)
    if interface.exponent != PARABOLOID:  # up to a constant
        bend = 0.0 if law.tabulated else 8.0 / 3.0 * tail_bend(interface, interface.reach)
        beyond = interface.reach ** (2.0 - interface.exponent) * (beyond + bend * np.log(last))
    return total + beyond

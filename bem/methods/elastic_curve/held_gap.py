"""The equilibrium of an elastic contact in which the gap of one node is held and the indentation is unknown.

With it come the derivatives of all unknowns along the curve of such equilibria, from the matrix that was factorised.
Units: as in `bem.methods.boundary_elements.equilibrium`.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import add_rows, lu_factor, lu_solve
from bem.methods.boundary_elements.meshes.regrid import cubic
from bem.methods.elastic_curve.scaled_meshes import ScaledMeshes, nodes_within, weight_of_last
from bem.methods.records import count_factorisation, count_iteration, is_spent
from bem.problem.indenter import PARABOLOID
from bem.problem.tractions import Interface, deviation, slope_at, tail_bend, tail_force_at, tail_share, traction_at
from bem.problem.tractions.pressed import changed_gap, pressed_below, pressed_gap_of

_MOST_ITERATIONS = 20
_CONTRACTION = 0.15  # of corrections, above which the matrix is factorised again
_TRUSTED = 0.3  # relative change of a gap up to which a factorisation is used again
_REFINEMENTS = 2  # of the rates, whose matrix is that of the last iteration but one


class Scaled(NamedTuple):
    """The first n nodes of the mesh of a level, at a scale."""

    radii: np.ndarray
    weights: np.ndarray
    influence: np.ndarray
    level: int
    n: int
    scale: float


class Contact(NamedTuple):
    """The point that is being solved; arrays (N,), of which the first n nodes of the mesh are in use."""

    gap: np.ndarray
    traction: np.ndarray
    rate: np.ndarray  # derivatives of the unknowns along the curve; of the indentation, in place of the node held
    columns: np.ndarray  # (N, N), factorised
    pivots: np.ndarray
    pressed: np.ndarray  # whether the traction is the unknown in that factorisation


@kernel
def scaled(interface: Interface, meshes: ScaledMeshes, level: int, far_gap: float, scale: float) -> Scaled:
    """The mesh of a level up to where the profile is a `far_gap` higher than at the contact radius `scale`."""
    n = nodes_within(meshes, level, reach_of(interface, far_gap, scale))
    return Scaled(meshes.radii[level], meshes.weights[level], meshes.influence[level], level, n, scale)


@kernel
def _factorise(interface: Interface, mesh: Scaled, held: int, contact: Contact) -> None:
    influence, load, n, below = mesh.influence, interface.tabor * mesh.scale, mesh.n, pressed_below(interface.law)
    for j in range(n):
        slope = interface.tabor * slope_at(interface.law, contact.gap[j])
        contact.pressed[j] = contact.gap[j] < below and j != held
        factor = load if contact.pressed[j] else load * slope
        row = contact.columns[j]
        for i in range(n):
            row[i] = factor * influence[j, i] if j != held else 1.0
        if j != held:
            row[j] += 1.0 / slope if contact.pressed[j] else 1.0
    lu_factor(contact.columns, n, contact.pivots)


@kernel
def change_unknown(interface: Interface, contact: Contact, j: int, change: float) -> float:
    """Change the unknown of a node; return by how much, relative."""
    law, tabor, gap = interface.law, interface.tabor, contact.gap[j]
    if contact.pressed[j]:
        scaled_traction = (contact.traction[j] + change) / tabor
        contact.gap[j] = changed_gap(law, gap, scaled_traction, pressed_gap_of(law, scaled_traction, gap))
        relative = abs(change) / tabor
    else:
        room = gap - law.floor
        contact.gap[j] += min(max(change, -0.3 * room), 0.5 * room)
        relative = abs(change) / gap
    contact.traction[j] = tabor * traction_at(law, contact.gap[j])
    return relative


@kernel
def set_gap(interface: Interface, contact: Contact, j: int, gap: float) -> None:
    """Set the gap of a node, and its traction by the law."""
    contact.gap[j] = gap
    contact.traction[j] = interface.tabor * traction_at(interface.law, gap)


@kernel
def _lift(influence: np.ndarray, tractions: np.ndarray, n: int, out: np.ndarray) -> None:
    """Displacement under tractions, over Tabor parameter and scale of the mesh."""
    out[:n] = 0.0
    add_rows(influence[:n, :n], tractions[:n], out)


@kernel
def solve_held(
    interface: Interface, mesh: Scaled, held: int, depth: float, settled: float, contact: Contact, work: np.ndarray
) -> tuple[float, bool]:
    """The equilibrium with the gap of the node `held` as it is: its indentation, and whether it was found."""
    tabor, influence, radii, n, scale = interface.tabor, mesh.influence, mesh.radii, mesh.n, mesh.scale
    correction, before, stale = np.empty(n), np.inf, True
    for _ in range(_MOST_ITERATIONS):
        if is_spent(work):
            break
        _lift(influence, contact.traction, n, correction)
        for i in range(n):
            sphere = 1.0 - depth + 0.5 * tabor * (scale * radii[i]) ** 2
            correction[i] = contact.gap[i] + tabor * scale * correction[i] - sphere
        if interface.exponent != PARABOLOID:
            for i in range(n):
                correction[i] -= deviation(interface, scale * radii[i])
        if stale:
            _factorise(interface, mesh, held, contact)
            count_factorisation(work, n)
        lu_solve(contact.columns, n, contact.pivots, correction)
        count_iteration(work, n, n)
        depth -= correction[held]
        largest = 0.0
        for j in range(n):
            if j != held:
                largest = max(largest, change_unknown(interface, contact, j, -correction[j]))
        if not np.isfinite(depth):
            break
        if largest < settled:
            return depth, True
        stale = largest > _CONTRACTION * before or largest > _TRUSTED
        before = largest
    return depth, False


@kernel
def rates_of(
    interface: Interface, mesh: Scaled, held: int, scaling: bool, contact: Contact
) -> tuple[float, float, float]:
    """Force, and derivatives of force and gap on the axis; with them those of all unknowns, into `contact.rate`.

    Where the mesh is `scaling` they are derivatives with respect to its scale, else to the gap of the node `held`.
    """
    tabor, law, rate, n, scale = interface.tabor, interface.law, contact.rate, mesh.n, mesh.scale
    influence, radii, weights = mesh.influence, mesh.radii, mesh.weights
    slopes, tractions, rhs, left = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    _lift(influence, contact.traction, n, left)
    for i in range(n):
        slopes[i] = tabor * slope_at(law, contact.gap[i])
    for i in range(n):
        rhs[i] = tabor * (scale * radii[i] ** 2 - left[i])
        if interface.exponent != PARABOLOID:
            rhs[i] = tabor * ((scale * radii[i]) ** interface.exponent / scale - left[i])
        if not scaling:
            rhs[i] = -tabor * scale * influence[held, i] * slopes[held] - (1.0 if i == held else 0.0)
        left[i], rate[i] = rhs[i], 0.0
    for refinement in range(_REFINEMENTS + 1):
        lu_solve(contact.columns, n, contact.pivots, left)
        for i in range(n):
            rate[i] += left[i]
            tractions[i] = rate[i] if contact.pressed[i] else slopes[i] * rate[i]
        tractions[held] = 0.0
        if refinement < _REFINEMENTS:
            _lift(influence, tractions, n, left)
            for i in range(n):
                gap = 0.0 if i == held else rate[i] / slopes[i] if contact.pressed[i] else rate[i]
                left[i] = rhs[i] - rate[held] - gap - tabor * scale * left[i]
    if not scaling:
        tractions[held] = slopes[held]
    total, total_rate, last = 0.0, 0.0, n - 1
    for j in range(n):
        weight = weights[j] if j < last else weight_of_last(radii, n)
        total += weight * contact.traction[j]
        total_rate += weight * tractions[j]
    gap, radius = contact.gap[last], scale * radii[last]
    share, tail, stress = tail_share(interface, radius, gap), tail_force_at(law, gap), traction_at(law, gap)
    force_rate = scale * scale * total_rate - 2.0 * share * stress * rate[last]
    if interface.exponent != PARABOLOID:
        power = interface.exponent
        bend = tail_bend(interface, radius) * radius ** (2.0 - power)
        growth = ((2.0 - power) * share - power * bend * gap) / scale if scaling else 0.0
        force_rate += (bend * rate[last] + growth) * tail
    axis_rate = 1.0 if held == 0 else rate[0] / slopes[0] if contact.pressed[0] else rate[0]
    force_rate += 2.0 * scale * total if scaling else 0.0
    return scale * scale * total + share * tail, force_rate, axis_rate


@kernel
def restore(interface: Interface, mesh: Scaled, gap: np.ndarray, held: int, scaling: bool, contact: Contact) -> None:
    """The point whose gaps were kept, with its rates."""
    for j in range(mesh.n):
        set_gap(interface, contact, j, gap[j])
    _factorise(interface, mesh, held, contact)
    rates_of(interface, mesh, held, scaling, contact)


@kernel
def transfer(interface: Interface, mesh: Scaled, onto: Scaled, contact: Contact) -> None:
    """Gap and traction carried `onto` another mesh; pressed surfaces by traction, others by gap."""
    law, tabor, below = interface.law, interface.tabor, pressed_below(interface.law)
    old, old_n, new, scale = mesh.radii, mesh.n, onto.radii, onto.scale
    gap, traction = contact.gap[:old_n].copy(), contact.traction[:old_n].copy()
    f = 0
    for i in range(onto.n):
        x = new[i]
        while f < old_n - 2 and old[f + 1] <= x:
            f += 1
        first = min(max(f - 1, 0), old_n - 4)
        if x > old[old_n - 1]:
            new_gap = gap[old_n - 1] + 0.5 * tabor * scale**2 * (x**2 - old[old_n - 1] ** 2)
            new_gap += deviation(interface, scale * x) - deviation(interface, scale * old[old_n - 1])
        elif gap[f] < below and gap[f + 1] < below:
            scaled_traction = cubic(old, traction, first, x) / tabor
            new_gap = changed_gap(law, gap[f], scaled_traction, pressed_gap_of(law, scaled_traction, gap[f]))
        else:
            inner, outer = min(gap[f], gap[f + 1]), max(gap[f], gap[f + 1])
            new_gap = min(max(cubic(old, gap, first, x), inner), outer)
        set_gap(interface, contact, i, new_gap)


@kernel
def reach_of(interface: Interface, gap: float, scale: float) -> float:
    """Radius at which the profile is a `gap` higher than at the contact radius `scale`, over that radius."""
    power = interface.exponent
    if power == PARABOLOID:
        return np.sqrt(1.0 + 2.0 * gap / (interface.tabor * scale**2))
    return (1.0 + power * gap / (interface.tabor * scale**power)) ** (1.0 / power)

"""The curve of elastic equilibria while surfaces approach: from far apart until the edge is at the last node of a mesh.

First the gap on the axis is prescribed; then that of one node after the other, at which the edge is.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.boundary_elements.meshes.cohesive_zone import contact_edge
from bem.methods.elastic_curve.held_gap import (
    Contact,
    Scaled,
    change_unknown,
    rates_of,
    restore,
    scaled,
    set_gap,
    solve_held,
)
from bem.methods.elastic_curve.scaled_meshes import ScaledMeshes, smallest_scale
from bem.methods.outcomes import NO_EQUILIBRIUM, PAUSED, Outcome
from bem.methods.records import REJECTIONS, is_spent
from bem.problem.accuracy import BranchControls
from bem.problem.indenter import PARABOLOID
from bem.problem.tractions import Interface, deviation, tail_force_at, traction_at

POINT = np.dtype(
    [
        ("along", np.float64),  # logarithm of the gap on the axis over the law's floor, of larger contacts the radius
        ("indentation", np.float64),
        ("indentation_rate", np.float64),  # derivative with respect to `along`
        ("force", np.float64),
        ("force_rate", np.float64),
        ("contact_radius", np.float64),
        ("scale", np.float64),  # of the mesh
        ("level", np.int64),
        ("nodes", np.int64),
    ]
)
FAR_POINTS, _FARTHEST = 40, 1e7  # without deformation
_OPEN_STEP = 1.2  # change of the logarithm of a gap, over the step of the contact radius
MOST_TRIES = 12  # of a step


class Growth(NamedTuple):
    """How far the curve was followed, and the solution on it that the next slice of work goes on from."""

    count: int  # points
    depth: float
    force: float
    force_rate: float
    largest: float  # force so far
    level: int  # of the mesh
    scale: float
    pace: float  # of the steps
    outcome: Outcome  # COMPLETED, NO_EQUILIBRIUM, or PAUSED where it goes on


@kernel
def _far_apart(law, power: float, points: np.ndarray) -> None:
    """Points before the first that was solved: there the sphere hardly deforms the surface, ever less with distance.

    The force of a profile of that `power` falls with the gap to the power 2/n - 3, the lift with 1/n - 3.
    """
    first = points[FAR_POINTS]
    nearest = np.exp(first["along"]) + law.floor
    lift = 1.0 - nearest - first["indentation"]
    alone = tail_force_at(law, nearest)
    excess = first["force"] / alone - 1.0 if alone != 0.0 else 0.0
    flatter, lifting, scale = 2.0 / power - 1.0, 3.0 - 1.0 / power, 1.0
    if power != PARABOLOID:
        excess, scale = 0.0, 1.0 + excess
    for k in range(FAR_POINTS):
        gap = nearest * (_FARTHEST / nearest) ** (1.0 - k / FAR_POINTS)
        lifted = lift * (nearest / gap) ** lifting
        point, room = points[k], gap - law.floor
        point["along"], point["indentation"] = np.log(room), 1.0 - gap - lifted
        point["indentation_rate"] = room * (lifting * lifted / gap - 1.0)
        alone, share = tail_force_at(law, gap), excess * (nearest / gap) ** 3.5
        point["force"] = (1.0 + share) * alone
        point["force_rate"] = -room * (2.0 * (1.0 + share) * traction_at(law, gap) + 3.5 * share / gap * alone)
        if power != PARABOLOID:
            wider = scale * (gap / nearest) ** flatter
            point["force"] = wider * alone
            point["force_rate"] = wider * room * (flatter / gap * alone - 2.0 * traction_at(law, gap))
        point["contact_radius"], point["scale"] = 0.0, first["scale"]
        point["level"], point["nodes"] = first["level"], first["nodes"]


@kernel
def _fill_point(
    interface: Interface,
    mesh: Scaled,
    held: int,
    depth: float,
    touching: bool,
    contact: Contact,
    points: np.ndarray,
    count: int,
) -> None:
    """Point number `count` of `points`: the solution with the gap of the node `held`."""
    point, radii, scale = points[count], mesh.radii, mesh.scale
    force, force_rate, axis_rate = rates_of(interface, mesh, held, False, contact)
    room = contact.gap[0] - interface.law.floor
    point["along"], point["indentation"], point["force"] = np.log(room), depth, force
    point["indentation_rate"] = contact.rate[held] * room / axis_rate
    point["force_rate"] = force_rate * room / axis_rate
    edge = contact_edge(radii, contact.gap[: held + 1], interface.law.peak_gap) if touching else radii[held]
    point["contact_radius"], point["scale"] = scale * edge, scale
    point["level"], point["nodes"] = 0, mesh.n


@kernel
def _next_node(held: int, edge_node: int, strides: int) -> int:
    """The node to which the edge moves from the node `held`, in so many `strides` to the `edge_node`."""
    for k in range(1, strides + 1):
        node = np.int64(np.round(edge_node * k / strides))
        if node > held:
            return node
    return held + 1


@kernel
def _predict(
    interface: Interface, mesh: Scaled, held: int, target: int, step: float, share: float, contact: Contact
) -> float:
    """Predict the contact in which the gap of the node `target` is held; return the change of what was held before."""
    peak = interface.law.peak_gap
    if target == 0:
        gap = 1.0 + (contact.gap[0] - 1.0) * np.exp(-step)
        gap = gap if gap - 1.0 > (1.0 + 0.4 * step) * (peak - 1.0) else peak
        change = gap - contact.gap[0]
    else:
        gap = contact.gap[target] + share * (peak - contact.gap[target]) if share < 1.0 else peak
        change = (gap - contact.gap[target]) / (contact.rate[target] if target != held else 1.0)
    for j in range(mesh.n):
        if j == held:
            set_gap(interface, contact, j, contact.gap[j] + change)
        else:
            change_unknown(interface, contact, j, contact.rate[j] * change)
    set_gap(interface, contact, target, gap)
    return change


@kernel
def approach(
    interface: Interface,
    meshes: ScaledMeshes,
    controls: BranchControls,
    points: np.ndarray,
    gaps: np.ndarray,
    works: np.ndarray,
    contact: Contact,
    work: np.ndarray,
) -> Growth:
    """The curve without contact; then with the edge at one node of the first mesh after the other, up to the last.

    Arguments as of `bem.methods.elastic_curve.branch.follow`.
    """
    tabor, peak = interface.tabor, interface.law.peak_gap
    scale, edge_node, depth = smallest_scale(tabor, interface.exponent), meshes.edge_node[0], 1.0 - controls.first_gap
    mesh = scaled(interface, meshes, 0, controls.far_gap, scale)
    for j in range(mesh.n):
        above = deviation(interface, scale * mesh.radii[j])
        set_gap(interface, contact, j, controls.first_gap + 0.5 * tabor * (scale * mesh.radii[j]) ** 2 + above)
    strides = max(min(np.int64(np.ceil(1.0 / (controls.step * min(1.0, np.sqrt(tabor))))), edge_node), 1)
    count, held, before, target, tries, step = FAR_POINTS, 0, 0, 0, 0, _OPEN_STEP * controls.step
    largest, share = 0.0, 1.0  # of the way on which the edge comes to the next node
    while True:
        depth, solved = solve_held(interface, mesh, held, depth, controls.residual, contact, work)
        bent, touches = False, target > 0
        if solved:
            _fill_point(interface, mesh, held, depth, touches and contact.gap[held] > peak, contact, points, count)
            point, last = points[count], points[count - 1]
            if touches:  # as later on: in a stiff contact the force grows manifold between two nodes
                mean = 0.5 * (last["force_rate"] + point["force_rate"])
                bend = abs(point["force"] - last["force"] - (point["along"] - last["along"]) * mean)
                bent = bend > controls.bend * max(abs(last["force"]), largest) and tries < MOST_TRIES
        if solved and not bent:
            gaps[count, : mesh.n], works[count] = contact.gap[: mesh.n], work
            if count == FAR_POINTS:
                _far_apart(interface.law, interface.exponent, points)
            arrived, largest = contact.gap[held] <= peak, max(largest, points[count]["force"])
            count, before, tries, share = count + 1, held, 0, min(2.0 * share, 1.0)
            if (held == edge_node and arrived) or count == points.size:
                break
            step = min(1.5 * step, _OPEN_STEP * controls.step)
            if contact.gap[0] <= peak:
                target = _next_node(held, edge_node, strides) if arrived else held
        else:
            work[REJECTIONS] += 1
            tries += 1
            stuck = not bent and (tries > MOST_TRIES or 0 < target <= before + 1)
            if count == FAR_POINTS or stuck or is_spent(work):
                return Growth(count, depth, 0.0, 0.0, 0.0, 0, scale, 1.0, NO_EQUILIBRIUM)
            held = before
            restore(interface, mesh, gaps[count - 1], held, False, contact)
            step *= 0.5
            share *= 0.5 if 0 < target <= before + 1 else 1.0
            target = (before + target + 1) // 2
        change = _predict(interface, mesh, held, target, step, share, contact)
        depth = points[count - 1]["indentation"] + contact.rate[held] * change
        held = target
    force, force_rate, _ = rates_of(interface, mesh, edge_node, True, contact)
    largest = points["force"][FAR_POINTS:count].max()
    return Growth(count, depth, force, force_rate, largest, 0, scale, 1.0, PAUSED)

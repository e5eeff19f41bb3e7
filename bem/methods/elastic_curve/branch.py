"""The curve of all equilibria of an elastic contact with adhesion, followed once and kept.

An elastic contact remembers nothing: its force depends on the branch it is on and on the place there. The curve depends
on the Tabor parameter and the traction law alone; indentation, spring and force only read it differently
(`bem.methods.elastic_curve.trajectory`). It runs from surfaces far apart over the fold where they snap in, the unstable
branch and the fold where they let go, to the deepest contact.

At a fixed indentation the edge of a large contact is held loosely, and Newton-Raphson converges from ever shorter
distances. Here the contact radius is prescribed (a node at the edge has the gap of largest tension), or without contact
the gap on the axis, and the indentation is an unknown in its place: the system has no soft direction and no fold. The
mesh scales with the contact radius (`bem.methods.elastic_curve.scaled_meshes`). The smallest contacts share one mesh,
on which the edge moves from node to node, so that nothing changes where surfaces meet. Where surfaces press on each
other the traction is the unknown of a node, elsewhere the gap.

At every point the derivatives of indentation and force along the curve follow from the matrix that was factorised. They
predict the next point, and between two points the curve is a cubic.

Units: as in `bem.methods.boundary_elements.equilibrium`. Source: the loop of equilibria of Greenwood, Proc. R. Soc. A
453 (1997) 1277.
"""

import functools
import threading
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem._support.linear_algebra import add_rows, lu_factor, lu_solve
from bem.methods.boundary_elements.discrete_problem import LoadingDevice
from bem.methods.boundary_elements.jumps import smallest_eigenvalue
from bem.methods.boundary_elements.meshes.cohesive_zone import contact_edge, largest_contact_radius
from bem.methods.boundary_elements.meshes.regrid import cubic
from bem.methods.elastic_curve.scaled_meshes import (
    NO_RING,
    ScaledMeshes,
    level_of,
    nodes_within,
    scaled_meshes,
    smallest_scale,
    weight_of_last,
)
from bem.methods.outcomes import COMPLETED, NO_EQUILIBRIUM, PAUSED, Outcome
from bem.methods.records import (
    COUNTS,
    MOST,
    REJECTIONS,
    count_factorisation,
    count_iteration,
    is_spent,
    is_to_pause,
    new_work,
    next_slice,
)
from bem.problem.accuracy import Accuracy, BranchControls
from bem.problem.indenter import PARABOLOID
from bem.problem.tractions import (
    Interface,
    LennardJones,
    TractionLaw,
    deviation,
    interface_of,
    slope_at,
    tail_bend,
    tail_force_at,
    tail_share,
    traction_at,
)
from bem.problem.tractions.pressed import changed_gap, pressed_below, pressed_gap_of

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
_FAR_POINTS, _FARTHEST = 40, 1e7  # without deformation
_MOST_POINTS = 4000
_MOST_ITERATIONS, _MOST_TRIES = 20, 12
_CONTRACTION = 0.15  # of corrections, above which the matrix is factorised again
_TRUSTED = 0.3  # relative change of a gap up to which a factorisation is used again
_OPEN_STEP = 1.2  # change of the logarithm of a gap, over the step of the contact radius
_REFINEMENTS = 2  # of the rates, whose matrix is that of the last iteration but one
_MOST_RING_NODES = 400  # falls narrower than 0.28 h0 would take a minute
_PAST_FOLDS = 1.5  # contact radius beyond which nothing folds


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
def _scaled(interface: Interface, meshes: ScaledMeshes, level: int, far_gap: float, scale: float) -> Scaled:
    """The mesh of a level up to where the profile is a `far_gap` higher than at the contact radius `scale`."""
    n = nodes_within(meshes, level, _reach(interface, far_gap, scale))
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
def _change(interface: Interface, contact: Contact, j: int, change: float) -> float:
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
def _set_gap(interface: Interface, contact: Contact, j: int, gap: float) -> None:
    contact.gap[j] = gap
    contact.traction[j] = interface.tabor * traction_at(interface.law, gap)


@kernel
def _lift(influence: np.ndarray, tractions: np.ndarray, n: int, out: np.ndarray) -> None:
    """Displacement under tractions, over Tabor parameter and scale of the mesh."""
    out[:n] = 0.0
    add_rows(influence[:n, :n], tractions[:n], out)


@kernel
def _solve(
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
                largest = max(largest, _change(interface, contact, j, -correction[j]))
        if not np.isfinite(depth):
            break
        if largest < settled:
            return depth, True
        stale = largest > _CONTRACTION * before or largest > _TRUSTED
        before = largest
    return depth, False


@kernel
def _rates(
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
def _restore(interface: Interface, mesh: Scaled, gap: np.ndarray, held: int, scaling: bool, contact: Contact) -> None:
    """The point whose gaps were kept, with its rates."""
    for j in range(mesh.n):
        _set_gap(interface, contact, j, gap[j])
    _factorise(interface, mesh, held, contact)
    _rates(interface, mesh, held, scaling, contact)


@kernel
def _transfer(interface: Interface, mesh: Scaled, onto: Scaled, contact: Contact) -> None:
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
        _set_gap(interface, contact, i, new_gap)


@kernel
def _reach(interface: Interface, gap: float, scale: float) -> float:
    """Radius at which the profile is a `gap` higher than at the contact radius `scale`, over that radius."""
    power = interface.exponent
    if power == PARABOLOID:
        return np.sqrt(1.0 + 2.0 * gap / (interface.tabor * scale**2))
    return (1.0 + power * gap / (interface.tabor * scale**power)) ** (1.0 / power)


@kernel
def _far_apart(law, power: float, points: np.ndarray) -> None:
    """Points before the first that was solved: there the sphere hardly deforms the surface, ever less with distance.

    The force of a profile of that `power` falls with the gap to the power 2/n - 3, the lift with 1/n - 3.
    """
    first = points[_FAR_POINTS]
    nearest = np.exp(first["along"]) + law.floor
    lift = 1.0 - nearest - first["indentation"]
    alone = tail_force_at(law, nearest)
    excess = first["force"] / alone - 1.0 if alone != 0.0 else 0.0
    flatter, lifting, scale = 2.0 / power - 1.0, 3.0 - 1.0 / power, 1.0
    if power != PARABOLOID:
        excess, scale = 0.0, 1.0 + excess
    for k in range(_FAR_POINTS):
        gap = nearest * (_FARTHEST / nearest) ** (1.0 - k / _FAR_POINTS)
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
def _approach(
    interface: Interface,
    meshes: ScaledMeshes,
    controls: BranchControls,
    points: np.ndarray,
    gaps: np.ndarray,
    works: np.ndarray,
    contact: Contact,
    work: np.ndarray,
) -> Growth:
    """The curve without contact; then with the edge at one node of the first mesh after the other, up to the last."""
    law, tabor, peak = interface.law, interface.tabor, interface.law.peak_gap
    scale, edge_node, depth = smallest_scale(tabor, interface.exponent), meshes.edge_node[0], 1.0 - controls.first_gap
    mesh = _scaled(interface, meshes, 0, controls.far_gap, scale)
    radii = mesh.radii
    for j in range(mesh.n):
        above = deviation(interface, scale * radii[j])
        _set_gap(interface, contact, j, controls.first_gap + 0.5 * tabor * (scale * radii[j]) ** 2 + above)
    strides = max(min(np.int64(np.ceil(1.0 / (controls.step * min(1.0, np.sqrt(tabor))))), edge_node), 1)
    count, held, before, target, tries, step = _FAR_POINTS, 0, 0, 0, 0, _OPEN_STEP * controls.step
    largest, share = 0.0, 1.0  # of the way on which the edge comes to the next node
    while True:
        depth, solved = _solve(interface, mesh, held, depth, controls.residual, contact, work)
        bent = False
        if solved:
            force, force_rate, axis_rate = _rates(interface, mesh, held, False, contact)
            room = contact.gap[0] - law.floor
            point, last = points[count], points[count - 1]
            point["along"], point["indentation"], point["force"] = np.log(room), depth, force
            point["indentation_rate"] = contact.rate[held] * room / axis_rate
            point["force_rate"] = force_rate * room / axis_rate
            touching = contact.gap[held] > peak and target > 0
            edge = contact_edge(radii, contact.gap[: held + 1], peak) if touching else radii[held]
            point["contact_radius"], point["scale"] = scale * edge, scale
            point["level"], point["nodes"] = 0, mesh.n
            if target > 0:  # as below: in a stiff contact the force grows manifold between two nodes
                mean = 0.5 * (last["force_rate"] + point["force_rate"])
                bend = abs(force - last["force"] - (point["along"] - last["along"]) * mean)
                bent = bend > controls.bend * max(abs(last["force"]), largest) and tries < _MOST_TRIES
        if solved and not bent:
            gaps[count, : mesh.n], works[count] = contact.gap[: mesh.n], work
            if count == _FAR_POINTS:
                _far_apart(law, interface.exponent, points)
            arrived = contact.gap[held] <= peak
            count, before, tries, largest, share = count + 1, held, 0, max(largest, force), min(2.0 * share, 1.0)
            if (held == edge_node and arrived) or count == points.size:
                break
            step = min(1.5 * step, _OPEN_STEP * controls.step)
            if contact.gap[0] <= peak:
                target = held + 1 if arrived else held
                for k in range(strides, 0, -1):
                    node = np.int64(np.round(edge_node * k / strides))
                    target = node if node > held and arrived else target
        else:
            work[REJECTIONS] += 1
            tries += 1
            stuck = not bent and (tries > _MOST_TRIES or 0 < target <= before + 1)
            if count == _FAR_POINTS or stuck or is_spent(work):
                return Growth(count, depth, 0.0, 0.0, 0.0, 0, scale, 1.0, NO_EQUILIBRIUM)
            held = before
            _restore(interface, mesh, gaps[count - 1], held, False, contact)
            step *= 0.5
            share *= 0.5 if 0 < target <= before + 1 else 1.0
            target = (before + target + 1) // 2
        if target == 0:
            gap = 1.0 + (contact.gap[0] - 1.0) * np.exp(-step)
            gap = gap if gap - 1.0 > (1.0 + 0.4 * step) * (peak - 1.0) else peak
            change = gap - contact.gap[0]
        else:
            gap = contact.gap[target] + share * (peak - contact.gap[target]) if share < 1.0 else peak
            change = (gap - contact.gap[target]) / (contact.rate[target] if target != held else 1.0)
        depth = points[count - 1]["indentation"] + contact.rate[held] * change
        for j in range(mesh.n):
            if j == held:
                _set_gap(interface, contact, j, contact.gap[j] + change)
            else:
                _change(interface, contact, j, contact.rate[j] * change)
        held = target
        _set_gap(interface, contact, held, gap)
    force, force_rate, _ = _rates(interface, mesh, edge_node, True, contact)
    largest = points["force"][_FAR_POINTS:count].max()
    return Growth(count, depth, force, force_rate, largest, 0, scale, 1.0, PAUSED)


@kernel
def follow(
    interface: Interface,
    meshes: ScaledMeshes,
    controls: BranchControls,
    deepest: float,
    points: np.ndarray,
    gaps: np.ndarray,
    works: np.ndarray,
    contact: Contact,
    growth: Growth,
    work: np.ndarray,
) -> Growth:
    """Follow the curve to the indentation `deepest`, past all folds, or for a slice of work.

    Args:
        interface: the contact, with adhesion.
        meshes: as many as it takes.
        controls: steps and tolerances.
        deepest: in h0.
        points: (m,) of `POINT`, filled.
        gaps: (m, N) of each point on its mesh, filled.
        works: (m, counts) the work up to each point, filled.
        contact: the last solution, overwritten.
        growth: how far it was followed; no points before the first slice.
        work: counts as in `bem.methods.records`, added to.
    """
    outcome = NO_EQUILIBRIUM
    if growth.count == 0:
        growth = _approach(interface, meshes, controls, points, gaps, works, contact, work)
        if growth.outcome == NO_EQUILIBRIUM:
            return growth
    count, depth, force, force_rate, largest, level, scale, pace, _ = growth
    mesh, edge_node = _scaled(interface, meshes, level, controls.far_gap, scale), meshes.edge_node[level]
    tabor, peak = interface.tabor, interface.law.peak_gap
    # The mesh grows with the contact, by shorter steps where the force bends too much for a cubic.
    while count < points.size:
        if is_to_pause(work):
            outcome = PAUSED
            break
        point, scale = points[count], mesh.scale
        point["along"], point["indentation"], point["force"] = scale, depth, force
        point["indentation_rate"], point["force_rate"] = contact.rate[edge_node], force_rate
        point["contact_radius"], point["scale"], point["level"], point["nodes"] = scale, scale, mesh.level, mesh.n
        gaps[count, : mesh.n], works[count] = contact.gap[: mesh.n], work
        count, largest = count + 1, max(largest, force)
        if depth >= deepest and force < 0.0 and scale > _PAST_FOLDS:
            outcome = COMPLETED
            break
        start_depth, before, before_rate, rate = depth, force, force_rate, contact.rate[edge_node]
        step, solved = pace * controls.step * scale, False
        for left in range(_MOST_TRIES - 1, -1, -1):
            depth = start_depth + rate * step
            for j in range(mesh.n):
                if j != edge_node:
                    _change(interface, contact, j, contact.rate[j] * step)
            level = level_of(scale + step, tabor, interface.exponent)
            if level >= meshes.size.size:
                solved = False
                break
            new = _scaled(interface, meshes, level, controls.far_gap, scale + step)
            if level != mesh.level:
                _transfer(interface, mesh, new, contact)
            node = meshes.edge_node[level]
            _set_gap(interface, contact, node, peak)
            depth, solved = _solve(interface, new, node, depth, controls.residual, contact, work)
            if solved:
                force, force_rate, _ = _rates(interface, new, node, True, contact)
                bend = abs(force - before - 0.5 * step * (before_rate + force_rate))
                if left == 0 or bend <= controls.bend * max(abs(before), largest):
                    break
            if is_spent(work):
                break
            work[REJECTIONS] += 1
            _restore(interface, mesh, gaps[count - 1], edge_node, True, contact)
            step *= 0.5
        if not solved:
            break
        mesh, edge_node, pace = new, node, min(2.0 * step / (controls.step * scale), 1.0)
    return Growth(count, depth, force, force_rate, largest, mesh.level, mesh.scale, pace, outcome)


class Branch:
    """The curve of one interface at one accuracy, as far as it was needed so far."""

    def __init__(self, interface: Interface, controls: BranchControls) -> None:
        self.interface, self.controls = interface, controls
        self._points, self._gaps = np.empty(0, POINT), np.empty((0, 0))
        self._works = np.empty((0, len(COUNTS)), np.int64)
        self._eigenvalues = dict[tuple[int, float], float]()
        self._lock = threading.Lock()

    def reaching(self, deepest: float, most_work: float) -> tuple[np.ndarray, np.ndarray]:
        """The curve up to the indentation `deepest`, and the work it takes, whether or not it was done before.

        Returns:
            points (m,) of `POINT`, and counts as in `bem.methods.records`. The curve ends earlier where an equilibrium
            is not found, or the budget is used up.

        Raises:
            MemoryError: where the contact edge is too narrow for its radius.
        """
        with self._lock:
            if not self._points.size or self._points["indentation"][-1] < deepest:
                farther = deepest if not self._points.size else deepest + abs(deepest)
                self._follow(farther, most_work)
            points = self._points
            if not points.size:
                return points, uncompiled(new_work)(most_work)
            past = (points["indentation"] >= deepest) & (points["force"] < 0.0) & (points["scale"] > _PAST_FOLDS)
            end = int(np.argmax(past)) + 1 if past.any() else points.size
            work = self._works[end - 1].copy()
            work[MOST] = uncompiled(new_work)(most_work)[MOST]
            return points[:end], work

    def _follow(self, deepest: float, most_work: float) -> None:
        tabor, controls, shape = self.interface.tabor, self.controls, self.interface.exponent
        scale = uncompiled(smallest_scale)(tabor, shape)
        largest = max(1.3 * largest_contact_radius(deepest, tabor, shape), 2.0 * _PAST_FOLDS)
        reach = uncompiled(_reach)(self.interface, controls.far_gap, scale)
        levels, work = uncompiled(level_of)(max(largest, scale), tabor, shape) + 1, uncompiled(new_work)(most_work)
        # A traction that falls steeply acts, before the surfaces meet, on a disk much wider than the smallest contact.
        # Where the nodes at its rim are too few the curve of their equilibria breaks off, and takes more of them.
        spacing, extent = controls.ring
        rings = [NO_RING, (spacing / scale, extent / scale)] if extent < _MOST_RING_NODES * spacing else [NO_RING]
        for ring in rings:
            meshes = scaled_meshes(controls, levels, 1.5 * reach, ring)
            points, gaps = np.empty(_MOST_POINTS, POINT), np.empty((_MOST_POINTS, meshes.radii.shape[1]))
            works = np.zeros((_MOST_POINTS, len(COUNTS)), np.int64)
            size = meshes.radii.shape[1]
            columns, pivots, pressed = np.zeros((size, size)), np.zeros(size, np.int32), np.zeros(size, np.bool_)
            contact = Contact(*np.zeros((3, size)), columns, pivots, pressed)
            growth = Growth(0, 0.0, 0.0, 0.0, 0.0, 0, 0.0, 1.0, PAUSED)
            tables = points, gaps, works
            while growth.outcome == PAUSED:
                growth = follow(self.interface, meshes, controls, deepest, *tables, contact, growth, next_slice(work))
            works[growth.count - 1] = work  # with what did not lead on
            if growth.outcome == COMPLETED or uncompiled(is_spent)(work):
                break
        count = growth.count if growth.count > _FAR_POINTS else 0
        self._meshes, self._points = meshes, points[:count].copy()
        self._gaps, self._works = gaps[:count].copy(), works[:count].copy()

    def smallest_eigenvalue(self, position: float, device: LoadingDevice) -> float:
        """Smallest eigenvalue of the Jacobian under a device, at the solved point next to a place."""
        nearest, compliance = max(round(position), _FAR_POINTS), device.compliance
        if (nearest, compliance) not in self._eigenvalues:
            point = self._points[nearest]
            level, n, scale = int(point["level"]), int(point["nodes"]), float(point["scale"])
            influence = self.interface.tabor * scale * self._meshes.influence[level, :n, :n]
            influence = influence + compliance * scale**2 * self._meshes.weights[level, :n, None]
            value = smallest_eigenvalue(self.interface, influence, self._gaps[nearest, :n].copy(), 1.0)
            self._eigenvalues[nearest, compliance] = float(value) / (1.0 + compliance / device.depth_scale)
        return self._eigenvalues[nearest, compliance]


@functools.lru_cache(maxsize=32)
def branch_of(tabor: float, adhesion: LennardJones | TractionLaw, accuracy: Accuracy, exponent: float) -> Branch:
    """The branch of a scene at an accuracy; the last of a process are kept."""
    fineness = adhesion.fineness if isinstance(adhesion, TractionLaw) else 1.0
    controls = accuracy.branch_controls(tabor, fineness, exponent)
    return Branch(interface_of(tabor, adhesion, exponent), controls)

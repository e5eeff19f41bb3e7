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

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem.methods.boundary_elements.discrete_problem import LoadingDevice
from bem.methods.boundary_elements.jumps import smallest_eigenvalue
from bem.methods.boundary_elements.meshes.cohesive_zone import largest_contact_radius
from bem.methods.elastic_curve.approach import FAR_POINTS, MOST_TRIES, POINT, Growth, approach
from bem.methods.elastic_curve.held_gap import (
    Contact,
    Scaled,
    change_unknown,
    rates_of,
    reach_of,
    restore,
    scaled,
    set_gap,
    solve_held,
    transfer,
)
from bem.methods.elastic_curve.scaled_meshes import NO_RING, ScaledMeshes, level_of, scaled_meshes, smallest_scale
from bem.methods.outcomes import COMPLETED, NO_EQUILIBRIUM, PAUSED
from bem.methods.records import COUNTS, MOST, REJECTIONS, is_spent, is_to_pause, new_work, next_slice
from bem.problem.accuracy import Accuracy, BranchControls
from bem.problem.tractions import Interface, LennardJones, TractionLaw, interface_of

_MOST_POINTS = 4000
_MOST_RING_NODES = 400  # falls narrower than 0.28 h0 would take a minute
_PAST_FOLDS = 1.5  # contact radius beyond which nothing folds


@kernel
def _grown(
    interface: Interface,
    meshes: ScaledMeshes,
    mesh: Scaled,
    level: int,
    far_gap: float,
    step: float,
    contact: Contact,
) -> Scaled:
    """The mesh of a level at a scale larger by `step`, with the contact predicted on it."""
    for j in range(mesh.n):
        if j != meshes.edge_node[mesh.level]:
            change_unknown(interface, contact, j, contact.rate[j] * step)
    new = scaled(interface, meshes, level, far_gap, mesh.scale + step)
    if level != mesh.level:
        transfer(interface, mesh, new, contact)
    set_gap(interface, contact, meshes.edge_node[level], interface.law.peak_gap)
    return new


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
        growth = approach(interface, meshes, controls, points, gaps, works, contact, work)
        if growth.outcome == NO_EQUILIBRIUM:
            return growth
    count, depth, force, force_rate, largest, level, scale, pace, _ = growth
    mesh, edge_node = scaled(interface, meshes, level, controls.far_gap, scale), meshes.edge_node[level]
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
        for left in range(MOST_TRIES - 1, -1, -1):
            depth = start_depth + rate * step
            level = level_of(scale + step, interface.tabor, interface.exponent)
            if level >= meshes.size.size:
                solved = False
                break
            new = _grown(interface, meshes, mesh, level, controls.far_gap, step, contact)
            node = meshes.edge_node[level]
            depth, solved = solve_held(interface, new, node, depth, controls.residual, contact, work)
            if solved:
                force, force_rate, _ = rates_of(interface, new, node, True, contact)
                bend = abs(force - before - 0.5 * step * (before_rate + force_rate))
                if left == 0 or bend <= controls.bend * max(abs(before), largest):
                    break
            if is_spent(work):
                break
            work[REJECTIONS] += 1
            restore(interface, mesh, gaps[count - 1], edge_node, True, contact)
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
        reach = uncompiled(reach_of)(self.interface, controls.far_gap, scale)
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
        count = growth.count if growth.count > FAR_POINTS else 0
        self._meshes, self._points = meshes, points[:count].copy()
        self._gaps, self._works = gaps[:count].copy(), works[:count].copy()

    def smallest_eigenvalue(self, position: float, device: LoadingDevice) -> float:
        """Smallest eigenvalue of the Jacobian under a device, at the solved point next to a place."""
        nearest, compliance = max(round(position), FAR_POINTS), device.compliance
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

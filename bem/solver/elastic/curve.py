"""Elastic contacts at large Tabor parameters: the curve of all equilibria, followed by the contact radius.

At a fixed indentation the edge of a large contact is held loosely: the resistance of the half-space to its motion, over
that of the cohesive zone, is the ratio of the zone's width to the radius, which falls as 1 / mu^2. Newton-Raphson then
converges from ever shorter distances, and the edge catches at each node. Without memory neither is needed. Where
something touches, the contact radius is prescribed (a node at the edge has the gap of largest tension), otherwise the
gap on the axis, and the indentation is an unknown in its place. The system has no soft direction and no fold, the edge
lies on a node always, and the length of a step does not depend on the width of the zone. The curve runs from surfaces
far apart over the fold where they snap in, the unstable branch and the fold where they let go, to the deepest contact.

Units: as in `bem.solver.equilibrium`. Source: the loop of equilibria of Greenwood, Proc. R. Soc. A 453 (1997) 1277.
"""

from dataclasses import dataclass

import numpy as np

from bem._numerics.jit import in_python
from bem._numerics.linear_algebra import lu_factor, lu_solve
from bem.reference_solutions import jkr
from bem.solver.discretisation.cohesive_zone import edge_width
from bem.solver.discretisation.hat_influence import hat_influence
from bem.solver.discretisation.influence import force_weights
from bem.solver.discretisation.master_grid import AHEAD, BEHIND, fixed_grid
from bem.solver.discretisation.mesh import Mesh
from bem.solver.discretisation.transfer import transfer
from bem.solver.energy import stored_energy
from bem.solver.equilibrium import PRESSED, force_of
from bem.solver.pressed import LARGEST_TENSION, pressed_gaps
from bem.solver.problem import Problem
from bem.solver.work import FACTORISATIONS, ITERATIONS, REJECTIONS, UNKNOWNS
from bem.tractions import GAP_AT_PEAK, LENNARD_JONES, slope, traction

_MOST_ITERATIONS = 25
_SETTLED = 1e-7  # last relative change of a gap; that after it is below rounding
_LATTICE = 8  # places in one lattice spacing of the master grid
_FINER = 0.6  # spacing at the edge, of that of a mesh in which the edge moves
_OPEN_STEP = 0.1  # change of the gap on the axis in one step, relative
_FIRST_STEP, _GROWTH, _LONGEST_STEP = 0.3, 1.3, 0.04  # of the edge: in widths, each of the last, in beta or of it
_USUAL_PREDICTION = 0.04
_TRIES = 12  # halvings of a step


@dataclass(frozen=True)
class Equilibrium:
    """A point of the curve."""

    mesh: Mesh
    gap: np.ndarray  # (n,)
    traction: np.ndarray  # (n,)
    depth: float  # indentation
    force: float
    edge: float  # contact radius; 0 where nothing touches
    energy: float


@dataclass(frozen=True)
class Lattice:
    """The scene, and the lattice of its meshes, finer than that of the master grid."""

    problem: Problem
    spacing: float  # in beta
    last: int  # place of the outermost node


def lattice_of(problem: Problem) -> Lattice:
    """The lattice of a scene whose master grid moves."""
    return Lattice(problem, problem.grid.spacing / _LATTICE, _LATTICE * int(problem.grid.places[-1]))


def _offsets(lattice: Lattice, width: float, reach: int, extent: float, widest: int) -> np.ndarray:
    """Distances of nodes from the edge up to `reach`, in lattice spacings; equal for `extent` widths, then growing."""
    controls = lattice.problem.controls
    first = max(int(_FINER * controls.edge_spacing * width / lattice.spacing), 1)
    offsets = [0]
    while offsets[-1] < reach:
        beyond = max(offsets[-1] - extent * width / lattice.spacing, 0.0)
        offsets.append(offsets[-1] + int(min(first + beyond * (controls.growth - 1.0), widest)))
    return np.array(offsets)


def _mesh(lattice: Lattice, edge: float) -> tuple[Mesh, int]:
    """A mesh with a node at the edge, and the number of that node."""
    controls, tabor, last = lattice.problem.controls, lattice.problem.tabor, lattice.last
    middle = round(edge / lattice.spacing)
    width = in_python(edge_width)(edge, tabor, False)
    widest = max(int(controls.widest * max(edge, 0.5) / lattice.spacing), 1)
    outwards = middle + _offsets(lattice, width, last - middle, AHEAD, 2 * widest)
    inwards = middle - _offsets(lattice, width, middle, BEHIND, widest)
    # The innermost spacing, between the axis and the first node, is no shorter than half of the next.
    inwards = inwards[inwards > (0.5 * (inwards[-2] - inwards[-1]) if inwards.size > 1 else 0)]
    places = np.unique(np.concatenate([[0], inwards, outwards[outwards < last], [last]]))
    nodes = np.arange(places.size)
    influence = tabor * lattice.spacing * hat_influence(places, lattice.problem.series)
    radii, shares = lattice.spacing * places, np.zeros((places.size, 4))
    shares[:, 0] = 1.0
    window, rows = np.array([-1.0, np.inf]), np.empty((0, places.size))
    weights, grid = force_weights(radii), fixed_grid(places.size)
    mesh = Mesh(nodes, radii, influence, rows, weights, nodes, shares, window, grid)
    return mesh, int(np.searchsorted(places, middle))


def _solve(
    lattice: Lattice, mesh: Mesh, held: int, gap: np.ndarray, depth: float, work: np.ndarray
) -> Equilibrium | None:
    """Newton-Raphson from `gap` and `depth`, the gap of the node `held` prescribed; None where it does not converge."""
    tabor, n = lattice.problem.tabor, gap.size
    law, law_slope = in_python(traction), in_python(slope)
    pivots, inside, fixed = np.empty(n, dtype=np.int32), np.empty(n), gap[held]
    stress = tabor * law(gap)
    sphere = 1.0 + 0.5 * tabor * mesh.radii**2
    for _ in range(_MOST_ITERATIONS):
        residual = gap + stress @ mesh.influence - (sphere - depth)
        if not np.all(np.isfinite(residual)):
            return None
        pressed = gap < PRESSED
        pressed[held] = False
        stiffness = tabor * law_slope(gap)
        columns = mesh.influence * np.where(pressed, 1.0, stiffness)[:, None]
        columns[np.arange(n), np.arange(n)] += np.where(pressed, 1.0 / stiffness, 1.0)
        columns[held] = 1.0
        lu_factor(columns, n, pivots)
        correction = residual.copy()
        lu_solve(columns, n, pivots, correction)
        work[ITERATIONS] += 1
        work[FACTORISATIONS] += 1
        work[UNKNOWNS] += n
        depth -= correction[held]
        correction[held] = 0.0
        change = np.max(np.abs(np.where(pressed, correction / tabor, correction / gap)))
        # Each unknown stays on the branch of the law on which it was linearised.
        wanted = np.where(pressed, (stress - correction) / tabor, -1.0)
        pressed_gaps(wanted, n, gap, LENNARD_JONES, inside)
        inside[wanted > LARGEST_TENSION] = 1.05 * gap[wanted > LARGEST_TENSION]
        gap = np.where(pressed, inside, gap + np.clip(-correction, -0.3 * gap, 0.5 * gap))
        gap[held] = fixed
        stress = tabor * law(gap)
        if change < _SETTLED:
            force = force_of(mesh.force_weights, stress, gap, LENNARD_JONES)
            energy = stored_energy(mesh.radii, mesh.force_weights, tabor, LENNARD_JONES, False, depth, gap, stress)
            edge = float(mesh.radii[held])
            return Equilibrium(mesh, gap, stress, float(depth), float(force), edge, float(energy))
    return None


def solve_open(lattice: Lattice, axis_gap: float, start: Equilibrium | None, work: np.ndarray) -> Equilibrium | None:
    """The equilibrium with this gap on the axis, above that of largest tension.

    Args:
        lattice: of `lattice_of`.
        axis_gap: in h0.
        start: a neighbour on the curve, also without contact, or None.
        work: counts as in `bem.solver.work`, added to.

    Returns:
        the point, or None where Newton-Raphson does not converge from the neighbour.
    """
    mesh = _mesh(lattice, 0.0)[0] if start is None else start.mesh
    gap, depth = axis_gap + 0.5 * lattice.problem.tabor * mesh.radii**2, 1.0 - axis_gap
    if start is not None:
        gap = start.gap * (axis_gap / start.gap[0]) ** (1.0 / (1.0 + (mesh.radii / 0.3) ** 2))
        depth = start.depth
    gap[0] = axis_gap
    return _solve(lattice, mesh, 0, gap, depth, work)


def solve_closed(lattice: Lattice, edge: float, start: Equilibrium, work: np.ndarray) -> Equilibrium | None:
    """The equilibrium with this contact radius, rounded to the lattice; as `solve_open`, from any neighbour."""
    mesh, held = _mesh(lattice, edge)
    edge, old, radii = float(mesh.radii[held]), start.edge, start.mesh.radii
    # The neighbour's nodes, moved with the edge; the axis stays.
    if old > 0.0:
        behind = old - radii
        stretch = 1.0 + (edge / old - 1.0) * np.maximum(behind / old, 0.0) ** 2
        moved = edge - behind * stretch
    else:
        moved = radii + edge * -np.expm1(-radii / edge)
    gap, stress = np.empty(mesh.radii.size), np.empty(mesh.radii.size)
    tabor = lattice.problem.tabor
    transfer(
        start.mesh._replace(radii=moved), start.gap, start.traction, mesh, tabor, LENNARD_JONES, False, gap, stress
    )
    gap[held] = GAP_AT_PEAK
    return _solve(lattice, mesh, held, gap, start.depth, work)


def trace(
    lattice: Lattice, lowest: float, deepest: float, work: np.ndarray
) -> tuple[list[Equilibrium], list[Equilibrium]]:
    """The curve from the indentation `lowest`, where the surfaces are apart, to `deepest`.

    Returns:
        its points without contact, by falling gap, and with contact, by growing radius; the last lies at `deepest` or
        beyond. Fewer where an equilibrium is not found.
    """
    tabor = lattice.problem.tabor
    finer = min(lattice.problem.controls.prediction / _USUAL_PREDICTION, 1.0) ** 0.1
    ratio = 1.0 - _OPEN_STEP * finer
    apart, contact = list[Equilibrium](), list[Equilibrium]()
    gap = 1.1 * (1.0 - min(lowest, 0.0)) + 4.0
    while gap > 1.01 * GAP_AT_PEAK:
        found = solve_open(lattice, gap, apart[-1] if apart else None, work)
        if found is None:
            return apart, contact
        apart.append(found)
        gap = 1.0 + (gap - 1.0) * ratio
    point, step = apart[-1], _FIRST_STEP * in_python(edge_width)(0.0, tabor, False)
    tries = 0
    while point.depth < deepest or point.edge < jkr.FOLD_RADIUS:
        found = solve_closed(lattice, point.edge + step, point, work)
        if found is not None:
            contact.append(found)
            point, tries, step = found, 0, min(_GROWTH * step, _LONGEST_STEP * finer * max(point.edge, 1.0))
        elif tries == _TRIES:
            break
        else:
            work[REJECTIONS] += 1
            tries, step = tries + 1, 0.5 * step
    return apart, contact

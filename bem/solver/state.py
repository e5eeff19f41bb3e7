"""One contact at one instant: its discretised problem, its force and edge, and a mesh that follows the edge.

What marching (`bem.solver.time_stepping`) needs of a state: the right-hand side of the gap equation, a selection of
nodes that resolves the state, and an equilibrium to settle on where a step cannot be taken by Newton-Raphson.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import add_rows, dot
from bem.accuracy import Controls
from bem.solver.discretisation.cohesive_zone import contact_edge
from bem.solver.discretisation.mesh import Grid, Mesh, condense, pick_nodes, resolves, wanted_spacing
from bem.solver.discretisation.transfer import transfer
from bem.solver.equilibrium import force_of
from bem.solver.instabilities import settle
from bem.solver.nonadhesive import hard_edge, solve_hard

COUNTS = (
    "iterations",
    "factorisations",
    "unknowns",
    "steps",
    "rejections",
    "fold_solves",
    "remeshings",
    "nodes",
    "unstable",
)
ITERATIONS, FACTORISATIONS, UNKNOWNS, STEPS, REJECTIONS, FOLD_SOLVES, REMESHINGS, NODES, UNSTABLE = range(9)


class Problem(NamedTuple):
    """One scene, discretised."""

    tabor: float
    hard: bool
    strengths: np.ndarray  # (m,) of the material
    times: np.ndarray  # (m,)
    controls: Controls
    grid: Grid
    fixed_mesh: bool
    force_scale: float  # below this the force counts as small, in pi R dgamma
    force_weight: float  # of its error of prediction beside that of gaps and tractions
    local_weight: float  # the same of gaps and tractions
    force_error: float  # allowed in an equilibrium, relative; far below what the prediction is judged by
    least_force: float  # no history can be more compressive
    audit: bool  # whether each accepted state is looked at again: is it stable?


@kernel
def edge_of(hard: bool, radii: np.ndarray, gap: np.ndarray, tractions: np.ndarray) -> float:
    """Contact radius, in beta; 0 where nothing touches."""
    return hard_edge(radii, tractions) if hard else contact_edge(radii, gap)


@kernel
def force_on(hard: bool, weights: np.ndarray, gap: np.ndarray, tractions: np.ndarray) -> float:
    """Force in pi R dgamma, tension positive; without adhesion there is no tail."""
    if hard:
        return dot(weights, tractions)
    return force_of(weights, tractions, gap)


@kernel
def right_side(
    tabor: float, radii: np.ndarray, master_rows: np.ndarray, depth: float, remembered: np.ndarray
) -> np.ndarray:
    """1 - delta + mu r^2 / 2 - G sigma_remembered, the known part of the gap equation; (n,)."""
    known = np.zeros(radii.size)
    if remembered.size > 0:
        add_rows(master_rows, remembered, known)
    for i in range(known.size):
        known[i] = 1.0 - depth + 0.5 * tabor * radii[i] ** 2 - known[i]
    return known


@kernel
def edge_left_window(window: np.ndarray, edge: float) -> bool:
    """Whether the mesh must follow."""
    return edge < window[0] or edge > window[1]


@kernel
def first_mesh(problem: Problem) -> Mesh:
    """The mesh to start from, before anything touches."""
    nothing = np.zeros(0)
    wanted, window = wanted_spacing(
        problem.grid,
        problem.tabor,
        problem.hard,
        0.0,
        1.0,
        np.zeros(0, dtype=np.int64),
        nothing,
        nothing,
        1.0,
        0.0,
        problem.controls,
    )
    return condense(problem.grid, problem.tabor, pick_nodes(wanted), window, problem.strengths.size > 0)


@kernel
def select_mesh(
    problem: Problem,
    old: Mesh,
    edge: float,
    direction: float,
    remembered: np.ndarray,
    response: float,
    gap: np.ndarray,
    tractions: np.ndarray,
) -> Mesh:
    """A mesh for the present edge and solution; the `old` one when that still resolves both.

    Old nodes are kept where they may: in a stiff, slowly relaxing contact every new selection stirs up tractions.
    """
    tabor, grid = problem.tabor, problem.grid
    active = 0.0
    for j in range(gap.size):
        if gap[j] < 4.0:
            active = old.radii[min(j + 1, gap.size - 1)]
    wanted, window = wanted_spacing(
        grid,
        tabor,
        problem.hard,
        edge,
        direction,
        old.nodes,
        tractions,
        remembered,
        response,
        active,
        problem.controls,
    )
    if not edge_left_window(old.window, edge) and resolves(old.nodes, wanted):
        return old
    remembers = problem.strengths.size > 0
    return condense(grid, tabor, pick_nodes(wanted), window, remembers)


@kernel
def equilibrate(
    problem: Problem,
    mesh: Mesh,
    depth: float,
    remembered: np.ndarray,
    response: float,
    gap: np.ndarray,
    tractions: np.ndarray,
    counts: np.ndarray,
) -> tuple[Mesh, np.ndarray, np.ndarray, bool]:
    """A stable equilibrium from a state that may be far from it; the mesh follows until its window holds the edge."""
    for _ in range(200):
        rhs = right_side(problem.tabor, mesh.radii, mesh.master_rows, depth, remembered)
        if problem.hard:
            solved = solve_hard(mesh.influence, rhs, response, gap, tractions, counts)
        else:
            solved = settle(
                mesh.influence, problem.tabor, rhs, response, problem.controls.residual, gap, tractions, counts
            )
        if not solved:
            return mesh, gap, tractions, False
        edge = edge_of(problem.hard, mesh.radii, gap, tractions)
        if not edge_left_window(mesh.window, edge):
            return mesh, gap, tractions, True
        new = select_mesh(problem, mesh, edge, 1.0, remembered, response, gap, tractions)
        moved_gap, moved_traction = np.empty(new.radii.size), np.empty(new.radii.size)
        transfer(mesh, gap, tractions, new, problem.tabor, problem.hard, moved_gap, moved_traction)
        mesh, gap, tractions = new, moved_gap, moved_traction
        counts[REMESHINGS] += 1
    return mesh, gap, tractions, False

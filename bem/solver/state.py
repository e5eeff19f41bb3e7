"""The contact at one instant: its state, its equilibria, and a mesh that follows its edge.

What time stepping (`bem.solver.time_stepping`) needs of a state: the right-hand side of the gap equation, a selection
of nodes that resolves the state, and an equilibrium to settle on where a step cannot be taken by Newton-Raphson.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, kernel_part
from bem._support.linear_algebra import add_rows, copy_into, dot
from bem.solver.discretisation.cohesive_zone import contact_edge, edge_width
from bem.solver.discretisation.mesh import (
    Mesh,
    condense,
    edge_window,
    grade,
    pick_nodes,
    prolong,
    refine_for_memory,
    refine_for_traction,
    resolves,
    spacing_at_edge,
)
from bem.solver.discretisation.transfer import transfer
from bem.solver.energy import stored_energy
from bem.solver.equilibrium import force_of
from bem.solver.extrapolation import Recent, start_recent
from bem.solver.hereditary import Memory, StepFactors, advance
from bem.solver.instabilities import settle
from bem.solver.nonadhesive import nonadhesive_edge, solve_nonadhesive
from bem.solver.problem import Problem
from bem.solver.work import REMESHINGS

_WIDE_GAP = 4.0  # in h0; beyond it the remembered traction need not be resolved
_MOST_MESHES = 200  # of one equilibrium


class State(NamedTuple):
    """An equilibrium."""

    mesh: Mesh
    depth: float  # indentation
    gap: np.ndarray  # (n,)
    traction: np.ndarray  # (n,)
    force: float  # in pi R dgamma, tension positive
    edge: float  # contact radius in beta; 0 where nothing touches


@kernel
def state_of(problem: Problem, mesh: Mesh, depth: float, gap: np.ndarray, traction: np.ndarray) -> State:
    """The state with this gap and traction; without adhesion there is no far field beyond the mesh."""
    if problem.nonadhesive:
        force, edge = dot(mesh.force_weights, traction), nonadhesive_edge(mesh.radii, traction)
    else:
        force, edge = force_of(mesh.force_weights, traction, gap), contact_edge(mesh.radii, gap)
    return State(mesh, depth, gap, traction, force, edge)


@kernel
def energy_of(problem: Problem, state: State) -> float:
    """Energy stored in an elastic contact."""
    mesh = state.mesh
    return stored_energy(
        mesh.radii, mesh.force_weights, problem.tabor, problem.nonadhesive, state.depth, state.gap, state.traction
    )


@kernel
def right_side(tabor: float, mesh: Mesh, depth: float, remembered: np.ndarray) -> np.ndarray:
    """1 - delta + mu r^2 / 2 - G sigma_remembered, the known part of the gap equation; (n,)."""
    known = np.zeros(mesh.radii.size)
    if remembered.size > 0:
        add_rows(mesh.master_rows, remembered, known)
    for i in range(known.size):
        known[i] = 1.0 - depth + 0.5 * tabor * mesh.radii[i] ** 2 - known[i]
    return known


@kernel_part
def edge_left_window(state: State) -> bool:
    """Whether the mesh must follow."""
    window = state.mesh.window
    return state.edge < window[0] or state.edge > window[1]


@kernel
def same_nodes(one: Mesh, other: Mesh) -> bool:
    """Whether two meshes select the same nodes of the master grid."""
    if one.nodes.size != other.nodes.size:
        return False
    different = 0
    for j in range(one.nodes.size):
        different += one.nodes[j] != other.nodes[j]
    return different == 0


@kernel_part
def first_mesh(problem: Problem) -> Mesh:
    """The mesh to start from, before anything touches."""
    controls, grid, tabor = problem.controls, problem.grid, problem.tabor
    width = edge_width(0.0, tabor, problem.nonadhesive)
    window = edge_window(0.0, 1.0, width)
    wanted = spacing_at_edge(grid, controls, 0.0, width, window)
    grade(wanted, controls.growth)
    return condense(grid, tabor, pick_nodes(wanted), window, problem.strengths.size > 0, not problem.nonadhesive)


@kernel
def select_mesh(problem: Problem, state: State, direction: float, remembered: np.ndarray, response: float) -> Mesh:
    """A mesh for a state whose edge moves outwards (`direction` > 0) or inwards; its own when that still resolves it.

    Old nodes are kept where possible: in a stiff, slowly relaxing contact every new selection perturbs the tractions.
    """
    controls, grid, tabor, old = problem.controls, problem.grid, problem.tabor, state.mesh
    last = old.nodes[0]  # the axis
    for j in range(state.gap.size):
        if state.gap[j] < _WIDE_GAP:
            last = old.nodes[min(j + 1, state.gap.size - 1)]
    width = edge_width(state.edge, tabor, problem.nonadhesive)
    window = edge_window(state.edge, direction, width)
    wanted = spacing_at_edge(grid, controls, state.edge, width, window)
    allowed = 8.0 * controls.curvature
    refine_for_memory(wanted, remembered, last, allowed * tabor, response)
    refine_for_traction(wanted, old.nodes, state.traction, tabor, allowed)
    grade(wanted, controls.growth)
    if not edge_left_window(state) and resolves(old.nodes, wanted):
        return old
    return condense(grid, tabor, pick_nodes(wanted), window, problem.strengths.size > 0, not problem.nonadhesive)


@kernel
def equilibrate(
    problem: Problem, start: State, depth: float, remembered: np.ndarray, response: float, work: np.ndarray
) -> tuple[State, bool]:
    """A stable equilibrium at `depth` from a state that may be far from it, and whether there is one.

    The mesh follows until its window holds the edge.
    """
    mesh, gap, traction = start.mesh, start.gap.copy(), start.traction.copy()
    tabor = problem.tabor
    for _ in range(_MOST_MESHES):
        rhs = right_side(tabor, mesh, depth, remembered)
        if problem.nonadhesive:
            solved = solve_nonadhesive(mesh.influence, rhs, response, gap, traction, work)
        else:
            solved = settle(mesh.influence, tabor, rhs, response, problem.controls.residual, gap, traction, work)
        state = state_of(problem, mesh, depth, gap, traction)
        if not solved or not edge_left_window(state):
            return state, solved
        new = select_mesh(problem, state, 1.0, remembered, response)
        moved_gap, moved_traction = np.empty(new.radii.size), np.empty(new.radii.size)
        transfer(mesh, gap, traction, new, tabor, problem.nonadhesive, moved_gap, moved_traction)
        mesh, gap, traction = new, moved_gap, moved_traction
        work[REMESHINGS] += 1
    return state_of(problem, mesh, depth, gap, traction), False


@kernel_part
def remember_start(memory: Memory, state: State, glassy: bool) -> None:
    """Set the memory to a state that has lasted for ever or, if `glassy`, begins at this instant."""
    if memory.strengths.size > 0:
        prolong(state.mesh, state.traction, memory.traction[0])
        if glassy:
            for i in range(memory.strengths.size):
                copy_into(memory.vectors[0, i], memory.traction[0])


@kernel_part
def remember(memory: Memory, factors: StepFactors, step: float, state: State) -> None:
    """Carry the memory to the end of an accepted step, which ends in `state`."""
    if memory.strengths.size > 0:
        on_grid = np.empty(memory.traction.shape[1])
        prolong(state.mesh, state.traction, on_grid)
        advance(memory, factors, step, on_grid)


@kernel_part
def follow_edge(
    problem: Problem, state: State, recent: Recent, direction: float, remembered: np.ndarray, response: float
) -> tuple[State, Recent, bool]:
    """The state and the recent solutions on a mesh that resolves the state, and whether that is another one."""
    old = state.mesh
    new = select_mesh(problem, state, direction, remembered, response)
    if same_nodes(new, old):
        return state, recent, False
    size = new.radii.size
    moved = start_recent(np.zeros(size), np.zeros(size), 0.0, 0.0)
    for k in range(recent.count[0]):
        transfer(
            old,
            recent.gap[k],
            recent.traction[k],
            new,
            problem.tabor,
            problem.nonadhesive,
            moved.gap[k],
            moved.traction[k],
        )
        moved.time[k], moved.force[k] = recent.time[k], recent.force[k]
    moved.count[0] = recent.count[0]
    moved_state = State(new, state.depth, moved.gap[0].copy(), moved.traction[0].copy(), state.force, state.edge)
    return moved_state, moved, True

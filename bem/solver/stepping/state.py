"""The contact at one instant: its state and its equilibria.

What time stepping (`bem.solver.stepping.time_stepping`) needs of a state: the right-hand side of the gap equation, the
state on another mesh, and an equilibrium to settle on where a step cannot be taken by Newton-Raphson.
"""

from typing import NamedTuple

import numpy as np

from bem._numerics.jit import kernel, kernel_part
from bem._numerics.linear_algebra import add_rows, copy_into, dot
from bem.solver.discretisation.cohesive_zone import contact_edge
from bem.solver.discretisation.following import carried, edge_left_window, same_grid, same_nodes, select_mesh
from bem.solver.discretisation.mesh import Mesh, prolong
from bem.solver.discretisation.transfer import transfer
from bem.solver.energy import stored_energy
from bem.solver.equilibrium import force_of
from bem.solver.hereditary import Memory, StepFactors, advance
from bem.solver.instabilities import settle
from bem.solver.machine.compliance import (
    depth_of,
    expected_depth,
    has_flown_off,
    influence_with_spring,
    right_side_with_spring,
)
from bem.solver.nonadhesive import nonadhesive_edge, solve_nonadhesive
from bem.solver.problem import Problem
from bem.solver.stepping.extrapolation import Recent, start_recent
from bem.solver.work import REMESHINGS

_MOST_MESHES = 200  # of one equilibrium


class State(NamedTuple):
    """An equilibrium."""

    mesh: Mesh
    depth: float  # indentation of the sphere
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
        force = force_of(mesh.force_weights, traction, gap, problem.law)
        edge = contact_edge(mesh.radii, gap, problem.law.peak_gap)
    return State(mesh, depth, gap, traction, force, edge)


@kernel
def state_under(
    problem: Problem,
    mesh: Mesh,
    control: float,
    remembered: np.ndarray,
    response: float,
    gap: np.ndarray,
    traction: np.ndarray,
) -> State:
    """The state with this gap and traction; `control` is what the protocol prescribes."""
    state = state_of(problem, mesh, control, gap, traction)
    if problem.machine.compliance > 0.0:
        rhs = right_side(problem.tabor, mesh, control, remembered)
        depth = depth_of(problem.machine, mesh, control, state.force, rhs, response, gap, traction)
        return State(mesh, depth, gap, traction, state.force, state.edge)
    return state


@kernel_part
def flown_off(state: State) -> State:
    """What comes after a state whose contact no longer bears the prescribed force; its indentation is NaN."""
    return State(state.mesh, np.nan, state.gap, state.traction, 0.0, 0.0)


@kernel
def influence_of(problem: Problem, mesh: Mesh, response: float, gap: np.ndarray) -> np.ndarray:
    """Influence matrix of contact and machine; `gap` (n,) is near the solution."""
    if problem.machine.compliance > 0.0:
        return influence_with_spring(
            problem.machine, mesh, problem.tabor, problem.law, problem.nonadhesive, response, gap
        )
    return mesh.influence


@kernel
def energy_of(problem: Problem, state: State) -> float:
    """Energy stored in an elastic contact."""
    mesh = state.mesh
    return stored_energy(
        mesh.radii,
        mesh.force_weights,
        problem.tabor,
        problem.law,
        problem.nonadhesive,
        state.depth,
        state.gap,
        state.traction,
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


@kernel
def _balanced(problem: Problem, state: State, control: float, remembered: np.ndarray, response: float) -> bool:
    """Whether an equilibrium behind a spring or under a force agrees with what it was linearised about."""
    if problem.machine.by_force:
        return abs(state.force - control) <= 0.1 * problem.force_error * max(abs(control), problem.scales.force)
    rhs = right_side(problem.tabor, state.mesh, 0.0, remembered)
    expected = expected_depth(state.mesh, rhs, response, state.gap, state.traction)
    return abs(state.depth - expected) <= 4.0 * problem.controls.residual


@kernel
def equilibrate(
    problem: Problem, start: State, control: float, remembered: np.ndarray, response: float, work: np.ndarray
) -> tuple[State, bool]:
    """A stable equilibrium from a state that may be far from it, and whether there is one.

    `control` is what the protocol prescribes. The mesh follows until its window holds the edge.
    """
    mesh, gap, traction = start.mesh, start.gap.copy(), start.traction.copy()
    tabor, machine, known = problem.tabor, problem.machine, remembered
    for _ in range(_MOST_MESHES):
        rhs, influence = right_side(tabor, mesh, control, known), mesh.influence
        if machine.compliance > 0.0:
            influence = influence_of(problem, mesh, response, gap)
            rhs = right_side_with_spring(
                machine, mesh, tabor, problem.law, problem.nonadhesive, control, response, rhs, gap, traction
            )
        if problem.nonadhesive:
            solved = solve_nonadhesive(influence, rhs, response, gap, traction, work)
        else:
            solved = settle(
                influence, tabor, problem.law, rhs, response, problem.controls.residual, gap, traction, work
            )
        state = state_under(problem, mesh, control, known, response, gap, traction)
        if machine.compliance > 0.0:
            if has_flown_off(machine, control, state.force, problem.scales.force):
                return state, False
            if solved and not edge_left_window(state) and not _balanced(problem, state, control, known, response):
                continue  # once more, from the better prediction
        if not solved or not edge_left_window(state):
            return state, solved
        new = select_mesh(problem, state, 1.0, known, response)
        if not same_grid(new.grid, mesh.grid):
            known = carried(remembered, start.mesh.grid, new.grid)
        moved_gap, moved_traction = np.empty(new.radii.size), np.empty(new.radii.size)
        transfer(mesh, gap, traction, new, tabor, problem.law, problem.nonadhesive, moved_gap, moved_traction)
        mesh, gap, traction = new, moved_gap, moved_traction
        work[REMESHINGS] += 1
    return state_under(problem, mesh, control, remembered, response, gap, traction), False


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
            problem.law,
            problem.nonadhesive,
            moved.gap[k],
            moved.traction[k],
        )
        moved.time[k], moved.force[k] = recent.time[k], recent.force[k]
    moved.count[0] = recent.count[0]
    moved_state = State(new, state.depth, moved.gap[0].copy(), moved.traction[0].copy(), state.force, state.edge)
    return moved_state, moved, True

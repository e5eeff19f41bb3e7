"""Jumps: the transition to the next stable equilibrium where a branch ends, at fixed indentation and memory.

Along a history of indentation a branch of equilibria can fold back; beyond the fold no time step, however small, leads
on, and the contact snaps in or off. Pseudo-transient continuation follows dh/ds = -F(h) with implicit steps in the
pseudo-time s, from which every stable equilibrium attracts. The eigenvalues of the Jacobian I + a G diag(sigma') are
real (it is similar to a symmetric matrix), a state is stable when all are positive, and a pseudo-time step is taken
only when it leaves none negative, so the path cannot settle on an unstable branch.
Source: Kelley and Keyes, SIAM J. Numer. Anal. 35 (1998) 508; Greenwood, Proc. R. Soc. A 453 (1997) 1277 on the folds of
this problem.
"""

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import copy_into, determinant_is_negative, dot, lu_factor, lu_solve
from bem.methods.boundary_elements.discrete_problem import Problem
from bem.methods.boundary_elements.equilibrium import residual_of, solve_nonadhesive
from bem.methods.boundary_elements.following import select_mesh
from bem.methods.boundary_elements.gap_equation import (
    has_flown_off,
    influence_of,
    is_balanced,
    right_side,
    rigid_side,
    state_under,
)
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width
from bem.methods.boundary_elements.meshes.master_grid import moves
from bem.methods.boundary_elements.meshes.regrid import Remembered, carried
from bem.methods.boundary_elements.state import State, edge_left_window, energy_of, transfer
from bem.methods.records import ITERATIONS, Records, count_factorisation, is_spent, with_jump, with_record
from bem.problem.tractions import Interface, slope_at, tractions_of

_MOST_STEPS = 800
_MOST_MESHES = 200  # of one equilibrium
_LARGEST_CHANGE = 0.2  # of the gap, relative, in one pseudo-time step
_SETTLED = 1e4  # pseudo-time step from which a small residual counts as an equilibrium


@kernel
def jacobian(
    interface: Interface, influence: np.ndarray, gap: np.ndarray, response: float, shift: float, out: np.ndarray
) -> None:
    """The Jacobian I (1 + shift) + a G diag(sigma') into `out`, by columns."""
    n = gap.size
    for j in range(n):
        factor = response * interface.tabor * slope_at(interface.law, gap[j])
        for i in range(n):
            out[j, i] = influence[j, i] * factor
        out[j, j] += 1.0 + shift


@kernel
def settle(
    interface: Interface,
    influence: np.ndarray,
    rhs: np.ndarray,
    response: float,
    tolerance: float,
    gap: np.ndarray,
    tractions: np.ndarray,
    work: np.ndarray,
) -> bool:
    """Follow the pseudo-transient from `gap` (n,) to a stable equilibrium; overwrites `gap` and `tractions`.

    Iterations and factorisations are added to `work` (`bem.methods.records`); returns whether an equilibrium was
    reached before its budget was used up.
    """
    n, floor = gap.size, interface.law.floor
    residual, correction = np.empty(n), np.empty(n)
    matrix, pivots = np.empty((n, n)), np.empty(n, dtype=np.int32)
    pseudo_step = 1.0
    for _ in range(_MOST_STEPS):
        if is_spent(work):
            return False
        tractions_of(interface, gap, tractions)
        residual_of(influence, gap, tractions, response, rhs, residual)
        worst, largest = np.max(np.abs(residual)), 0.0
        for _ in range(60):
            jacobian(interface, influence, gap, response, 1.0 / pseudo_step, matrix)
            lu_factor(matrix, n, pivots)
            count_factorisation(work, n)
            if determinant_is_negative(matrix, n, pivots):
                pseudo_step *= 0.3
                continue
            copy_into(correction, residual)
            lu_solve(matrix, n, pivots, correction)
            largest = 0.0
            for i in range(n):
                largest = max(largest, abs(correction[i]) * min(1.0, 3.0 / gap[i]) / (gap[i] - floor))
            if largest < _LARGEST_CHANGE or pseudo_step < 1e-6:
                break
            pseudo_step *= max(0.1, 0.5 * _LARGEST_CHANGE / largest)
        if worst < tolerance and pseudo_step >= _SETTLED:
            return True
        work[ITERATIONS] += 1
        for i in range(n):
            gap[i] = max(gap[i] - correction[i], floor + 0.05 * (gap[i] - floor))
        pseudo_step = min(pseudo_step * min(3.0, 0.5 * _LARGEST_CHANGE / max(largest, 1e-12)), 1e6)
    return False


@kernel
def equilibrate(
    problem: Problem, start: State, control: float, remembered: Remembered, work: np.ndarray
) -> tuple[State, bool]:
    """A stable equilibrium from a state that may be far from it, and whether there is one.

    `control` is what the protocol prescribes. The mesh follows until its window holds the edge.
    """
    interface, controls, response = problem.interface, problem.controls, remembered.response
    mesh, gap, traction, memory = start.mesh, start.gap.copy(), start.traction.copy(), remembered
    last_edge = start.edge
    for _ in range(_MOST_MESHES):
        if is_spent(work):
            break
        influence = influence_of(problem, mesh, response, gap)
        rigid = rigid_side(interface, mesh, control, memory)
        rhs = right_side(problem, mesh, control, response, rigid, gap, traction)
        if interface.nonadhesive:
            solved = solve_nonadhesive(influence, rhs, response, gap, traction, work)
        else:
            solved = settle(interface, influence, rhs, response, controls.residual, gap, traction, work)
        state = state_under(problem, mesh, control, memory, gap, traction)
        if has_flown_off(problem, control, state.force):
            return state, False
        left = edge_left_window(state)
        if solved and not left and problem.device.compliance > 0.0 and not is_balanced(problem, state, control, memory):
            continue  # once more, from the better prediction
        width = edge_width(state.edge, interface.tabor, interface.exponent)
        # Other nodes may move the edge of a stiff solid by as much, to and fro.
        if not solved or not left or (moves(mesh.grid) and abs(state.edge - last_edge) < width):
            return state, solved
        last_edge = state.edge
        new = select_mesh(interface, controls, problem.scheme, state, 1.0, memory)
        memory = carried(remembered, start.mesh.grid, new.grid)
        moved_gap, moved_traction = np.empty(new.radii.size), np.empty(new.radii.size)
        transfer(interface, mesh, gap, traction, new, moved_gap, moved_traction)
        mesh, gap, traction = new, moved_gap, moved_traction
    return state_under(problem, mesh, control, memory, gap, traction), False


@kernel
def separated(
    problem: Problem, start: State, control: float, remembered: Remembered, work: np.ndarray
) -> tuple[State, bool]:
    """The equilibrium of surfaces that have come apart, where they would be apart without traction, and whether it is.

    Below its fold a contact that is pulled has no other one: the smaller it gets, the more it is pulled.
    """
    gap = rigid_side(problem.interface, start.mesh, control, remembered)
    if problem.interface.nonadhesive or start.force <= 0.0 or np.min(gap) <= 2.0 * problem.interface.law.peak_gap:
        return start, False
    open_state = State(start.mesh, start.depth, gap, np.zeros(gap.size), 0.0, 0.0)
    return equilibrate(problem, open_state, control, remembered, work)


@kernel
def record_jump(
    problem: Problem, records: Records, time: float, before: State, after: State, response: float
) -> Records:
    """The records with one more jump: the eigenvalues on both sides and the energy it loses.

    A state as `before` is added where it would be with stage or force of the state `after`. The indentation after the
    jump is NaN where the sphere has flown off.
    """
    interface, device, depth = problem.interface, problem.device, after.depth
    eigenvalue_before, eigenvalue_after, lost = 0.0, np.nan, np.nan
    scale = 1.0
    if device.compliance > 0.0:
        depth = before.depth if device.by_force else depth + device.compliance * (before.force - after.force)
        # A soft spring multiplies the eigenvalue of the sphere's motion.
        scale += device.compliance * problem.scales.force / device.depth_scale
    if not interface.nonadhesive:
        influence = influence_of(problem, before.mesh, response, before.gap)
        eigenvalue_before = smallest_eigenvalue(interface, influence, before.gap, response) / scale
    if not np.isnan(after.depth):
        influence = influence_of(problem, after.mesh, response, after.gap)
        eigenvalue_after = smallest_eigenvalue(interface, influence, after.gap, response) / scale
    if problem.strengths.size == 0:
        work_done = -before.force * (after.depth - before.depth)
        lost = energy_of(interface, before) + work_done - energy_of(interface, after)
        if not device.by_force:  # what of the spring's energy went into the contact counts as work
            lost -= 0.5 * device.compliance * (after.force - before.force) ** 2
    records = with_record(records, time, depth, before.force, before.edge)
    eigenvalues = (eigenvalue_before, eigenvalue_after)
    return with_jump(records, time, depth, (before.force, after.force), eigenvalues, lost, after.depth)


@kernel
def is_unstable(interface: Interface, influence: np.ndarray, gap: np.ndarray, response: float) -> bool:
    """Whether an odd number of eigenvalues of the Jacobian is negative, by a factorisation of its own."""
    n = gap.size
    columns, pivots = np.empty((n, n)), np.empty(n, dtype=np.int32)
    jacobian(interface, influence, gap, response, 0.0, columns)
    lu_factor(columns, n, pivots)
    return determinant_is_negative(columns, n, pivots)


@kernel
def smallest_eigenvalue(interface: Interface, influence: np.ndarray, gap: np.ndarray, response: float) -> float:
    """Eigenvalue of the Jacobian nearest to zero, by inverse iteration: zero at a fold, positive when stable."""
    n = gap.size
    matrix, pivots = np.empty((n, n)), np.empty(n, dtype=np.int32)
    jacobian(interface, influence, gap, response, 0.0, matrix)
    lu_factor(matrix, n, pivots)
    vector = np.ones(n) / np.sqrt(n)
    value = 0.0
    for _ in range(60):
        image = vector.copy()
        lu_solve(matrix, n, pivots, image)
        inverse = dot(vector, image)
        norm = np.sqrt(dot(image, image))
        for i in range(n):
            vector[i] = image[i] / norm
        converged = abs(1.0 / inverse - value) < 1e-6 * abs(value)
        value = 1.0 / inverse
        if converged:
            break
    return value

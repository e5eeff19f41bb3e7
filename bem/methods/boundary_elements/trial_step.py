"""One trial of a time step: predict, solve, and judge whether the step was short enough."""

import numpy as np

from bem._support.jit import kernel
from bem.methods.boundary_elements.discrete_problem import Problem
from bem.methods.boundary_elements.equilibrium import Factor, factorise, new_factor, solve_adhesive, solve_nonadhesive
from bem.methods.boundary_elements.extrapolation import (
    CONTROL,
    DEPTH,
    Recent,
    bend_of_force,
    expected_force,
    history_error,
    predict,
    prediction_error,
)
from bem.methods.boundary_elements.gap_equation import depth_error, expected_depth, influence_of, right_side, rigid_side
from bem.methods.boundary_elements.jumps import is_unstable
from bem.methods.boundary_elements.meshes.regrid import Remembered
from bem.methods.boundary_elements.state import State, state_of
from bem.methods.records import ITERATIONS, MULTIPLY_ADDS, count_factorisation
from bem.problem.tractions import force_of

_STALE_AFTER = 8  # iterations in one step after which the kept factorisation is dropped
_MOST_DEPTHS = 10  # tried until the prescribed force is met
_BEND = 0.05  # change of the force's course in one step, over the force, from which its history is checked


@kernel
def try_step(
    problem: Problem,
    state: State,
    recent: Recent,
    factor: Factor,
    time: float,
    control: float,
    remembered: Remembered,
    can_shrink: bool,
    shortened: bool,
    work: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, bool, float]:
    """Solve the equilibrium at the end of a step.

    Args:
        problem: the scene, discretised.
        state: at the beginning of the step.
        recent: the last solutions.
        factor: kept factorisation.
        time: at the end of the step, counted as those of `recent`.
        control: what the protocol prescribes there: the indentation, or the displacement of the stage, or the force.
        remembered: what the material contributes.
        can_shrink: whether a shorter step may be tried; otherwise every solution is accepted.
        shortened: whether a longer step failed, as before a fold: the stability of the solution is judged anew
            then. Behind a spring it always is.
        work: counts as in `bem.methods.records`, added to.

    Returns:
        gap and traction (n,); whether they are a solution and accepted; and the factor by which to change the step.
    """
    interface, device, controls = problem.interface, problem.device, problem.controls
    mesh, response, weights = state.mesh, remembered.response, state.mesh.force_weights
    work[MULTIPLY_ADDS] += 20_000 + (mesh.radii.size + 200) * remembered.traction.size
    rigid = rigid_side(interface, mesh, control, remembered)
    guess_gap, guess_traction = np.empty(rigid.size), np.empty(rigid.size)
    predict(interface, recent, time, guess_gap, guess_traction, CONTROL, True)
    gap, traction = guess_gap.copy(), guess_traction.copy()
    if not interface.nonadhesive:
        predict(interface, recent, time, gap, traction, DEPTH, False)
    influence = influence_of(problem, mesh, response, gap)
    rhs = right_side(problem, mesh, control, response, rigid, gap, traction)
    if interface.nonadhesive:
        solved = solve_nonadhesive(influence, rhs, response, gap, traction, work)
    else:
        before = work[ITERATIONS]
        # a stiff response turns a small residual into a large traction
        residual = controls.residual * min(1.0, 10.0 * response)
        force_error = problem.force_error * max(abs(state.force), problem.scales.force)
        solved = solve_adhesive(
            interface, influence, weights, rhs, response, residual, force_error, factor, gap, traction, work
        )
        if not solved and device.by_force:
            predict(interface, recent, time, gap, traction, DEPTH, False)
            depth = expected_depth(mesh, rigid + control, response, guess_gap, guess_traction)
            solved = _solve_by_depth(problem, state, control, rigid + control, depth, response, gap, traction, work)
            factor.order[0] = 0
        if solved and shortened:
            factorise(interface, influence, weights, gap, response, factor, work)
            solved = not factor.unstable[0]
        if solved and device.compliance > 0.0:  # it is linearised anew in each step
            count_factorisation(work, rhs.size)
            solved = not is_unstable(interface, influence_of(problem, mesh, response, gap), gap, response)
        if not solved or work[ITERATIONS] - before >= _STALE_AFTER:
            factor.order[0] = 0
    if not solved:
        return gap, traction, False, 0.25
    order, scales = min(recent.count[0], CONTROL), problem.scales
    predicted_force = np.nan if problem.strengths.size > 0 or interface.nonadhesive else expected_force(recent, time)
    error = prediction_error(interface, weights, guess_gap, guess_traction, gap, traction, scales, predicted_force)
    accepted, shrink = _verdict(error, controls.prediction, order, can_shrink)
    if accepted and can_shrink and order >= 2 and not interface.nonadhesive:
        force = force_of(interface, weights, gap, traction)
        bends = bend_of_force(recent, time, force) > _BEND * max(abs(force), scales.force)
        if bends and history_error(interface, recent, weights, time, force, scales) > 0.5 * controls.prediction:
            accepted, shrink = False, 0.5
    if device.compliance > 0.0 and accepted:
        free = rigid + control
        predicted = expected_depth(mesh, free, response, guess_gap, guess_traction)
        solved_for = expected_depth(mesh, free, response, gap, traction)
        if not device.by_force:  # the stage is known, so that only the force need be predicted
            solved_for = control + device.compliance * state_of(interface, mesh, control, gap, traction).force
            predicted = control + device.compliance * expected_force(recent, time)
        error = scales.force_weight * depth_error(device, predicted, solved_for)
        accepted, by_depth = _verdict(error, controls.prediction, order, can_shrink)
        shrink = min(shrink, by_depth) if accepted else by_depth
    return gap, traction, accepted, shrink


@kernel
def _solve_by_depth(
    problem: Problem,
    state: State,
    prescribed: float,
    free: np.ndarray,
    depth: float,
    response: float,
    gap: np.ndarray,
    traction: np.ndarray,
    work: np.ndarray,
) -> bool:
    """Solve at one indentation after another, by the secant method from `depth`, until the force is the prescribed one.

    Slower than contact and numerical spring as a whole; but that spring is so soft that a node which passes a corner of
    the traction law may throw the iteration out. Overwrites the predicted `gap` and `traction` (n,). `free` (n,) is the
    `rigid_side` at indentation zero. The stability under the force is not judged.

    Returns:
        whether a solution was found.
    """
    interface, mesh, weights = problem.interface, state.mesh, state.mesh.force_weights
    residual, factor = problem.controls.residual * min(1.0, 10.0 * response), new_factor(gap.size)
    force_error = problem.force_error * max(abs(state.force), problem.scales.force)
    last_depth, last_miss = np.nan, np.nan
    for _ in range(_MOST_DEPTHS):
        rhs = free - depth
        if not solve_adhesive(
            interface, mesh.influence, weights, rhs, response, residual, force_error, factor, gap, traction, work
        ):
            return False
        miss = force_of(interface, weights, gap, traction) - prescribed
        if abs(miss) <= 0.1 * force_error:
            return True
        slope = (miss - last_miss) / (depth - last_depth)
        if np.isnan(slope):
            slope = -factor.stiffness[0]  # a deeper sphere is pressed harder
        last_depth, last_miss = depth, miss
        depth -= miss / slope
    return False


@kernel
def _verdict(error: float, allowed: float, order: int, can_shrink: bool) -> tuple[bool, float]:
    """Whether an error of the prediction is accepted, and the factor by which to change the step."""
    shrink = 0.9 * (allowed / max(error, 1e-12)) ** (1.0 / order)
    if can_shrink and error > 2.0 * allowed:
        return False, max(0.2, min(0.8, shrink))
    return True, shrink

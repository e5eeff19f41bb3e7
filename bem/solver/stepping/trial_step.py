"""One trial of a time step: predict, solve, and judge whether the step was short enough."""

import numpy as np

from bem._numerics.jit import kernel_part
from bem.solver.equilibrium import Factor, factorise, force_of, solve_adhesive
from bem.solver.instabilities import is_unstable
from bem.solver.machine.compliance import depth_error, expected_depth, right_side_with_spring
from bem.solver.nonadhesive import solve_nonadhesive
from bem.solver.problem import Problem
from bem.solver.stepping.extrapolation import (
    CONTROL,
    DEPTH,
    Recent,
    bend_of_force,
    expected_force,
    history_error,
    predict,
    prediction_error,
)
from bem.solver.stepping.state import State, influence_of, right_side, state_of
from bem.solver.work import FACTORISATIONS, ITERATIONS

_STALE_AFTER = 8  # iterations in one step after which the kept factorisation is dropped
_BEND = 0.05  # change of the force's course in one step, over the force, from which its history is checked


@kernel_part
def try_step(
    problem: Problem,
    state: State,
    recent: Recent,
    factor: Factor,
    time: float,
    control: float,
    remembered: np.ndarray,
    response: float,
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
        remembered, response: what the material contributes, from `bem.solver.hereditary`.
        can_shrink: whether a shorter step may be tried; otherwise every solution is accepted.
        shortened: whether a longer step failed, as before a fold: the stability of the solution is judged anew
            then. Behind a spring it always is.
        work: counts as in `bem.solver.work`, added to.

    Returns:
        gap and traction (n,); whether they are a solution and accepted; and the factor by which to change the step.
    """
    tabor, law, mesh = problem.tabor, problem.law, state.mesh
    rigid, influence = right_side(tabor, mesh, control, remembered), mesh.influence
    rhs = rigid
    guess_gap, guess_traction = np.empty(rhs.size), np.empty(rhs.size)
    predict(recent, time, tabor, law, problem.nonadhesive, guess_gap, guess_traction, CONTROL, True)
    gap, traction = guess_gap.copy(), guess_traction.copy()
    if not problem.nonadhesive:
        predict(recent, time, tabor, law, False, gap, traction, DEPTH, False)
    if problem.machine.compliance > 0.0:
        influence = influence_of(problem, mesh, response, gap)
        rhs = right_side_with_spring(
            problem.machine, mesh, tabor, law, problem.nonadhesive, control, response, rigid, gap, traction
        )
    if problem.nonadhesive:
        solved = solve_nonadhesive(influence, rhs, response, gap, traction, work)
    else:
        before = work[ITERATIONS]
        solved = solve_adhesive(
            influence,
            mesh.force_weights,
            tabor,
            law,
            rhs,
            response,
            # a stiff response turns a small residual into a large traction
            problem.controls.residual * min(1.0, 10.0 * response),
            problem.force_error * max(abs(state.force), problem.scales.force),
            factor,
            gap,
            traction,
            work,
        )
        if solved and shortened:
            factorise(influence, mesh.force_weights, gap, tabor, law, response, factor)
            work[FACTORISATIONS] += 1
            solved = not factor.unstable[0]
        if solved and problem.machine.compliance > 0.0:  # it is linearised anew in each step
            solved = not is_unstable(influence_of(problem, mesh, response, gap), tabor, law, response, gap)
        if not solved or work[ITERATIONS] - before >= _STALE_AFTER:
            factor.order[0] = 0
    if not solved:
        return gap, traction, False, 0.25
    accepted, shrink = _judge(problem, state, recent, guess_gap, guess_traction, time, gap, traction, can_shrink)
    if problem.machine.compliance > 0.0 and accepted:
        free = rigid + control
        predicted = expected_depth(mesh, free, response, guess_gap, guess_traction)
        found = expected_depth(mesh, free, response, gap, traction)
        if not problem.machine.by_force:  # the stage is known, so that only the force need be predicted
            found = control + problem.machine.compliance * state_of(problem, mesh, control, gap, traction).force
            predicted = control + problem.machine.compliance * expected_force(recent, time)
        error = problem.scales.force_weight * depth_error(problem.machine, predicted, found)
        accepted, by_depth = _verdict(error, problem.controls.prediction, min(recent.count[0], CONTROL), can_shrink)
        shrink = min(shrink, by_depth) if accepted else by_depth
    return gap, traction, accepted, shrink


@kernel_part
def _verdict(error: float, allowed: float, order: int, can_shrink: bool) -> tuple[bool, float]:
    """Whether an error of the prediction is accepted, and the factor by which to change the step."""
    shrink = 0.9 * (allowed / max(error, 1e-12)) ** (1.0 / order)
    if can_shrink and error > 2.0 * allowed:
        return False, max(0.2, min(0.8, shrink))
    return True, shrink


@kernel_part
def _judge(
    problem: Problem,
    state: State,
    recent: Recent,
    guess_gap: np.ndarray,
    guess_traction: np.ndarray,
    time: float,
    gap: np.ndarray,
    traction: np.ndarray,
    can_shrink: bool,
) -> tuple[bool, float]:
    """Whether a solution is near enough to its prediction, and the factor by which to change the step."""
    tabor, law, nonadhesive, weights = problem.tabor, problem.law, problem.nonadhesive, state.mesh.force_weights
    allowed, order = problem.controls.prediction, min(recent.count[0], CONTROL)
    expected = np.nan if problem.strengths.size > 0 or nonadhesive else expected_force(recent, time)
    error = prediction_error(
        weights, tabor, law, nonadhesive, guess_gap, guess_traction, gap, traction, problem.scales, expected
    )
    accepted, shrink = _verdict(error, allowed, order, can_shrink)
    if not accepted:
        return False, shrink
    if can_shrink and order >= 2 and not nonadhesive:
        force = force_of(weights, traction, gap, law)
        if bend_of_force(recent, time, force) > _BEND * max(abs(force), problem.scales.force):
            error = history_error(recent, weights, tabor, law, nonadhesive, time, force, problem.scales)
            if error > 0.5 * allowed:
                return False, 0.5
    return True, shrink

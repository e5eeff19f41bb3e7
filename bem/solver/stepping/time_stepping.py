"""Time stepping: predict, solve, judge, accept; follow the edge with the mesh; jump where a branch ends.

Each step solves one equilibrium at the new indentation with the remembered traction of the old ones. Its length follows
from the difference of prediction and solution. A step that fails at the smallest useful length stands at a fold: the
contact then settles on the next stable branch, and the trajectory records the jump. Times inside are counted from the
start of each protocol segment, so that long dwells cost no digits.
"""

from typing import NamedTuple

import numpy as np

from bem._numerics.interruption import asked_to_stop
from bem._numerics.jit import kernel, kernel_part
from bem.solver.discretisation.cohesive_zone import edge_width
from bem.solver.discretisation.following import carried, edge_left_window, first_mesh, same_grid, same_nodes
from bem.solver.discretisation.master_grid import moves
from bem.solver.discretisation.mesh import Mesh
from bem.solver.discretisation.regrid import same_places
from bem.solver.equilibrium import Factor, new_factor
from bem.solver.hereditary import (
    Memory,
    forget_rate,
    memory_on,
    new_memory,
    remembered_traction,
    shortest_relaxation,
    step_factors,
)
from bem.solver.instabilities import is_unstable
from bem.solver.machine.compliance import has_flown_off
from bem.solver.problem import Problem
from bem.solver.stepping.course import Course, new_course, with_jump, with_record
from bem.solver.stepping.extrapolation import push_recent, start_recent
from bem.solver.stepping.state import (
    State,
    energy_of,
    equilibrate,
    flown_off,
    follow_edge,
    influence_of,
    remember,
    remember_start,
    state_under,
)
from bem.solver.stepping.trial_step import try_step
from bem.solver.work import FOLD_SOLVES, NODES, REJECTIONS, REMESHINGS, STEPS, UNSTABLE, new_work

COMPLETED, NO_EQUILIBRIUM, TOO_MANY_STEPS, UNPHYSICAL, DETACHED, INTERRUPTED = 0, 1, 2, 3, 4, 5

_CHECK_MESH_EVERY = 40  # steps
_STIFF_RESPONSE = 0.02  # below, nodes are chosen anew only where the edge has left its window
_JUMP_IN_FORCE, _JUMP_IN_WIDTHS = 0.02, 0.3


class Marched(NamedTuple):
    """What `march` returns."""

    records: np.ndarray  # (n, 4): time, indentation, force, contact radius
    jumps: np.ndarray  # (j, 8): the fields of `bem.trajectory.Jump`; the energy lost is NaN where there is memory
    work: np.ndarray  # as named in `bem.solver.work`
    segment_steps: np.ndarray  # (s - 1,) int64: steps of each segment
    energies: np.ndarray  # (2,): stored at the beginning and at the end
    outcome: int  # COMPLETED, NO_EQUILIBRIUM, TOO_MANY_STEPS, UNPHYSICAL, DETACHED or INTERRUPTED


class Segment(NamedTuple):
    """A part of the protocol, in which what it prescribes is linear in time, and the steps it allows."""

    begin: float
    end: float
    first_control: float
    last_control: float
    duration: float
    rate: float
    first: float  # length of the first step
    smallest: float  # below, a step changes neither indentation nor memory enough to matter: failure there is a fold
    longest: float


@kernel_part
def _segment(problem: Problem, times: np.ndarray, controls: np.ndarray, index: int) -> Segment:
    duration = times[index + 1] - times[index]
    rate = (controls[index + 1] - controls[index]) / duration
    speed = abs(rate) * problem.machine.travel
    relaxation = shortest_relaxation(problem.strengths, problem.times)
    longest = problem.controls.longest_step * duration
    if speed == 0.0 and problem.strengths.size == 0:
        longest = duration  # nothing happens
    smallest, first = 1e-3 * relaxation, 1e-2 * relaxation
    if speed > 0.0:
        # a stiff solid detaches over a shorter distance
        smallest = min(smallest, problem.controls.fold_increment * 2.0 / (problem.scales.force_weight * speed))
        first = min(first, 0.02 / speed)
    smallest = min(max(smallest, 1e-13 * duration), longest)
    first = max(min(first, longest), smallest)
    return Segment(
        times[index], times[index + 1], controls[index], controls[index + 1], duration, rate, first, smallest, longest
    )


@kernel_part
def _within(step: float, now: float, duration: float) -> tuple[float, float]:
    """Shorten a step to meet the end of the segment without leaving a tiny one; return it and the time after it."""
    if now + 1.0000001 * step >= duration:
        return duration - now, duration
    if now + 2.0 * step > duration:
        step = 0.5 * (duration - now)
    return step, now + step


@kernel_part
def _first_state(problem: Problem, mesh: Mesh, control: float, glassy: bool, work: np.ndarray) -> tuple[State, bool]:
    """The equilibrium from which the protocol starts, and whether there is one."""
    if not problem.fixed_mesh:
        mesh = first_mesh(problem)
    depth = control
    if problem.machine.by_force:  # that of Hertz, in contact
        depth = problem.tabor * (0.75 * np.pi * max(-control, 0.0)) ** (2.0 / 3.0)
    gap = np.empty(mesh.radii.size)
    for i in range(gap.size):
        gap[i] = max(1.0 - depth + 0.5 * problem.tabor * mesh.radii[i] ** 2, 1.0 if problem.nonadhesive else 0.95)
    start = State(mesh, depth, gap, np.zeros(gap.size), 0.0, 0.0)
    nothing = np.zeros(mesh.grid.size if problem.strengths.size > 0 else 0)
    response = 1.0 - np.sum(problem.strengths) if glassy else 1.0
    return equilibrate(problem, start, control, nothing, response, work)


@kernel_part
def _jumped(problem: Problem, before: State, after: State) -> bool:
    """Whether the contact changed to another branch."""
    width = edge_width(before.edge, problem.tabor, problem.nonadhesive)
    force = abs(after.force - before.force) > _JUMP_IN_FORCE * max(abs(before.force), problem.scales.force)
    return force or abs(after.edge - before.edge) > _JUMP_IN_WIDTHS * width


@kernel_part
def _follow(
    problem: Problem,
    segment: Segment,
    state: State,
    memory: Memory,
    factor: Factor,
    course: Course,
    mesh_chosen: int,
    most_steps: int,
    signals: np.ndarray,
    work: np.ndarray,
) -> tuple[State, Memory, Factor, Course, int, int]:
    """Follow one segment of the protocol; `mesh_chosen` is the step at which nodes were chosen last."""
    recent = start_recent(state.gap, state.traction, 0.0, state.force)
    forget_rate(memory)
    tabor, smallest = problem.tabor, segment.smallest
    step, now, shortened = segment.first, 0.0, False
    while now < segment.duration:
        if course.filled[0] >= most_steps:
            return state, memory, factor, course, mesh_chosen, TOO_MANY_STEPS
        if asked_to_stop(signals):
            return state, memory, factor, course, mesh_chosen, INTERRUPTED
        step, after = _within(step, now, segment.duration)
        at_end = after == segment.duration
        control = segment.last_control if at_end else segment.first_control + segment.rate * after
        instant = segment.end if at_end else segment.begin + after

        factors = step_factors(memory, step, recent.count[0] >= 2)
        remembered = remembered_traction(memory, factors)
        can_shrink = step > 1.01 * smallest
        gap, traction, accepted, shrink = try_step(
            problem, state, recent, factor, after, control, remembered, factors.response, can_shrink, shortened, work
        )
        if not accepted and can_shrink:
            work[REJECTIONS] += 1
            step, shortened = max(shrink * step, smallest), True
            continue

        before, another_branch, shortened = state, False, False
        if accepted:
            state = state_under(problem, before.mesh, control, remembered, factors.response, gap, traction)
        else:
            work[FOLD_SOLVES] += 1
            forget_rate(memory)
            factors = step_factors(memory, step, recent.count[0] >= 2)
            remembered = remembered_traction(memory, factors)
            state, solved = equilibrate(problem, before, control, remembered, factors.response, work)
            if not solved and not has_flown_off(problem.machine, control, state.force, problem.scales.force):
                return before, memory, factor, course, mesh_chosen, NO_EQUILIBRIUM
            another_branch = _jumped(problem, before, state)
            factor = new_factor(state.gap.size)
            shrink = 1.0
        if has_flown_off(problem.machine, control, state.force, problem.scales.force):
            course = with_jump(problem, course, instant, before, flown_off(before), factors.response)
            return before, memory, factor, course, mesh_chosen, DETACHED
        if not state.force >= problem.least_force:
            return before, memory, factor, course, mesh_chosen, UNPHYSICAL
        if not accepted and not same_grid(state.mesh.grid, before.mesh.grid):
            remembered = carried(remembered, before.mesh.grid, state.mesh.grid)
            memory = memory_on(memory, before.mesh.grid.places, state.mesh.grid.places)
        remember(memory, factors, step, state)
        now = after

        if another_branch:
            course = with_jump(problem, course, instant, before, state, factors.response)
        course = with_record(course, instant, state.depth, state.force, state.edge)
        work[STEPS] += 1
        work[NODES] += state.gap.size
        if problem.audit and not problem.nonadhesive:
            influence = influence_of(problem, state.mesh, factors.response, state.gap)
            work[UNSTABLE] += is_unstable(influence, tabor, problem.law, factors.response, state.gap)
        if another_branch or not same_nodes(state.mesh, before.mesh):
            # Solutions on another branch or on other nodes cannot be extrapolated.
            recent = start_recent(state.gap, state.traction, now, state.force)
            forget_rate(memory)
            step = 2.0 * smallest
        else:
            push_recent(recent, state.gap, state.traction, now, state.force)
            step = min(max(step * min(max(shrink, 0.3), 2.5), smallest), segment.longest)

        # With a stiff response a new selection of nodes perturbs the tractions strongly.
        routine = work[STEPS] - mesh_chosen >= _CHECK_MESH_EVERY and factors.response > _STIFF_RESPONSE
        if edge_left_window(state) or (routine and not problem.fixed_mesh):
            direction = 1.0 if state.edge >= before.edge else -1.0
            mesh_chosen = work[STEPS]
            places = state.mesh.grid.places
            state, recent, moved = follow_edge(problem, state, recent, direction, remembered, factors.response)
            if moved:
                if moves(state.mesh.grid) and not same_places(places, state.mesh.grid.places):
                    memory = memory_on(memory, places, state.mesh.grid.places)
                factor = new_factor(state.gap.size)
                work[REMESHINGS] += 1
    return state, memory, factor, course, mesh_chosen, COMPLETED


@kernel
def march(
    problem: Problem,
    mesh: Mesh,
    times: np.ndarray,
    controls: np.ndarray,
    glassy: bool,
    most_steps: int,
    signals: np.ndarray,
) -> Marched:
    """Follow the history that a protocol prescribes (`times`, `controls`), linear between its s instants.

    Args:
        problem: the scene, discretised.
        mesh: the user's own; otherwise ignored.
        times, controls: (s,) the protocol: indentations (of the stage, where there is a spring), or forces.
        glassy: whether the surfaces meet at once (instantaneous modulus) rather than fully relaxed.
        most_steps: give up after this many.
        signals: uint8, those that arrive meanwhile (`bem._numerics.interruption`); each step looks at them.
    """
    work, course = new_work(), new_course()
    segment_steps = np.zeros(times.size - 1, dtype=np.int64)
    energies = np.zeros(2)
    state, solved = _first_state(problem, mesh, controls[0], glassy, work)
    gone = has_flown_off(problem.machine, controls[0], state.force, problem.scales.force)
    outcome = DETACHED if gone else NO_EQUILIBRIUM
    if solved:
        outcome = COMPLETED
        memory = new_memory(problem.strengths, problem.times, state.mesh.grid.size)
        remember_start(memory, state, glassy)
        course = with_record(course, times[0], state.depth, state.force, state.edge)
        energies[0] = energy_of(problem, state)
        factor = new_factor(state.gap.size)
        mesh_chosen = 0
        for k in range(segment_steps.size):
            steps = work[STEPS]
            segment = _segment(problem, times, controls, k)
            state, memory, factor, course, mesh_chosen, outcome = _follow(
                problem, segment, state, memory, factor, course, mesh_chosen, most_steps, signals, work
            )
            segment_steps[k] = work[STEPS] - steps
            if outcome != COMPLETED:
                break
        if outcome == COMPLETED:
            energies[1] = energy_of(problem, state)
    records, jumps = course.records[: course.filled[0]], course.jumps[: course.filled[1]]
    return Marched(records, jumps, work, segment_steps, energies, outcome)

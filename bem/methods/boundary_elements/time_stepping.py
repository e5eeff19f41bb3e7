"""Steps along one segment of a protocol: predict, solve, judge; follow the edge with the mesh; jump at a fold.

Each step solves one equilibrium at the new indentation with the remembered traction of the old ones. Its length follows
from the difference of prediction and solution. A step that fails at the smallest useful length stands at a fold: the
contact then settles on the next stable branch, and the trajectory records the jump. Times inside are counted from the
start of each protocol segment, so that long dwells cost no digits.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.boundary_elements.discrete_problem import Problem
from bem.methods.boundary_elements.equilibrium import Factor, new_factor
from bem.methods.boundary_elements.extrapolation import Recent, push_recent, recent_on, start_recent
from bem.methods.boundary_elements.following import same_nodes, select_mesh
from bem.methods.boundary_elements.gap_equation import has_flown_off, influence_of, state_under
from bem.methods.boundary_elements.jumps import equilibrate, is_unstable, record_jump, separated
from bem.methods.boundary_elements.memory import (
    Memory,
    forget_rate,
    memory_on,
    remember,
    remembered_in,
    shortest_relaxation,
    step_factors,
)
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width, zone_width
from bem.methods.boundary_elements.meshes.master_grid import moves
from bem.methods.boundary_elements.meshes.regrid import Remembered, carried
from bem.methods.boundary_elements.state import State, edge_left_window, with_profile
from bem.methods.boundary_elements.trial_step import try_step
from bem.methods.outcomes import COMPLETED, DETACHED, NO_EQUILIBRIUM, OUT_OF_WORK, PAUSED, UNPHYSICAL, Outcome
from bem.methods.records import NODES, REJECTIONS, STEPS, UNSTABLE, Records, is_spent, is_to_pause, with_record

_CHECK_MESH_EVERY = 40  # steps
_STIFF_RESPONSE = 0.02  # below, nodes are chosen anew only where the edge has left its window
_FAINT = 0.2  # force between surfaces that are apart, over its scale, below which a dent fades as if alone
_LETS_GO = 0.5  # of the contact radius, below which a contact without equilibrium has let go
_JUMP_IN_FORCE, _JUMP_IN_WIDTHS = 0.02, 0.3


class Stepping(NamedTuple):
    """How far one segment of a protocol has been followed."""

    recent: Recent
    now: float
    step: float  # length of the next
    shortened: bool  # whether a longer step failed
    other_nodes: bool  # whether nodes were chosen after the last step


class Progress(NamedTuple):
    """How far a contact has been followed, and what the next step starts from."""

    state: State
    memory: Memory
    factor: Factor  # kept from the last step
    records: Records
    mesh_chosen: int  # the step at which nodes were chosen last
    outcome: Outcome  # COMPLETED so far, or why it ended; PAUSED within a segment
    segment: int  # the next; -1 before the start
    stepping: Stepping  # in this one, where it is PAUSED


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
    returns: bool  # whether surfaces that are apart may come together again
    index: int


class EndOfStep(NamedTuple):
    """Where a step ends."""

    step: float  # its length
    time: float  # in the segment
    instant: float  # in the protocol
    control: float  # what the protocol prescribes


@kernel
def segment_of(problem: Problem, times: np.ndarray, controls: np.ndarray, index: int, last_rise: int) -> Segment:
    """The segment number `index` of a protocol (`times`, `controls`), and the steps that it allows.

    `last_rise` is the last segment in which what is prescribed rises.
    """
    duration = times[index + 1] - times[index]
    rate = (controls[index + 1] - controls[index]) / duration
    speed = abs(rate) * problem.device.travel
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
    begin, end, returns = times[index], times[index + 1], 0 < index <= last_rise
    return Segment(
        begin, end, controls[index], controls[index + 1], duration, rate, first, smallest, longest, returns, index
    )


@kernel
def _jumped(problem: Problem, before: State, after: State) -> bool:
    """Whether the contact changed to another branch."""
    if problem.interface.nonadhesive:
        return False
    width = edge_width(before.edge, problem.interface.tabor, problem.interface.exponent)
    if moves(before.mesh.grid):
        width = zone_width(width, before.edge, before.mesh.radii, before.gap, problem.interface.law.peak_gap)
    force = abs(after.force - before.force) > _JUMP_IN_FORCE * max(abs(before.force), problem.scales.force)
    return force or abs(after.edge - before.edge) > _JUMP_IN_WIDTHS * width


@kernel
def _end_of_step(segment: Segment, now: float, step: float, next_profile: float) -> EndOfStep:
    """The end of a step from `now` on, which meets the instant of a profile without leaving a tiny step before it."""
    until = min(next_profile - segment.begin, segment.duration)
    after = now + step
    if now + 1.0000001 * step >= until:
        step, after = until - now, until
    elif now + 2.0 * step > until:
        step = 0.5 * (until - now)
        after = now + step
    if after == segment.duration:
        return EndOfStep(step, after, segment.end, segment.last_control)
    return EndOfStep(step, after, segment.begin + after, segment.first_control + segment.rate * after)


@kernel
def _beyond_fold(
    problem: Problem, before: State, control: float, remembered: Remembered, work: np.ndarray
) -> tuple[State, bool]:
    """The state on which a contact settles that no step is short enough for, and whether it is an equilibrium."""
    state, solved = equilibrate(problem, before, control, remembered, work)
    # An edge that is still near has not let go: there is a state that the mesh does not resolve.
    stays = moves(before.mesh.grid) and state.edge > _LETS_GO * before.edge
    if not solved and not stays and not problem.device.by_force:
        state, solved = separated(problem, before, control, remembered, work)
    return state, solved


@kernel
def _with_state(
    problem: Problem,
    segment: Segment,
    end: EndOfStep,
    state: State,
    response: float,
    profiles: np.ndarray,
    records: Records,
    work: np.ndarray,
) -> Records:
    """The records with the state at the end of a step, which is counted, and with its profiles where those are due."""
    records = with_record(records, end.instant, state.depth, state.force, state.edge)
    while records.filled[3] < profiles.size and profiles[records.filled[3]] - segment.begin <= end.time:
        records = with_profile(records, state)
    work[STEPS] += 1
    work[NODES] += state.gap.size
    if problem.audit and not problem.interface.nonadhesive:
        influence = influence_of(problem, state.mesh, response, state.gap)
        work[UNSTABLE] += is_unstable(problem.interface, influence, state.gap, response)
    return records


@kernel
def _outcome_of(problem: Problem, control: float, state: State, solved: bool, work: np.ndarray) -> Outcome:
    """COMPLETED for a state from which the history goes on, or why it ends there."""
    if has_flown_off(problem, control, state.force):
        return DETACHED
    if not solved:
        return OUT_OF_WORK if is_spent(work) else NO_EQUILIBRIUM
    return COMPLETED if state.force >= problem.least_force else UNPHYSICAL


@kernel
def _on_chosen_nodes(
    problem: Problem, progress: Progress, direction: float, remembered: Remembered, work: np.ndarray
) -> Progress:
    """The contact on nodes that resolve it, chosen anew where its edge has left their window, and now and then."""
    state, memory, factor, records, chosen, outcome, index, stepping = progress
    # With a stiff response a new selection of nodes perturbs the tractions strongly.
    routine = work[STEPS] - chosen >= _CHECK_MESH_EVERY and remembered.response > _STIFF_RESPONSE
    if not edge_left_window(state) and not (routine and not problem.scheme.fixed):
        return progress
    new = select_mesh(problem.interface, problem.controls, problem.scheme, state, direction, remembered)
    if not same_nodes(new, state.mesh):
        recent = recent_on(problem.interface, stepping.recent, state.mesh, new)
        memory = memory_on(memory, state.mesh.grid, new.grid)
        state = State(new, state.depth, recent.gap[0].copy(), recent.traction[0].copy(), state.force, state.edge)
        factor, stiff = new_factor(state.gap.size), 1.0 - np.sum(memory.strengths) < _STIFF_RESPONSE
        stepping = Stepping(recent, stepping.now, stepping.step, False, stiff)
    return Progress(state, memory, factor, records, work[STEPS], outcome, index, stepping)


@kernel
def _advanced(
    problem: Problem, segment: Segment, progress: Progress, profiles: np.ndarray, work: np.ndarray
) -> Progress:
    """The contact after one more step; as it was, with a shorter step ahead, where that was too long."""
    before, memory, factor, records, chosen, _, index, stepping = progress
    recent, now, step, shortened, other_nodes = stepping
    number = records.filled[3]
    end = _end_of_step(segment, now, step, profiles[number] if number < profiles.size else np.inf)

    # A dent that nothing presses fades exactly by the rule of the first step, which no oscillation troubles there.
    faint = before.edge == 0.0 and abs(before.force) < _FAINT * problem.scales.force
    factors = step_factors(memory, end.step, recent.count[0] >= 2 and not (segment.returns and faint))
    remembered = remembered_in(memory, factors)
    can_shrink = end.step > 1.01 * segment.smallest
    # Other nodes carry other tractions, the more so the stiffer the solid: a shorter step would resolve how the
    # difference fades, which is no part of the history.
    judged = can_shrink and not other_nodes
    gap, traction, accepted, change = try_step(
        problem, before, recent, factor, end.time, end.control, remembered, judged, shortened, work
    )
    if not accepted and can_shrink:
        work[REJECTIONS] += 1
        stepping = Stepping(recent, now, max(change * end.step, segment.smallest), True, False)
        return Progress(before, memory, factor, records, chosen, COMPLETED, index, stepping)

    another_branch, solved = False, True
    if accepted:
        state = state_under(problem, before.mesh, end.control, remembered, gap, traction)
    else:
        forget_rate(memory)
        factors = step_factors(memory, end.step, recent.count[0] >= 2)
        remembered = remembered_in(memory, factors)
        state, solved = _beyond_fold(problem, before, end.control, remembered, work)
        another_branch = _jumped(problem, before, state)
        factor, change = new_factor(state.gap.size), 1.0
    outcome = _outcome_of(problem, end.control, state, solved, work)
    if outcome == DETACHED:
        flown_off = State(before.mesh, np.nan, before.gap, before.traction, 0.0, 0.0)
        records = record_jump(problem, records, end.instant, before, flown_off, remembered.response)
    if outcome != COMPLETED:
        return Progress(state, memory, factor, records, chosen, outcome, index, stepping)
    if not accepted:
        remembered = carried(remembered, before.mesh.grid, state.mesh.grid)
        memory = memory_on(memory, before.mesh.grid, state.mesh.grid)
    remember(memory, factors, end.step, state)

    if another_branch:
        records = record_jump(problem, records, end.instant, before, state, remembered.response)
    records = _with_state(problem, segment, end, state, remembered.response, profiles, records, work)
    if another_branch or not same_nodes(state.mesh, before.mesh):
        # Solutions on another branch or on other nodes cannot be extrapolated.
        recent = start_recent(state, end.time)
        forget_rate(memory)
        step = 2.0 * segment.smallest
    else:
        push_recent(recent, state, end.time)
        step = min(max(end.step * min(max(change, 0.3), 2.5), segment.smallest), segment.longest)
    stepping = Stepping(recent, end.time, step, False, False)
    progress = Progress(state, memory, factor, records, chosen, COMPLETED, index, stepping)
    return _on_chosen_nodes(problem, progress, 1.0 if state.edge >= before.edge else -1.0, remembered, work)


@kernel
def follow(problem: Problem, segment: Segment, progress: Progress, profiles: np.ndarray, work: np.ndarray) -> Progress:
    """Follow one segment of the protocol, until it ends or the slice of work is done; `profiles` are their instants."""
    state, memory, factor, records, chosen, outcome, _, stepping = progress
    if outcome != PAUSED:
        forget_rate(memory)
        stepping = Stepping(start_recent(state, 0.0), 0.0, segment.first, False, False)
    progress = Progress(state, memory, factor, records, chosen, COMPLETED, segment.index, stepping)
    while progress.outcome == COMPLETED and progress.stepping.now < segment.duration:
        if is_spent(work) or is_to_pause(work):
            state, memory, factor, records, chosen, _, index, stepping = progress
            outcome = OUT_OF_WORK if is_spent(work) else PAUSED
            return Progress(state, memory, factor, records, chosen, outcome, index, stepping)
        progress = _advanced(problem, segment, progress, profiles, work)
    return progress

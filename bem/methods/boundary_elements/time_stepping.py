"""Time stepping: predict, solve, judge, accept; follow the edge with the mesh; jump where a branch ends.

Each step solves one equilibrium at the new indentation with the remembered traction of the old ones. Its length follows
from the difference of prediction and solution. A step that fails at the smallest useful length stands at a fold: the
contact then settles on the next stable branch, and the trajectory records the jump. Times inside are counted from the
start of each protocol segment, so that long dwells cost no digits.
"""

import functools
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem.methods.boundary_elements.discrete_problem import Problem
from bem.methods.boundary_elements.equilibrium import Factor, new_factor
from bem.methods.boundary_elements.extrapolation import Recent, push_recent, recent_on, start_recent
from bem.methods.boundary_elements.gap_equation import has_flown_off, influence_of, state_under
from bem.methods.boundary_elements.jumps import equilibrate, is_unstable, record_jump, separated
from bem.methods.boundary_elements.memory import (
    Memory,
    forget_rate,
    memory_on,
    new_memory,
    remember,
    remember_start,
    remembered_in,
    shortest_relaxation,
    step_factors,
)
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width, zone_width
from bem.methods.boundary_elements.meshes.following import first_mesh, same_nodes, select_mesh
from bem.methods.boundary_elements.meshes.master_grid import moves
from bem.methods.boundary_elements.meshes.mesh import condense, no_mesh
from bem.methods.boundary_elements.meshes.regrid import Remembered, carried
from bem.methods.boundary_elements.state import State, edge_left_window, energy_of
from bem.methods.boundary_elements.trial_step import try_step
from bem.methods.outcomes import COMPLETED, DETACHED, NO_EQUILIBRIUM, OUT_OF_WORK, PAUSED, UNPHYSICAL, Outcome
from bem.methods.records import (
    NODES,
    REJECTIONS,
    STEPS,
    UNSTABLE,
    MarchResult,
    Records,
    is_spent,
    is_to_pause,
    new_records,
    new_work,
    next_slice,
    with_profile,
    with_record,
)
from bem.problem.indenter import depth_factor
from bem.problem.tractions import deviation

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
def _within(step: float, now: float, until: float) -> tuple[float, float]:
    """Shorten a step to meet an instant without leaving a tiny one; return it and the time after it."""
    if now + 1.0000001 * step >= until:
        return until - now, until
    if now + 2.0 * step > until:
        step = 0.5 * (until - now)
    return step, now + step


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
def _on_finer_grid(problem: Problem, progress: Progress) -> Progress:
    """The contact on a grid of half the spacing; other nodes are chosen after the next step."""
    scheme, state, old = problem.scheme, progress.state, progress.state.mesh
    nowhere = np.array([np.inf, -np.inf])
    mesh = condense(scheme.grid, problem.interface.tabor, 2 * old.nodes, nowhere, scheme.remembers)
    moved = State(mesh, state.depth, state.gap, state.traction, state.force, state.edge)
    memory = memory_on(progress.memory, old.grid, scheme.grid)
    factor, chosen = new_factor(state.gap.size), progress.mesh_chosen
    return Progress(moved, memory, factor, progress.records, chosen, COMPLETED, progress.segment, progress.stepping)


@kernel
def follow(
    problem: Problem,
    segment: Segment,
    progress: Progress,
    instants: np.ndarray,
    work: np.ndarray,
) -> Progress:
    """Follow one segment of the protocol, until it ends or the slice of work is done."""
    state, memory, factor, records = progress.state, progress.memory, progress.factor, progress.records
    mesh_chosen, outcome = progress.mesh_chosen, COMPLETED
    if progress.outcome == PAUSED:
        recent, now, step, shortened, other_nodes = progress.stepping
    else:
        recent = start_recent(state, 0.0)
        forget_rate(memory)
        now, step, shortened, other_nodes = 0.0, segment.first, False, False
    smallest, fixed = segment.smallest, problem.scheme.fixed
    stiff = 1.0 - np.sum(memory.strengths) < _STIFF_RESPONSE
    while now < segment.duration:
        if is_spent(work) or is_to_pause(work):
            outcome = OUT_OF_WORK if is_spent(work) else PAUSED
            break
        until, number = segment.duration, records.filled[3]
        if number < instants.size:  # of the next profile
            until = min(instants[number] - segment.begin, until)
        step, after = _within(step, now, until)
        at_end = after == segment.duration
        control = segment.last_control if at_end else segment.first_control + segment.rate * after
        instant = segment.end if at_end else segment.begin + after

        # A dent that nothing presses fades exactly by the rule of the first step, which no oscillation troubles there.
        faint = state.edge == 0.0 and abs(state.force) < _FAINT * problem.scales.force
        bends = recent.count[0] >= 2 and not (segment.returns and faint)
        factors = step_factors(memory, step, bends)
        remembered = remembered_in(memory, factors)
        can_shrink = step > 1.01 * smallest
        # Other nodes carry other tractions, the more so the stiffer the solid: a shorter step would resolve how the
        # difference fades, which is no part of the history.
        gap, traction, accepted, shrink = try_step(
            problem, state, recent, factor, after, control, remembered, can_shrink and not other_nodes, shortened, work
        )
        other_nodes = False
        if not accepted and can_shrink:
            work[REJECTIONS] += 1
            step, shortened = max(shrink * step, smallest), True
            continue

        before, another_branch, shortened = state, False, False
        if accepted:
            state = state_under(problem, before.mesh, control, remembered, gap, traction)
        else:
            forget_rate(memory)
            factors = step_factors(memory, step, recent.count[0] >= 2)
            remembered = remembered_in(memory, factors)
            state, solved = equilibrate(problem, before, control, remembered, work)
            # An edge that is still near has not let go: there is a state that the mesh does not resolve.
            stays = moves(before.mesh.grid) and state.edge > _LETS_GO * before.edge
            if not solved and not stays and not problem.device.by_force:
                state, solved = separated(problem, before, control, remembered, work)
            if not solved and not has_flown_off(problem, control, state.force):
                outcome = OUT_OF_WORK if is_spent(work) else NO_EQUILIBRIUM
                break
            another_branch = _jumped(problem, before, state)
            factor = new_factor(state.gap.size)
            shrink = 1.0
        if has_flown_off(problem, control, state.force):
            flown_off = State(before.mesh, np.nan, before.gap, before.traction, 0.0, 0.0)
            records = record_jump(problem, records, instant, before, flown_off, remembered.response)
            outcome = DETACHED
            break
        if not state.force >= problem.least_force:
            outcome = UNPHYSICAL
            break
        if not accepted:
            remembered = carried(remembered, before.mesh.grid, state.mesh.grid)
            memory = memory_on(memory, before.mesh.grid, state.mesh.grid)
        remember(memory, factors, step, state)
        now = after

        if another_branch:
            records = record_jump(problem, records, instant, before, state, remembered.response)
        records = with_record(records, instant, state.depth, state.force, state.edge)
        while records.filled[3] < instants.size and instants[records.filled[3]] - segment.begin <= now:
            records = with_profile(records, state)
        work[STEPS] += 1
        work[NODES] += state.gap.size
        if problem.audit and not problem.interface.nonadhesive:
            influence = influence_of(problem, state.mesh, remembered.response, state.gap)
            work[UNSTABLE] += is_unstable(problem.interface, influence, state.gap, remembered.response)
        if another_branch or not same_nodes(state.mesh, before.mesh):
            # Solutions on another branch or on other nodes cannot be extrapolated.
            recent = start_recent(state, now)
            forget_rate(memory)
            step = 2.0 * smallest
        else:
            push_recent(recent, state, now)
            step = min(max(step * min(max(shrink, 0.3), 2.5), smallest), segment.longest)

        # With a stiff response a new selection of nodes perturbs the tractions strongly.
        routine = work[STEPS] - mesh_chosen >= _CHECK_MESH_EVERY and remembered.response > _STIFF_RESPONSE
        if edge_left_window(state) or (routine and not fixed):
            mesh_chosen = work[STEPS]
            direction = 1.0 if state.edge >= before.edge else -1.0
            new = select_mesh(problem.interface, problem.controls, problem.scheme, state, direction, remembered)
            if not same_nodes(new, state.mesh):
                recent = recent_on(problem.interface, recent, state.mesh, new)
                memory = memory_on(memory, state.mesh.grid, new.grid)
                state = State(
                    new, state.depth, recent.gap[0].copy(), recent.traction[0].copy(), state.force, state.edge
                )
                factor = new_factor(state.gap.size)
                other_nodes = stiff
    stepping = Stepping(recent, now, step, shortened, other_nodes)
    return Progress(state, memory, factor, records, mesh_chosen, outcome, segment.index, stepping)


@kernel
def start(problem: Problem, control: float, glassy: bool, work: np.ndarray) -> Progress:
    """The equilibrium from which a protocol begins; its `outcome` says whether there is one."""
    interface, tabor = problem.interface, problem.interface.tabor
    mesh = first_mesh(problem.interface, problem.controls, problem.scheme)
    depth = control
    if problem.device.by_force:  # that of Hertz, in contact
        power = interface.exponent / (interface.exponent + 1.0)
        factor = depth_factor(interface.exponent)
        depth = tabor * factor * (0.5 * np.pi / (power * factor) * max(-control, 0.0)) ** power
    gap = np.empty(mesh.radii.size)
    for i in range(gap.size):
        sphere = 1.0 - depth + 0.5 * tabor * mesh.radii[i] ** 2 + deviation(interface, mesh.radii[i])
        gap[i] = max(sphere, 1.0 if interface.nonadhesive else 0.95)
    begin = State(mesh, depth, gap, np.zeros(gap.size), 0.0, 0.0)
    nothing = np.zeros(mesh.grid.size if problem.strengths.size > 0 else 0)
    response = 1.0 - np.sum(problem.strengths) if glassy else 1.0
    state, solved = equilibrate(problem, begin, control, Remembered(nothing, response), work)
    gone = has_flown_off(problem, control, state.force)
    outcome = COMPLETED if solved else DETACHED if gone else OUT_OF_WORK if is_spent(work) else NO_EQUILIBRIUM
    memory = new_memory(problem.strengths, problem.times, state.mesh.grid.size)
    if solved:
        remember_start(memory, state, glassy)
    stepping = Stepping(start_recent(state, 0.0), 0.0, 0.0, False, False)
    return Progress(state, memory, new_factor(state.gap.size), new_records(), 0, outcome, 0, stepping)


@kernel
def proceed(
    problem: Problem,
    times: np.ndarray,
    controls: np.ndarray,
    instants: np.ndarray,
    glassy: bool,
    progress: Progress,
    segment_steps: np.ndarray,
    energies: np.ndarray,
    work: np.ndarray,
) -> Progress:
    """Follow a history for a slice of work, or to its end; arguments as of `followed`.

    Returns:
        how far it got, PAUSED where it goes on from there.
    """
    if progress.segment < 0:
        progress = start(problem, controls[0], glassy, work)
        if progress.outcome != COMPLETED:
            return progress
        state, records = progress.state, progress.records
        records = with_record(records, times[0], state.depth, state.force, state.edge)
        if instants.size > 0 and instants[0] <= times[0]:
            records = with_profile(records, state)
        energies[0] = energy_of(problem.interface, state)
        progress = Progress(state, progress.memory, progress.factor, records, 0, COMPLETED, 0, progress.stepping)
    last_rise = -1
    for k in range(segment_steps.size):
        last_rise = k if controls[k + 1] > controls[k] else last_rise
    for k in range(progress.segment, segment_steps.size):
        steps = work[STEPS]
        segment = segment_of(problem, times, controls, k, last_rise)
        if 0 < k == problem.scheme.wide_segments and progress.outcome != PAUSED:
            progress = _on_finer_grid(problem, progress)
        progress = follow(problem, segment, progress, instants, work)
        segment_steps[k] += work[STEPS] - steps
        if progress.outcome != COMPLETED:
            break
    if progress.outcome == COMPLETED:
        energies[1] = energy_of(problem.interface, progress.state)
    return progress


@functools.cache
def before_start() -> Progress:
    """What `followed` takes for a protocol that has not begun; the types of its parts are all that counts."""
    mesh, none = no_mesh(), np.empty(0)
    state, memory = State(mesh, 0.0, none, none, 0.0, 0.0), uncompiled(new_memory)(none, none, 0)
    recent = Recent(np.empty((0, 0)), np.empty((0, 0)), none, none, np.zeros(1, np.int64))
    stepping, records = Stepping(recent, 0.0, 0.0, False, False), uncompiled(new_records)()
    return Progress(state, memory, uncompiled(new_factor)(0), records, 0, PAUSED, -1, stepping)


def followed(
    problem: Problem,
    times: np.ndarray,
    controls: np.ndarray,
    instants: np.ndarray,
    glassy: bool,
    progress: Progress,
    work: np.ndarray,
) -> tuple[Progress, np.ndarray, np.ndarray]:
    """Follow the history that a protocol prescribes (`times`, `controls`), linear between its s instants.

    It is followed in slices, between which Python calls signal handlers.

    Args:
        problem: the scene, discretised.
        times, controls: (s,) the protocol: indentations (of the stage, where there is a spring), or forces.
        instants: (p,) of the profiles, increasing; steps end there.
        glassy: whether the surfaces meet at once (instantaneous modulus) rather than fully relaxed.
        progress: `before_start`, or the state to go on from, at the first instant.
        work: counts as in `bem.methods.records`, added to.

    Returns:
        how far it got, the steps of each segment (s - 1,), and the energies (2,) stored at both ends.
    """
    segment_steps, energies = np.zeros(times.size - 1, np.int64), np.zeros(2)
    while True:
        counts = segment_steps, energies, next_slice(work)
        progress = proceed(problem, times, controls, instants, glassy, progress, *counts)
        if progress.outcome != PAUSED:
            return progress, segment_steps, energies


def march(
    problem: Problem, times: np.ndarray, controls: np.ndarray, instants: np.ndarray, glassy: bool, most_work: float
) -> MarchResult:
    """Follow a protocol from its start, with a budget in multiply-adds; other arguments as of `followed`."""
    work = uncompiled(new_work)(most_work)
    progress, steps, energies = followed(problem, times, controls, instants, glassy, before_start(), work)
    records = progress.records
    states, jumps = records.states[: records.filled[0]], records.jumps[: records.filled[1]]
    profiles = records.profiles[: records.filled[2]]
    return MarchResult(states, jumps, work, steps, energies, progress.outcome, profiles)

"""A history from its start to its end: the first equilibrium, one segment of the protocol after the other.

It is followed in slices of work, between which Python calls signal handlers; each goes on from a `Progress`.
"""

import functools

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem.methods.boundary_elements.discrete_problem import Problem
from bem.methods.boundary_elements.equilibrium import new_factor
from bem.methods.boundary_elements.extrapolation import Recent, start_recent
from bem.methods.boundary_elements.following import first_mesh
from bem.methods.boundary_elements.gap_equation import has_flown_off
from bem.methods.boundary_elements.jumps import equilibrate
from bem.methods.boundary_elements.memory import memory_on, new_memory, remember_start
from bem.methods.boundary_elements.meshes.mesh import condense, no_mesh
from bem.methods.boundary_elements.meshes.regrid import Remembered
from bem.methods.boundary_elements.state import State, energy_of, with_profile
from bem.methods.boundary_elements.time_stepping import Progress, Stepping, follow, segment_of
from bem.methods.outcomes import COMPLETED, DETACHED, NO_EQUILIBRIUM, OUT_OF_WORK, PAUSED
from bem.methods.records import STEPS, MarchResult, is_spent, new_records, new_work, next_slice, with_record
from bem.problem.indenter import depth_factor
from bem.problem.tractions import deviation


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

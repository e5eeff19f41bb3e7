"""The paper's discretisation, for comparison: equal spacing, a history sum, plain Newton-Raphson.

- N_s equally spaced nodes, as many wherever the contact edge is.
- The displacement at step q is mu G sum_m C(t_q - t_m) (sigma_m - sigma_(m-1)), summed anew over all past steps. The
  paper pairs C[q-m] with sigma[m+1] - sigma[m], whose last term needs the step after q; here the indices of sigma are
  one lower, which puts each increment at the end of its step (first order).
- Newton-Raphson in the gap with a fresh factorisation in every iteration, started from the last solution.
- Equal time steps in each segment of the protocol, so many in each and in twenty of the shortest retardation times,
  halved where Newton-Raphson fails and lengthened again after.

The paper does not say where its mesh ends, what happens beyond and at a fold. Here the mesh ends where the gap is
`FAR_GAP`, the closed-form tail is added as in the solver, and a step that fails after `MOST_HALVINGS` is taken by
`bem.methods.boundary_elements.jumps`, as the solver does. Influence matrix, units and signs are the solver's too, so
that a comparison shows the discretisation and nothing else. Source: paper, Appendix "BEM discretisation details", Eqs.
(LJdisc) to (Cdisc).
"""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem._support.linear_algebra import add_rows, lu_factor, lu_solve
from bem._support.validation import finite_number, instance, whole_number
from bem.methods.boundary_elements.equilibrium import residual_of
from bem.methods.boundary_elements.jumps import jacobian, settle, smallest_eigenvalue
from bem.methods.boundary_elements.meshes.cohesive_zone import contact_edge, largest_contact_radius
from bem.methods.boundary_elements.meshes.mesh import Mesh, fixed_mesh, uniform_mesh
from bem.methods.outcomes import COMPLETED, NO_EQUILIBRIUM, PAUSED, Outcome
from bem.methods.records import (
    MOST_WORK,
    MULTIPLY_ADDS,
    REJECTIONS,
    STEPS,
    Records,
    columns_of,
    count_factorisation,
    count_iteration,
    is_spent,
    is_to_pause,
    new_records,
    new_work,
    next_slice,
    with_jump,
    with_record,
    work_by_name,
)
from bem.problem.protocol import LoadingProtocol, PiecewiseLinearProtocol, by_phase, history_of, in_phase
from bem.problem.scene import Scene
from bem.problem.tractions import Interface, LennardJones, force_of, interface_of, tractions_of
from bem.results.trajectory import Jump, Statistics, Trajectory

FAR_GAP = 20.0
MOST_HALVINGS = 14
MOST_ITERATIONS = 25
RESIDUAL = 1e-5
RESOLVED = 20.0
_STATISTICS = ("steps", "rejections", "iterations", "factorisations", "multiply_adds")
_LEAST_JUMP = 0.02  # of the force (at least 1), by which a step over a fold counts as a jump


def simulate_paper_method(
    scene: Scene,
    protocol: LoadingProtocol | PiecewiseLinearProtocol,
    *,
    nodes: int = 400,
    steps: int = 400,
    most_work: float = MOST_WORK,
) -> Trajectory:
    """Compute the force history of an adhesive scene by the paper's discretisation, from the relaxed state.

    Args:
        scene: any material, with `LennardJones` adhesion, without a spring and of a paraboloid.
        protocol: as for `bem.simulate`.
        nodes: equally spaced nodes N_s, 10 to 4000.
        steps: least number of equal time steps in each segment of the protocol, and in each `RESOLVED` of the shortest
            retardation times, 2 to 20,000. With the default a step is 0.05 of it at most.
        most_work: budget in multiply-adds, 1e3 to 1e18, as of `bem.simulate`; nodes and steps decide what is needed.

    Returns:
        a trajectory as of `bem.simulate`; its `accuracy` is NaN, because nothing here aims at one.

    Raises:
        ValueError: naming what is allowed and what was received.
    """
    instance("scene", scene, (Scene,))
    instance("adhesion of the scene", scene.adhesion, (LennardJones,))
    if scene.spring is not None:
        raise ValueError(f"the paper's method knows no spring: spring must be None; received {scene.spring!r}")
    if scene.indenter is not None:
        raise ValueError(
            f"the paper's method knows the paraboloid only: indenter must be None; received {scene.indenter}"
        )
    instance("protocol", protocol, (LoadingProtocol, PiecewiseLinearProtocol))
    nodes = whole_number("nodes", nodes, low=10, high=4000)
    steps = whole_number("steps", steps, low=2, high=20_000)
    budget = finite_number("most_work", most_work, low=1e3, high=1e18)
    tabor, material = scene.tabor, scene.material
    history = history_of(protocol, tabor)
    started = time.perf_counter()
    touching = largest_contact_radius(float(np.max(history.indentations)), tabor)
    mesh = fixed_mesh(tabor, uniform_mesh(math.sqrt(touching**2 + 2.0 * FAR_GAP / tabor), nodes), False)
    strengths, times = np.array(material.strengths), np.array(material.times)
    corners, depths = np.array(history.times), np.array(history.indentations)
    work, by_segment = uncompiled(new_work)(budget), np.zeros(corners.size - 1, np.int64)
    none = np.empty(0)
    past = _Past(none, np.empty(1024), np.empty((1024, nodes)), 0)
    course = _Course(uncompiled(new_records)(), none, none, past, 0.0, -1, 0.0, 0.0, PAUSED)
    interface = interface_of(tabor, scene.adhesion)
    while course.outcome == PAUSED:
        course = _march(interface, mesh, strengths, times, corners, depths, steps, course, by_segment, next_slice(work))
    records = course.records.states[: course.records.filled[0]]
    jumps = course.records.jumps[: course.records.filled[1]]
    seconds = time.perf_counter() - started
    counted = work_by_name(work)
    reason = "no equilibrium found"
    if counted["multiply_adds"] >= budget:
        reason = f"stopped at the budget of {budget:g} multiply-adds; try fewer nodes or steps, or a larger most_work"
    status = "completed" if course.outcome == COMPLETED else f"{reason} (at time {records['time'][-1]:.6g})"
    return Trajectory(
        *columns_of(records),
        status=status,
        jumps=tuple(Jump(*row) for row in jumps.tolist()),
        stats=Statistics(
            **{name: counted[name] for name in _STATISTICS},
            steps_by_phase=by_phase(history.phases, by_segment.tolist()),
            memory_vectors=counted["steps"] if strengths.size else 0,
            nodes=float(nodes),
            unknowns_per_solve=float(nodes),
            grid_nodes=nodes,
            seconds=seconds,
        ),
        accuracy=math.nan,
        unloading=in_phase(history, records["time"], "unloading"),
    )


class _Past(NamedTuple):
    """Tractions of the past, on n nodes; there is room for more of their increments."""

    settled: np.ndarray  # (n,) the traction whose displacement does not change any more
    instants: np.ndarray  # (room,) of the increments
    increments: np.ndarray  # (room, n)
    count: int  # increments so far


class _Course(NamedTuple):
    """How far a history has been followed, on n nodes."""

    records: Records
    gap: np.ndarray  # (n,)
    tractions: np.ndarray  # (n,)
    past: _Past
    force: float
    segment: int  # -1 before the start
    now: float  # in the segment
    step: float
    outcome: Outcome


@kernel
def _newton(
    interface: Interface,
    mesh: Mesh,
    rhs: np.ndarray,
    response: float,
    gap: np.ndarray,
    tractions: np.ndarray,
    work: np.ndarray,
) -> bool:
    """Plain Newton-Raphson in the gap (n,), overwritten with `tractions` (n,); whether the residual became small."""
    n = gap.size
    columns, pivots = np.empty((n, n)), np.empty(n, dtype=np.int32)
    residual = np.empty(n)
    for _ in range(MOST_ITERATIONS):
        tractions_of(interface, gap, tractions)
        residual_of(mesh.influence, gap, tractions, response, rhs, residual)
        worst = np.max(np.abs(residual))
        if worst < RESIDUAL * min(1.0, 10.0 * response):
            return True
        if not worst < 1e12:
            return False
        jacobian(interface, mesh.influence, gap, response, 0.0, columns)
        lu_factor(columns, n, pivots)
        lu_solve(columns, n, pivots, residual)
        count_iteration(work, n, n)
        count_factorisation(work, n)
        for i in range(n):
            # A larger change would leave the range in which the law is anything like its tangent.
            gap[i] += min(max(-residual[i], -0.3 * gap[i]), 0.5 * gap[i])
    return False


@kernel
def _recorded(
    records: Records, interface: Interface, mesh: Mesh, time: float, depth: float, force: float, gap: np.ndarray
) -> Records:
    """The records with one more state, of this gap (n,)."""
    return with_record(records, time, depth, force, contact_edge(mesh.radii, gap, interface.law.peak_gap))


@kernel
def _settled(
    interface: Interface,
    mesh: Mesh,
    rhs: np.ndarray,
    response: float,
    gap: np.ndarray,
    tractions: np.ndarray,
    work: np.ndarray,
) -> bool:
    """Let gap (n,) and `tractions` (n,) settle on a stable branch; whether they did. Only multiply-adds are counted."""
    of_settling = work.copy()
    solved = settle(interface, mesh.influence, rhs, response, RESIDUAL, gap, tractions, of_settling)
    work[MULTIPLY_ADDS] = of_settling[MULTIPLY_ADDS]
    return solved


@kernel
def _displaced(
    mesh: Mesh, strengths: np.ndarray, times: np.ndarray, past: _Past, instant: float, tractions: np.ndarray
) -> np.ndarray:
    """Displacement (n,) at an instant by what came before the last `tractions` (n,), by the sum over the history."""
    total, displaced = np.zeros(tractions.size), np.zeros(tractions.size)
    for m in range(past.count):  # sum_m C(now - t_m) (sigma_m - sigma_(m-1))
        compliance = 1.0
        for i in range(strengths.size):
            compliance -= strengths[i] * np.exp(-(instant - past.instants[m]) / times[i])
        total += compliance * past.increments[m]
    add_rows(mesh.influence, past.settled + total - (1.0 - np.sum(strengths)) * tractions, displaced)
    return displaced


@kernel
def _with_increment(past: _Past, instant: float, change: np.ndarray) -> _Past:
    """The past with one more increment of the tractions (n,)."""
    instants, increments, count = past.instants, past.increments, past.count
    if count == instants.size:
        instants = np.concatenate((instants, np.empty_like(instants)))
        increments = np.concatenate((increments, np.empty_like(increments)))
    instants[count] = instant
    increments[count] = change
    return _Past(past.settled, instants, increments, count + 1)


@kernel
def _march(
    interface: Interface,
    mesh: Mesh,
    strengths: np.ndarray,
    times: np.ndarray,
    corners: np.ndarray,
    depths: np.ndarray,
    steps: int,
    course: _Course,
    by_segment: np.ndarray,
    work: np.ndarray,
) -> _Course:
    """Follow the history for a slice of work; the steps of each segment and the work are counted."""
    records, gap, tractions, past, force, first, now, step, outcome = course
    n, solved, glassy = mesh.radii.size, True, 1.0 - np.sum(strengths)
    shape = 1.0 + 0.5 * interface.tabor * mesh.radii**2
    if first < 0:
        gap, tractions = np.maximum(shape - depths[0], 0.95), np.zeros(n)
        solved = _settled(interface, mesh, shape - depths[0], 1.0, gap, tractions, work)
        past = _Past(tractions.copy(), past.instants, past.increments, 0)  # relaxed: felt through the whole compliance
        force = force_of(interface, mesh.force_weights, gap, tractions)
        records = _recorded(records, interface, mesh, corners[0], depths[0], force, gap)
    for segment in range(max(first, 0), corners.size - 1):
        duration = corners[segment + 1] - corners[segment]
        nominal = duration / steps
        if times.size > 0:
            nominal = min(nominal, RESOLVED * np.min(times) / steps)
        if segment != first:
            step, now = nominal, 0.0
        while solved and now < duration:
            if is_to_pause(work) and not is_spent(work):
                return _Course(records, gap, tractions, past, force, segment, now, step, PAUSED)
            if is_spent(work):
                solved = False
                break
            work[MULTIPLY_ADDS] += past.count * (n + 20 * strengths.size)  # of the sum over the history
            after = duration if now + 1.0000001 * step >= duration else now + step
            instant, share = corners[segment] + after, after / duration
            depth = depths[segment] * (1.0 - share) + depths[segment + 1] * share
            rhs = shape - depth - _displaced(mesh, strengths, times, past, instant, tractions)
            new_gap, new_traction = gap.copy(), tractions.copy()
            converged = _newton(interface, mesh, rhs, glassy, new_gap, new_traction, work)
            if not converged and step > 1.01 * nominal * 0.5**MOST_HALVINGS:
                work[REJECTIONS] += 1
                step *= 0.5
                continue
            if not converged:
                new_gap = gap.copy()
                solved = _settled(interface, mesh, rhs, glassy, new_gap, new_traction, work)
                if not solved:
                    break
            new_force = force_of(interface, mesh.force_weights, new_gap, new_traction)
            if not converged and abs(new_force - force) > _LEAST_JUMP * max(abs(force), 1.0):
                eigenvalue = smallest_eigenvalue(interface, mesh.influence, gap, glassy)
                after_jump = smallest_eigenvalue(interface, mesh.influence, new_gap, glassy)
                forces, eigenvalues = (force, new_force), (eigenvalue, after_jump)
                records = with_jump(records, instant, depth, forces, eigenvalues, np.nan, depth)
                records = _recorded(records, interface, mesh, instant, depth, force, gap)
            if strengths.size > 0:
                past = _with_increment(past, instant, new_traction - tractions)
            else:
                past = _Past(new_traction.copy(), past.instants, past.increments, 0)
            gap, tractions, force, now = new_gap, new_traction, new_force, after
            records = _recorded(records, interface, mesh, instant, depth, force, gap)
            by_segment[segment] += 1
            work[STEPS] += 1
            step = min(1.5 * step, nominal)
    outcome = COMPLETED if solved else NO_EQUILIBRIUM
    return _Course(records, gap, tractions, past, force, segment, now, step, outcome)

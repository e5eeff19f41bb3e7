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
`bem.solver.instabilities`, as the solver does. Influence matrix, units and signs are the solver's too, so that a
comparison shows the discretisation and nothing else.
Source: paper, Appendix "BEM discretisation details", Eqs. (LJdisc) to (Cdisc).
"""

from __future__ import annotations

import math
import time

import numpy as np

from bem._numerics.jit import kernel
from bem._numerics.linear_algebra import add_rows, lu_factor, lu_solve
from bem._support.validation import instance, whole_number
from bem.protocol import LoadingProtocol, PiecewiseLinearProtocol, by_phase, history_of
from bem.scene import Scene
from bem.solver.discretisation.cohesive_zone import contact_edge, largest_contact_radius
from bem.solver.discretisation.mesh import Mesh, fixed_mesh, uniform_mesh
from bem.solver.equilibrium import force_of, residual_of, tractions_of
from bem.solver.instabilities import jacobian, settle, smallest_eigenvalue
from bem.solver.work import FACTORISATIONS, FOLD_SOLVES, ITERATIONS, REJECTIONS, STEPS, new_work, work_by_name
from bem.tractions import LENNARD_JONES, Law, LennardJones
from bem.trajectory import Jump, Statistics, Trajectory

FAR_GAP = 20.0
MOST_HALVINGS = 14
MOST_ITERATIONS = 25
RESIDUAL = 1e-5
RESOLVED = 20.0
_STATISTICS = ("steps", "rejections", "iterations", "factorisations", "fold_solves")
_LEAST_JUMP = 0.02  # of the force (at least 1), by which a step over a fold counts as a jump


def simulate_paper_method(
    scene: Scene, protocol: LoadingProtocol | PiecewiseLinearProtocol, *, nodes: int = 400, steps: int = 400
) -> Trajectory:
    """Compute the force history of an adhesive scene by the paper's discretisation, from the relaxed state.

    Args:
        scene: any material, with `LennardJones` adhesion and without a spring.
        protocol: as for `bem.simulate`.
        nodes: equally spaced nodes N_s, 10 to 4000.
        steps: least number of equal time steps in each segment of the protocol, and in each `RESOLVED` of the shortest
            retardation times, 2 to 20,000. With the default a step is 0.05 of it at most.

    Returns:
        a trajectory as of `bem.simulate`; its `accuracy` is NaN, because nothing here aims at one.

    Raises:
        ValueError: naming what is allowed and what was received.
    """
    instance("scene", scene, (Scene,))
    instance("adhesion of the scene", scene.adhesion, (LennardJones,))
    if scene.spring is not None:
        raise ValueError(f"the paper's method knows no spring: spring must be None; received {scene.spring!r}")
    instance("protocol", protocol, (LoadingProtocol, PiecewiseLinearProtocol))
    nodes = whole_number("nodes", nodes, low=10, high=4000)
    steps = whole_number("steps", steps, low=2, high=20_000)
    tabor, material = scene.tabor, scene.material
    history = history_of(protocol, tabor)
    started = time.perf_counter()
    touching = largest_contact_radius(float(np.max(history.indentations)), tabor, False)
    mesh = fixed_mesh(tabor, uniform_mesh(math.sqrt(touching**2 + 2.0 * FAR_GAP / tabor), nodes), False)
    strengths, times = np.array(material.strengths), np.array(material.times)
    records, jumps, work, by_segment, solved = _march(
        mesh, tabor, LENNARD_JONES, strengths, times, np.array(history.times), np.array(history.indentations), steps
    )
    seconds = time.perf_counter() - started
    counted = work_by_name(work)
    status = "completed" if solved else f"no equilibrium found (at time {records[-1, 0]:.6g})"
    return Trajectory(
        *(np.ascontiguousarray(records[:, column]) for column in range(4)),
        status=status,
        jumps=tuple(Jump(*(float(value) for value in row), indentation_after=float(row[1])) for row in jumps),
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
        unloading=_while_unloading(records[:, 4].astype(int), history.phases),
    )


def _while_unloading(segment: np.ndarray, phases: tuple[str, ...]) -> np.ndarray:
    """Which entries (n,) lie in an unloading segment, the last entry of the segment before it included."""
    inside = np.array([phase == "unloading" for phase in phases])[segment]
    inside[:-1] |= inside[1:] & (np.diff(segment) > 0)
    return inside


@kernel
def _newton(
    mesh: Mesh,
    tabor: float,
    law: Law,
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
        tractions_of(gap, tabor, law, tractions)
        residual_of(mesh.influence, gap, tractions, response, rhs, residual)
        worst = 0.0
        for i in range(n):
            worst = max(worst, abs(residual[i]))
        if worst < RESIDUAL * min(1.0, 10.0 * response):
            return True
        if not worst < 1e12:
            return False
        jacobian(mesh.influence, gap, tabor, law, response, 0.0, columns)
        lu_factor(columns, n, pivots)
        lu_solve(columns, n, pivots, residual)
        work[ITERATIONS] += 1
        work[FACTORISATIONS] += 1
        for i in range(n):
            # A larger change would leave the range in which the law is anything like its tangent.
            gap[i] += min(max(-residual[i], -0.3 * gap[i]), 0.5 * gap[i])
    return False


@kernel
def _history_sum(
    now: float, instants: np.ndarray, increments: np.ndarray, count: int, strengths: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """sum_m C(now - t_m) (sigma_m - sigma_(m-1)) over the first `count` steps; (n,)."""
    total = np.zeros(increments.shape[1])
    for m in range(count):
        compliance = 1.0
        for i in range(strengths.size):
            compliance -= strengths[i] * np.exp(-(now - instants[m]) / times[i])
        total += compliance * increments[m]
    return total


@kernel
def _march(
    mesh: Mesh,
    tabor: float,
    law: Law,
    strengths: np.ndarray,
    times: np.ndarray,
    corners: np.ndarray,
    depths: np.ndarray,
    steps: int,
) -> tuple:
    """Follow the history; records (n, 5): time, indentation, force, contact radius, segment."""
    n = mesh.radii.size
    work, of_settling = new_work(), new_work()
    by_segment = np.zeros(corners.size - 1, dtype=np.int64)
    records, jumps = np.empty((1024, 5)), np.empty((64, 6))
    recorded, jumped, past = 0, 0, 0
    instants, increments = np.empty(1024), np.empty((1024, n))
    glassy = 1.0 - np.sum(strengths)
    shape = 1.0 + 0.5 * tabor * mesh.radii**2
    gap = np.maximum(shape - depths[0], 0.95)
    tractions = np.zeros(n)
    solved = settle(mesh.influence, tabor, law, shape - depths[0], 1.0, RESIDUAL, gap, tractions, of_settling)
    settled = tractions.copy()  # relaxed: felt through the whole compliance
    force = force_of(mesh.force_weights, tractions, gap, law)
    records[0] = np.array([corners[0], depths[0], force, contact_edge(mesh.radii, gap, law.peak_gap), 0.0])
    recorded = 1
    for segment in range(corners.size - 1):
        duration = corners[segment + 1] - corners[segment]
        nominal = duration / steps
        if times.size > 0:
            nominal = min(nominal, RESOLVED * np.min(times) / steps)
        smallest = nominal * 0.5**MOST_HALVINGS
        step, now = nominal, 0.0
        while solved and now < duration:
            at_end = now + 1.0000001 * step >= duration
            after = duration if at_end else now + step
            instant = corners[segment] + after
            part = after / duration
            depth = depths[segment] * (1.0 - part) + depths[segment + 1] * part
            known = settled + _history_sum(instant, instants, increments, past, strengths, times) - glassy * tractions
            displaced = np.zeros(n)
            add_rows(mesh.influence, known, displaced)
            rhs = shape - depth - displaced
            new_gap, new_traction = gap.copy(), tractions.copy()
            converged = _newton(mesh, tabor, law, rhs, glassy, new_gap, new_traction, work)
            if not converged and step > 1.01 * smallest:
                work[REJECTIONS] += 1
                step *= 0.5
                continue
            old_force, eigenvalue = force, 0.0
            if not converged:
                work[FOLD_SOLVES] += 1
                eigenvalue = smallest_eigenvalue(mesh.influence, tabor, law, glassy, gap)
                new_gap = gap.copy()
                solved = settle(mesh.influence, tabor, law, rhs, glassy, RESIDUAL, new_gap, new_traction, of_settling)
                if not solved:
                    break
            new_force = force_of(mesh.force_weights, new_traction, new_gap, law)
            if recorded + 2 > records.shape[0]:
                records = np.concatenate((records, np.empty_like(records)))
            if not converged and abs(new_force - old_force) > _LEAST_JUMP * max(abs(old_force), 1.0):
                if jumped == jumps.shape[0]:
                    jumps = np.concatenate((jumps, np.empty_like(jumps)))
                stiffness = smallest_eigenvalue(mesh.influence, tabor, law, glassy, new_gap)
                jumps[jumped] = np.array([instant, depth, old_force, new_force, eigenvalue, stiffness])
                jumped += 1
                records[recorded] = np.array(
                    [instant, depth, old_force, contact_edge(mesh.radii, gap, law.peak_gap), float(segment)]
                )
                recorded += 1
            if strengths.size > 0:
                if past == instants.size:
                    instants = np.concatenate((instants, np.empty_like(instants)))
                    increments = np.concatenate((increments, np.empty_like(increments)))
                instants[past] = instant
                increments[past] = new_traction - tractions
                past += 1
            else:
                settled = new_traction.copy()
            gap, tractions, force, now = new_gap, new_traction, new_force, after
            records[recorded] = np.array(
                [instant, depth, force, contact_edge(mesh.radii, gap, law.peak_gap), float(segment)]
            )
            recorded += 1
            by_segment[segment] += 1
            work[STEPS] += 1
            step = min(1.5 * step, nominal)
    return records[:recorded], jumps[:jumped], work, by_segment, solved

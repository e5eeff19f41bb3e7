"""`simulate`: compute the trajectory of a scene under a protocol."""

from __future__ import annotations

import functools
import time
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bem._numerics.interruption import interruptible
from bem._numerics.jit import announce_compilation, note_compilation
from bem._numerics.peaks import with_peaks
from bem._support.validation import instance
from bem._support.wording import shown
from bem.accuracy import Accuracy, Controls, resolve_accuracy
from bem.protocol import ForceProtocol, LoadingProtocol, PiecewiseLinearProtocol, Protocol, by_phase, history_of
from bem.reference_solutions import hertz
from bem.scene import Scene
from bem.solver.discretisation.cohesive_zone import edge_resistance, largest_contact_radius
from bem.solver.discretisation.mesh import Mesh
from bem.solver.elastic.march import has_curve, march_elastic, prefers_curve
from bem.solver.machine.reach import deepest_indentation
from bem.solver.problem import Problem, discretise
from bem.solver.stepping.time_stepping import (
    COMPLETED,
    DETACHED,
    NO_EQUILIBRIUM,
    TOO_MANY_STEPS,
    UNPHYSICAL,
    Marched,
    march,
)
from bem.solver.work import work_by_name
from bem.tractions import HardContact, TractionLaw
from bem.trajectory import Jump, Statistics, Trajectory

MOST_STEPS = 400_000
_MOST_REFINEMENTS = 3  # each halves the target error
_STATISTICS = ("steps", "rejections", "iterations", "factorisations", "fold_solves", "remeshings")
_REASONS = {
    COMPLETED: "completed",
    NO_EQUILIBRIUM: "no stable equilibrium found; try a tighter accuracy",
    TOO_MANY_STEPS: f"stopped after {MOST_STEPS} steps; try a looser accuracy or a shorter protocol",
    UNPHYSICAL: "force beyond what the history allows; try a tighter accuracy",
    DETACHED: "detached: no contact bears the prescribed force",
}
_Path = PiecewiseLinearProtocol | ForceProtocol


def simulate(
    scene: Scene,
    protocol: Protocol,
    accuracy: str | float = "standard",
    *,
    initial_state: Literal["relaxed", "glassy"] = "relaxed",
    mesh: ArrayLike | None = None,
) -> Trajectory:
    """Compute the force history of a scene under a protocol.

    Args:
        scene: Tabor parameter, material, adhesion and spring; only the effects it names are simulated.
        protocol: `LoadingProtocol`, any `PiecewiseLinearProtocol` (cycles and hold), or a `ForceProtocol` (load
            control, creep). In a scene with a spring the first two move the stage.
        accuracy: "draft", "standard", "reference", or the wanted relative error of pull-off force and hysteresis (2e-5
            to 0.05). Draft is for looking, standard for data sets, reference for checking; `docs/cost.md` has
            what each costs.
        initial_state: "relaxed", as if the sphere had been at its start for ever, or "glassy", as if it had just
            arrived there.
        mesh: radii (n,) in beta, from 0 upwards, of a fixed mesh of your own, e.g.
            `bem.solver.discretisation.mesh.uniform_mesh`; by default nodes follow the edge.

    Returns:
        the trajectory. Its `accuracy` is the target, or a tighter one where the coarse mesh found no way through. Its
        `status` is "completed" or says where and why it ended; the scalar results of an unfinished one are NaN.

    Raises:
        ValueError: for input that is not a scene, a protocol, an accuracy, an initial state or a mesh, naming what is
            allowed.

    Source: paper, Methods and Appendix "BEM discretisation details"; differences from it are listed in `bem/README.md`.
    """
    instance("scene", scene, (Scene,))
    instance("protocol", protocol, (LoadingProtocol, PiecewiseLinearProtocol, ForceProtocol))
    target = resolve_accuracy(accuracy)
    if initial_state not in ("relaxed", "glassy"):
        raise ValueError(f"initial_state must be 'relaxed' or 'glassy'; received {shown(initial_state)}")
    load_kernels()
    path = history_of(protocol, scene.tabor)
    seconds = 0.0
    for refinement in range(_MOST_REFINEMENTS + 1):
        wanted = target.target / 2.0**refinement
        try:
            run = _prepare(scene, path, Accuracy(target.name, wanted), mesh)
        except MemoryError as error:
            if refinement == 0:
                return _not_started(str(error), wanted, len(scene.material.strengths))
            break
        started = time.perf_counter()
        if has_curve(run.problem):
            result = march_elastic(run.problem, run.times, run.controls)
        else:
            result = interruptible(march, *run, initial_state == "glassy", MOST_STEPS)
        seconds += time.perf_counter() - started
        aim = wanted
        # On a mesh too coarse for its scene the contact may find no equilibrium at a fold; a finer one is tried then.
        if result.outcome in (COMPLETED, TOO_MANY_STEPS, DETACHED):
            break
    return _trajectory(run.problem, scene, path, aim, result, seconds)


@functools.cache
def load_kernels() -> None:
    """Compile the solver's kernels, or load them from the cache, by following a tiny contact once."""
    announce_compilation()
    scene, path = Scene(tabor=1.0, adhesion=HardContact()), PiecewiseLinearProtocol([0.0, 1.0], [0.0, 0.1])
    interruptible(march, *_prepare(scene, path, resolve_accuracy("draft"), np.linspace(0.0, 2.0, 5)), False, 3)
    note_compilation()


def count_unstable(scene: Scene, protocol: Protocol, accuracy: str | float = "standard") -> int:
    """Number of states along a trajectory that are no stable equilibria, each checked again; zero if all is well."""
    run = _prepare(scene, history_of(protocol, scene.tabor), resolve_accuracy(accuracy), audit=True)
    return work_by_name(interruptible(march, *run, False, MOST_STEPS).work)["unstable"]


class _Run(NamedTuple):
    """What `march` is called with."""

    problem: Problem
    mesh: Mesh
    times: np.ndarray
    controls: np.ndarray


def _prepare(
    scene: Scene,
    path: _Path,
    accuracy: Accuracy,
    mesh: ArrayLike | None = None,
    audit: bool = False,
) -> _Run:
    deepest, adhesive = deepest_indentation(scene, path), not isinstance(scene.adhesion, HardContact)
    by_force = isinstance(path, ForceProtocol)
    on_curve = mesh is None and not audit and not by_force and prefers_curve(scene, deepest)
    controls = _for_law(accuracy.controls(_edge_resistance(scene, path, deepest) if adhesive else 0.0, adhesive), scene)
    problem, own_mesh = discretise(scene, deepest, controls, mesh, audit, by_force, on_curve)
    if problem.series.size:  # a grid that moves interpolates by lines
        controls = _for_law(accuracy.line_controls(elastic=scene.material.strengths.size == 0), scene)
        problem, own_mesh = discretise(scene, deepest, controls, mesh, audit, by_force, on_curve)
    values = path.forces if isinstance(path, ForceProtocol) else path.indentations
    return _Run(problem, own_mesh, np.array(path.times), np.array(values))


def _for_law(controls: Controls, scene: Scene) -> Controls:
    """Controls with the spacing at the edge that the traction law takes."""
    if isinstance(scene.adhesion, TractionLaw):
        return controls._replace(edge_spacing=scene.adhesion.fineness * controls.edge_spacing)
    return controls


def _edge_resistance(scene: Scene, path: _Path, deepest: float) -> float:
    """How much viscosity holds the edge back where it is slowest; nothing under a force, where the sphere may stop."""
    if isinstance(path, ForceProtocol):
        return 0.0
    radius = largest_contact_radius(deepest, scene.tabor, False)
    speeds = np.abs(path.rates)
    slowest = float(np.min(speeds[speeds > 0.0], initial=np.inf))
    slowest = slowest if np.isfinite(slowest) else 0.0  # nothing moves but the edge itself
    if scene.spring is not None:  # it takes up part of the stage's motion
        depth = max(deepest, 1.0)
        slowest /= 1.0 - 1.5 * float(hertz.force_from_indentation(depth, scene.tabor)) / depth / scene.spring
    return edge_resistance(scene.tabor, radius, slowest, scene.material.strengths, scene.material.times)


def _trajectory(
    problem: Problem, scene: Scene, path: _Path, target: float, result: Marched, seconds: float
) -> Trajectory:
    records, jumps = result.records, result.jumps
    work = work_by_name(result.work)
    stats = Statistics(
        **{name: work[name] for name in _STATISTICS},
        steps_by_phase=by_phase(path.phases, result.segment_steps.tolist()),
        memory_vectors=problem.strengths.size,
        nodes=work["nodes"] / max(work["steps"], 1),
        unknowns_per_solve=work["unknowns"] / max(work["iterations"], 1),
        grid_nodes=problem.grid.size,
        seconds=seconds,
    )
    status = _REASONS[result.outcome]
    if not len(records):
        return _not_started(status.removeprefix("detached: "), target, problem.strengths.size)
    if result.outcome != COMPLETED:
        status = f"{status} (at time {records[-1, 0]:.6g}, indentation {records[-1, 1]:.6g})"
    unloading = _in_phase(records[:, 0], path, "unloading")
    by_force = problem.machine.by_force
    if isinstance(path, PiecewiseLinearProtocol):
        if scene.spring is not None:  # the corners of the path and its end are those of the stage
            records[:, 1] = path.indentation_at(records[:, 0])
        records, unloading = with_peaks(records, unloading)
    found = tuple(Jump(*map(float, row)) for row in jumps)
    balances = problem.strengths.size == 0 and result.outcome != DETACHED
    balance = _energy_balance(records, result.energies, found, target) if balances else np.nan
    if scene.spring is not None and not by_force:
        records[:, 1] += records[:, 2] / scene.spring
    instants, depths, force, radii = (np.ascontiguousarray(records[:, k]) for k in range(4))
    return Trajectory(
        instants,
        depths,
        force,
        radii,
        status=status,
        jumps=found,
        stats=stats,
        accuracy=target,
        unloading=unloading,
        energy_balance=balance,
        spring=scene.spring,
        by_force=by_force,
    )


def _not_started(reason: str, target: float, terms: int) -> Trajectory:
    """An empty trajectory: the scene is known to be out of reach before the first step."""
    empty = np.zeros(0)
    return Trajectory(
        empty,
        empty,
        empty,
        empty,
        status=f"not started: {reason}",
        jumps=(),
        stats=Statistics(memory_vectors=terms),
        accuracy=target,
        unloading=np.zeros(0, bool),
    )


def _energy_balance(records: np.ndarray, energies: np.ndarray, jumps: tuple[Jump, ...], target: float) -> float:
    """Work put into an elastic contact; back at the same indentation and force, it is in the same state as before."""
    lost = sum(jump.energy_lost for jump in jumps)
    first, last = records[0], records[-1]
    returned = first[1] == last[1] and abs(last[2] - first[2]) < target * max(1.0, abs(first[2]))
    return float(lost if returned else lost + energies[1] - energies[0])


def _in_phase(instants: np.ndarray, path: _Path, phase: str) -> np.ndarray:
    inside = np.zeros(instants.size, dtype=bool)
    for begin, end, name in zip(path.times[:-1], path.times[1:], path.phases, strict=True):
        if name == phase:
            inside |= (instants >= begin) & (instants <= end)
    return inside

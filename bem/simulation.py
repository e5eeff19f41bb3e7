"""`simulate`: compute the trajectory of a scene under a protocol."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from numbers import Integral
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import compilation
from bem._support.validation import finite_number, instance, whole_number
from bem._support.wording import shown
from bem.methods.boundary_elements.discrete_problem import Path, deepest_indentation, least_force, problem_of
from bem.methods.boundary_elements.history import march
from bem.methods.elastic_curve.trajectory import march_elastic
from bem.methods.outcomes import COMPLETED, DETACHED
from bem.methods.physical_bounds import most_tension, within_bounds
from bem.methods.records import (
    MOST_OF_A_DRAFT,
    MOST_WORK,
    MarchResult,
    columns_of,
    profiles_of,
    with_peaks,
    work_by_name,
)
from bem.methods.sharp_crack import STEP_ERROR, ZoneError, is_sharp, least_error, load_steps, march_crack
from bem.methods.without_adhesion.hard_contact import follow_hard_contact
from bem.problem.accuracy import LOOSEST, NAMED_TARGETS, Accuracy, resolve_accuracy
from bem.problem.indenter import PARABOLOID, tension_without_deformation
from bem.problem.materials import Elastic, StandardLinearSolid
from bem.problem.negligible_effects import SimplifiedScene, simplified_scene
from bem.problem.protocol import (
    ForceProtocol,
    LoadingProtocol,
    PiecewiseLinearProtocol,
    Protocol,
    by_phase,
    history_of,
    in_phase,
)
from bem.problem.scene import Scene
from bem.problem.tractions import HardContact, TractionLaw
from bem.results.profiles import MOST_PROFILES, checked_instants, informative_instants
from bem.results.trajectory import Jump, Statistics, Trajectory

_MOST_REFINEMENTS = 3  # each halves the target error
_FINENESS = 0.5, 1, 4  # of the steps of a sharp crack; the first is for drafts
_LARGE = 10.0  # Tabor parameter from which a sharp crack says first what boundary elements would cost
_NEAR = 3.0  # excess of the expected error of a crack, over the target, for which a few seconds are spent to avoid it
_WORK_OF_TRAVEL = 1e7  # multiply-adds of an edge that travels by beta / mu^2, at standard accuracy
_FLAT, _LONG_RANGED = 4.0, 1.5  # exponent of the profile above, and Tabor parameter below which steep laws end at a rim
_STATISTICS = ("steps", "rejections", "iterations", "factorisations")


def simulate(
    scene: Scene,
    protocol: Protocol,
    accuracy: str | float = "standard",
    *,
    initial_state: Literal["relaxed", "glassy"] = "relaxed",
    mesh: ArrayLike | None = None,
    profiles: ArrayLike | int | None = None,
    most_work: float | None = None,
) -> Trajectory:
    """Compute the force history of a scene under a protocol.

    Args:
        scene: Tabor parameter, material, adhesion, spring and indenter; only the effects it names are simulated.
        protocol: `LoadingProtocol`, any `PiecewiseLinearProtocol` (cycles and hold), or a `ForceProtocol` (load
            control, creep). In a scene with a spring the first two move the stage.
        accuracy: "draft", "standard", "reference", or the wanted relative error of pull-off force and hysteresis (2e-5
            to 0.05). Draft is for looking, standard for data sets, reference for checking; `docs/cost.md` has
            what each costs.
        initial_state: "relaxed", as if the sphere had been at its start for ever, or "glassy", as if it had just
            arrived there.
        mesh: radii (n,) in beta, from 0 upwards, of a fixed mesh of your own, e.g.
            `bem.methods.boundary_elements.meshes.mesh.uniform_mesh`; by default nodes follow the edge.
        profiles: instants (p,) at which the trajectory keeps gap, traction and displacement over the radius, increasing
            and within the protocol; or about how many (2 to 10,000), which are then placed where the history changes,
            by a simulation that is run before. None by default.
        most_work: budget in multiply-adds, 1e3 to 1e18, of all attempts together; the default is about a minute of one
            core, or a few seconds where the target is that of a draft or looser, or a sharp crack answers nearly as
            exactly. A trajectory that needs more ends where the budget does.

    Returns:
        the trajectory. Its `accuracy` is the target, a tighter one where the coarse mesh found no way through, or of a
        sharp crack the error that is expected; the `status` says where that is more than the target, because boundary
        elements could not do it. The status begins with "completed" or says where and why the trajectory ended;
        the scalar results of an unfinished one are NaN.

    Raises:
        ValueError: for input that is not a scene, a protocol, an accuracy, an initial state, a mesh or instants, naming
            what is allowed.

    Source: paper, Methods and Appendix "BEM discretisation details"; differences from it are listed in `bem/README.md`.
    """
    instance("scene", scene, (Scene,))
    instance("protocol", protocol, (LoadingProtocol, PiecewiseLinearProtocol, ForceProtocol))
    target = resolve_accuracy(accuracy)
    budget = _budget(most_work, target)
    if initial_state not in ("relaxed", "glassy"):
        raise ValueError(f"initial_state must be 'relaxed' or 'glassy'; received {shown(initial_state)}")
    path = history_of(protocol, scene.tabor)
    glassy = initial_state == "glassy"
    if mesh is None and profiles is None and isinstance(scene.adhesion, HardContact):
        load_kernels("no adhesion")
        started = time.perf_counter()
        result, method = follow_hard_contact(scene, path, target, glassy, budget)
        result = _checked(result, scene, path, target.target)
        if not result.outcome.needs_a_finer_mesh:
            return _trajectory(scene, path, target.target, result, budget, method, time.perf_counter() - started)
    instants = np.empty(0)
    if isinstance(profiles, Integral):
        count = whole_number("profiles", profiles, low=2, high=MOST_PROFILES)
        first = _followed(scene, path, target, glassy, mesh, instants, budget)
        if not first.completed:
            return _without_profiles(first, scene)
        instants = informative_instants(first, count)
    elif profiles is not None:
        instants = checked_instants(profiles, path.times)
    if mesh is not None or profiles is not None:  # of the scene as it is
        return _without_profiles(_followed(scene, path, target, glassy, mesh, instants, budget), scene)
    simplified = simplified_scene(scene, path, target.target, glassy)
    trajectory = _on_branch(simplified.scene, path, target, budget) or _of_large_tabor(
        simplified.scene, path, target, glassy, most_work
    )
    return _rescaled(trajectory, scene, simplified) if simplified.left_out else trajectory


def _without_profiles(trajectory: Trajectory, scene: Scene) -> Trajectory:
    """The trajectory; where boundary elements could not start, its status says that no other method has profiles."""
    if trajectory.time.size or not is_sharp(scene):
        return trajectory
    return replace(trajectory, status=f"{trajectory.status}; a sharp crack has neither profiles nor a mesh")


def _rescaled(trajectory: Trajectory, scene: Scene, simplified: SimplifiedScene) -> Trajectory:
    """The trajectory of a simplified scene in the units of the one asked for, behind its spring."""
    stats = replace(trajectory.stats, left_out=simplified.left_out, left_out_error=simplified.error)
    radius, depth = trajectory.contact_radius * math.sqrt(simplified.scene.tabor / scene.tabor), trajectory.indentation
    if scene.spring is not None and simplified.scene.spring is None:
        depth = depth + trajectory.force / scene.spring
    return replace(trajectory, stats=stats, contact_radius=radius, indentation=depth, spring=scene.spring)


def _on_branch(scene: Scene, path: Path, target: Accuracy, budget: float) -> Trajectory | None:
    """The trajectory of an elastic contact with adhesion, or None for others, and where its curve is not followed."""
    # The rim at which attraction ends far outside the contact may be too narrow for the meshes of the branch.
    steep = isinstance(scene.adhesion, TractionLaw) and scene.adhesion.fineness < 1.0
    narrow = steep and scene.exponent > _FLAT and scene.tabor < _LONG_RANGED
    if scene.material.strengths.size or isinstance(scene.adhesion, HardContact) or narrow:
        return None
    load_kernels("elastic curve")
    started = time.perf_counter()
    try:
        result = march_elastic(scene, path, target, *prescribed(path), budget)
    except MemoryError:
        return None
    result = _checked(result, scene, path, target.target)
    if result.outcome.needs_a_finer_mesh:
        return None
    return _trajectory(scene, path, target.target, result, budget, "elastic branch", time.perf_counter() - started)


def _of_large_tabor(scene: Scene, path: Path, target: Accuracy, glassy: bool, most_work: float | None) -> Trajectory:
    """The trajectory by a sharp crack where its expected error is small enough, else by boundary elements.

    Of a large Tabor parameter the crack comes first. Boundary elements are then begun only where they are expected to
    end within the budget, and where they do not, the crack answers all the same and its status says why.
    """
    budget, large = _budget(most_work, target), scene.tabor >= _LARGE
    least, crack = least_error(scene, path, _FINENESS[-1]) if is_sharp(scene) else math.inf, None
    if least <= (LOOSEST if large else target.target):
        crack = _as_crack(scene, path, target, target.target, glassy, budget)
    if crack and crack.accuracy <= target.target:
        return crack
    if crack and large and crack.accuracy <= LOOSEST:
        if most_work is None:  # the nearer the crack is, the less is worth the wait
            budget = min(budget, MOST_OF_A_DRAFT * (crack.accuracy / target.target - 1.0) / _NEAR)
        work = _work_of_elements(crack, scene.tabor, target)
        if work > budget:
            reason = f"boundary elements take about {work:.0e} multiply-adds, more than {budget:.0e}"
            return _in_place(crack, target, reason)
    stepped = _followed(scene, path, target, glassy, None, np.empty(0), budget)
    if stepped.completed or least > LOOSEST:
        return stepped
    crack = crack or _as_crack(scene, path, target, LOOSEST, glassy, budget)
    if not crack or crack.accuracy > LOOSEST:
        return stepped
    return _in_place(crack, target, stepped.status.removeprefix("not started: "))


def _in_place(crack: Trajectory, target: Accuracy, reason: str) -> Trajectory:
    """The trajectory of a crack that errs more than the target, which its status says."""
    status = f"{crack.status} (accuracy {crack.accuracy:.2g} in place of {target.target:g}: {reason})"
    return replace(crack, status=status)


def _work_of_elements(crack: Trajectory, tabor: float, target: Accuracy) -> float:
    """Multiply-adds that boundary elements take about: in proportion to the way of the edge, in widths of its zone."""
    radius = crack.contact_radius
    touching = (radius[1:] > 0.0) & (radius[:-1] > 0.0)
    travel = tabor**2 * float(np.abs(np.diff(radius))[touching].sum())
    return _WORK_OF_TRAVEL * travel * NAMED_TARGETS["standard"] / target.target


def _budget(most_work: float | None, target: Accuracy) -> float:
    """Multiply-adds: those that are asked for, or the default of a target."""
    if most_work is None:
        return MOST_OF_A_DRAFT if target.target >= NAMED_TARGETS["draft"] else MOST_WORK
    return finite_number("most_work", most_work, low=1e3, high=1e18)


def _as_crack(
    scene: Scene, path: Path, target: Accuracy, largest: float, glassy: bool, budget: float
) -> Trajectory | None:
    """The trajectory of a contact with a sharp edge, of its expected error; None where there is no answer.

    Steps and nodes are finer where that brings the error to `largest` or below.
    """
    load_kernels("sharp crack")
    started = time.perf_counter()
    try:
        for fineness in _FINENESS[target.target < NAMED_TARGETS["draft"] :]:
            result, error = march_crack(scene, path, glassy=glassy, most_work=budget, fineness=fineness)
            if not largest < error < largest + STEP_ERROR * (1.0 / fineness - 1.0 / _FINENESS[-1]):
                break
    except ZoneError:
        return None
    borne = result.records.size > 0  # the first force
    if result.outcome not in (COMPLETED, DETACHED) or (borne and math.isnan(error)):
        return None
    error = math.ceil(1e4 * error) / 1e4 if borne else 0.0
    return _trajectory(scene, path, error, result, budget, "sharp crack", time.perf_counter() - started)


def _checked(result: MarchResult, scene: Scene, path: Path, target: float) -> MarchResult:
    """The result, whose outcome says so where it breaks a bound."""
    return within_bounds(result, scene, least_force(scene, deepest_indentation(scene, path)), target)


def _followed(
    scene: Scene,
    path: Path,
    target: Accuracy,
    glassy: bool,
    mesh: ArrayLike | None,
    instants: np.ndarray,
    budget: float,
) -> Trajectory:
    load_kernels("boundary elements")
    seconds, spent = 0.0, 0
    for refinement in range(_MOST_REFINEMENTS + 1):
        # Looser targets have the mesh of a draft: half of it is the first finer one.
        coarse = min(target.target, NAMED_TARGETS["draft"]) if refinement else target.target
        tightened = coarse / 2.0**refinement
        try:
            problem = problem_of(scene, path, Accuracy(tightened), mesh)
        except MemoryError as error:
            if refinement == 0:
                return _not_started(str(error), tightened, len(scene.material.strengths))
            break
        started = time.perf_counter()
        result = march(problem, *prescribed(path), instants, glassy, budget - spent)
        result = _checked(result, scene, path, tightened)
        seconds += time.perf_counter() - started
        spent += work_by_name(result.work)["multiply_adds"]
        aim, attempts = tightened, refinement + 1
        # On a mesh too coarse for its scene the contact may find no equilibrium at a fold; a finer one is tried then.
        if not result.outcome.needs_a_finer_mesh:
            break
    failed = attempts - (not result.outcome.needs_a_finer_mesh)
    trajectory = _trajectory(scene, path, aim, result, budget, "boundary elements", seconds)
    if instants.size:
        trajectory = replace(trajectory, profiles=profiles_of(result.profiles, instants, scene.tabor, scene.exponent))
    nodes = problem.scheme.grid.size
    stats = replace(trajectory.stats, attempts=attempts, failed_attempts=failed, multiply_adds=spent, grid_nodes=nodes)
    status = trajectory.status
    if attempts > 1:
        tried = f"{failed} failed attempt{'s' * (failed > 1)}"
        status += f" (accuracy tightened from {target.target:g} to {aim:g} after {tried})"
    return replace(trajectory, status=status, stats=stats)


def load_kernels(*names: str) -> None:
    """Compile what answers a scene, or load it from the cache, by following a tiny contact once.

    Args:
        names: "boundary elements", "elastic curve", "no adhesion" and "sharp crack", as far as they will be used; by
            default all but the last, which only large Tabor parameters need.
    """
    names = names or tuple(_KERNELS)[:-1]
    for number, name in enumerate(names):
        if name not in _loaded:
            seconds, load = _KERNELS[name]
            with compilation(names, number, seconds):
                load()
            _loaded.add(name)


def _load_boundary_elements() -> None:
    scene, path = Scene(tabor=1.0, adhesion=HardContact()), PiecewiseLinearProtocol([0.0, 1.0], [0.0, 0.1])
    problem = problem_of(scene, path, resolve_accuracy("draft"), np.linspace(0.0, 2.0, 5))
    march(problem, *prescribed(path), np.empty(0), False, 1e4)


def _load_elastic_curve() -> None:
    path = PiecewiseLinearProtocol([0.0, 1.0], [-2.0, 0.1])  # with a jump
    march_elastic(Scene(tabor=1.0), path, resolve_accuracy("draft"), *prescribed(path), MOST_WORK)


def _load_hard_contact() -> None:
    path = PiecewiseLinearProtocol([0.0, 1.0], [0.0, 0.1])
    for material in (Elastic(), StandardLinearSolid(0.5)):
        scene = Scene(tabor=1.0, material=material, adhesion=HardContact())
        follow_hard_contact(scene, path, resolve_accuracy("draft"), False, 1e4)


_KERNELS = {
    "boundary elements": (30.0, _load_boundary_elements),
    "elastic curve": (12.0, _load_elastic_curve),
    "no adhesion": (6.0, _load_hard_contact),
    "sharp crack": (25.0, load_steps),
}
"""What is compiled together, with the seconds of one core that it takes."""
_loaded: set[str] = set()


def count_unstable(scene: Scene, protocol: Protocol, accuracy: str | float = "standard") -> int:
    """Number of states along a trajectory that are no stable equilibria, each checked again; zero if all is well.

    The states are those of the boundary elements. Without adhesion every state is stable. Two negative eigenvalues at
    once are not seen.

    Raises:
        RuntimeError: the trajectory was not completed.
    """
    if isinstance(scene.adhesion, HardContact):
        return 0
    load_kernels("boundary elements")
    path = history_of(protocol, scene.tabor)
    problem = problem_of(scene, path, resolve_accuracy(accuracy), audit=True)
    result = march(problem, *prescribed(path), np.empty(0), False, MOST_WORK)
    if result.outcome not in (COMPLETED, DETACHED):
        raise RuntimeError(result.outcome.status(MOST_WORK))
    return work_by_name(result.work)["unstable"]


def prescribed(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Instants (s,) and what the path prescribes at them (s,), as arrays of its own for the kernels."""
    return np.array(path.times), np.array(path.forces if isinstance(path, ForceProtocol) else path.indentations)


def _trajectory(
    scene: Scene, path: Path, target: float, result: MarchResult, budget: float, method: str, seconds: float
) -> Trajectory:
    records, jumps = result.records, result.jumps
    work, terms = work_by_name(result.work), scene.material.strengths.size
    counts: dict[str, Any] = {name: work[name] for name in _STATISTICS}
    stats = Statistics(
        **counts,
        method=method,
        steps_by_phase=by_phase(path.phases, result.segment_steps.tolist()),
        memory_vectors=terms,
        nodes=work["nodes"] / max(work["steps"], 1),
        unknowns_per_solve=work["unknowns"] / max(work["iterations"], 1),
        multiply_adds=work["multiply_adds"],
        seconds=seconds,
    )
    status = result.outcome.status(budget)
    if not len(records):
        return _not_started(status.removeprefix("detached: "), target, terms)
    if result.outcome != COMPLETED:
        status = f"{status} (at time {records['time'][-1]:.6g}, indentation {records['indentation'][-1]:.6g})"
    unloading = in_phase(path, records["time"], "unloading")
    by_force = isinstance(path, ForceProtocol)
    if isinstance(path, PiecewiseLinearProtocol):
        if scene.spring is not None:  # the corners of the path and its end are those of the stage
            records["indentation"] = path.indentation_at(records["time"])
        if method == "boundary elements":
            records, unloading = with_peaks(records, unloading, most_tension(scene) * (1.0 + target))
    attraction = 1.0
    if scene.indenter is not None:
        gap = 1.0 - min(float(records["indentation"][-1]), 0.0)
        at = (tension_without_deformation(scene.tabor, n, gap) for n in (scene.exponent, PARABOLOID))
        attraction = next(at) / next(at)
    jump_tuple = tuple(Jump(*row) for row in jumps.tolist())
    balances = terms == 0 and result.outcome != DETACHED
    balance = _energy_balance(records, result.energies, jump_tuple, target) if balances else np.nan
    if scene.spring is not None and not by_force:
        records["indentation"] += records["force"] / scene.spring
    return Trajectory(
        *columns_of(records),
        status=status,
        jumps=jump_tuple,
        stats=stats,
        accuracy=target,
        unloading=unloading,
        energy_balance=balance,
        spring=scene.spring,
        by_force=by_force,
        attraction=attraction,
    )


def _not_started(reason: str, target: float, terms: int) -> Trajectory:
    """An empty trajectory: the scene is known to be out of reach before the first step."""
    empty, stats = np.zeros(0), Statistics(memory_vectors=terms)
    status = f"not started: {reason}"
    return Trajectory(
        empty, empty, empty, empty, status=status, jumps=(), stats=stats, accuracy=target, unloading=np.zeros(0, bool)
    )


def _energy_balance(records: np.ndarray, energies: np.ndarray, jumps: tuple[Jump, ...], target: float) -> float:
    """Work put into an elastic contact; back at the same indentation and force, it is in the same state as before."""
    lost = sum(jump.energy_lost for jump in jumps)
    first, last = records[0], records[-1]
    depth, force = first["indentation"], first["force"]
    returned = depth == last["indentation"] and abs(last["force"] - force) < target * max(1.0, abs(force))
    return float(lost if returned else lost + energies[1] - energies[0])

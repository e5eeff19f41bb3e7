"""The one door in: a scene and a protocol become a trajectory."""

from __future__ import annotations

import functools
import time
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import announce_compilation
from bem._support.peaks import with_peaks
from bem._support.validation import instance
from bem._support.wording import shown
from bem.accuracy import Accuracy, resolve_accuracy
from bem.protocol import LoadingProtocol, PiecewiseLinearProtocol
from bem.reference_solutions import hertz
from bem.scene import Scene
from bem.solver.discretisation.cohesive_zone import largest_contact_radius
from bem.solver.discretisation.influence import require_mesh
from bem.solver.discretisation.mesh import Grid, Mesh, fixed_mesh, master_grid
from bem.solver.state import COUNTS, Problem
from bem.solver.time_stepping import COMPLETED, NO_EQUILIBRIUM, TOO_MANY_STEPS, UNPHYSICAL, march
from bem.tractions import HardContact
from bem.trajectory import Jump, Statistics, Trajectory

MOST_STEPS = 400_000
_NOISE = 0.04
_LOCAL_WEIGHT_ELASTIC = 0.1  # what happens at the edge matters to the next step only where it is remembered
_MOST_REFINEMENTS = 3  # each halves the target error
_REASONS = {
    COMPLETED: "completed",
    NO_EQUILIBRIUM: "no stable equilibrium found; try a tighter accuracy",
    TOO_MANY_STEPS: f"stopped after {MOST_STEPS} steps; try a looser accuracy or a shorter protocol",
    UNPHYSICAL: "force beyond what the history allows; try a tighter accuracy",
}


def simulate(
    scene: Scene,
    protocol: LoadingProtocol | PiecewiseLinearProtocol,
    accuracy: str | float = "standard",
    *,
    initial_state: Literal["relaxed", "glassy"] = "relaxed",
    mesh: ArrayLike | None = None,
) -> Trajectory:
    """Compute the force history of a scene under a protocol.

    Args:
        scene: Tabor parameter, material and adhesion; only the effects it names are simulated.
        protocol: `LoadingProtocol`, or any `PiecewiseLinearProtocol` (cycles, creep and hold).
        accuracy: "draft", "standard", "reference", or the wanted relative error of pull-off force and hysteresis (2e-5
            to 0.05). Draft is for looking, standard for data sets, reference for checking; `docs/cost.md` has
            what each costs.
        initial_state: "relaxed", as if the sphere had stood at its start for ever, or "glassy", as if it had just been
            put there.
        mesh: radii (n,) in beta, from 0 upwards, of a fixed mesh of your own, e.g.
            `bem.solver.discretisation.mesh.uniform_mesh`; by default nodes follow the edge.

    Returns:
        the trajectory. Its `accuracy` is the target, or a tighter one where the coarse mesh found no way through. Its
        `status` is "completed" or says where and why it ended; no number of an unfinished one looks finished.

    Raises:
        ValueError: for input that is not a scene, a protocol, an accuracy, an initial state or a mesh, naming what is
            allowed.

    Source: paper, Methods and Appendix "BEM discretisation details"; differences from it are listed in `bem/README.md`.
    """
    instance("scene", scene, (Scene,))
    instance("protocol", protocol, (LoadingProtocol, PiecewiseLinearProtocol))
    target = resolve_accuracy(accuracy)
    if initial_state not in ("relaxed", "glassy"):
        raise ValueError(f"initial_state must be 'relaxed' or 'glassy'; received {shown(initial_state)}")
    history = protocol.history(scene.tabor) if isinstance(protocol, LoadingProtocol) else protocol
    deepest = float(np.max(history.indentations))
    load_kernels()
    seconds = 0.0
    for refinement in range(_MOST_REFINEMENTS + 1):
        wanted = target.target / 2.0**refinement
        controls = Accuracy(target.name, wanted).controls(elastic=scene.material.strengths.size == 0)
        try:
            problem, own_mesh = _discretise(scene, deepest, controls, mesh)
        except MemoryError as error:
            if refinement == 0:
                return _unfinished(str(error), wanted, len(scene.material.strengths))
            break
        arguments = (np.array(history.times), np.array(history.indentations), initial_state == "glassy", MOST_STEPS)
        started = time.perf_counter()
        result = march(problem, own_mesh, *arguments)
        seconds += time.perf_counter() - started
        aim = wanted
        # A mesh too coarse for its scene can lose its way at a fold: what is asked for is then worth a finer one.
        if result[-1] in (COMPLETED, TOO_MANY_STEPS):
            break
    return _trajectory(problem, history, aim, *result, seconds)


@functools.cache
def load_kernels() -> None:
    """Compile the solver's kernels, or load them from the cache, by following a tiny contact once."""
    announce_compilation()
    target = resolve_accuracy("draft").controls()
    radii = np.linspace(0.0, 2.0, 5)
    problem, mesh = _discretise(Scene(tabor=1.0, adhesion=HardContact()), 1.0, target, radii)
    march(problem, mesh, np.array([0.0, 1.0]), np.array([0.0, 0.1]), False, 3)


def count_unstable(
    scene: Scene, protocol: LoadingProtocol | PiecewiseLinearProtocol, accuracy: str | float = "standard"
) -> int:
    """Number of states along a trajectory that are no stable equilibria, each looked at again; zero if all is well."""
    target = resolve_accuracy(accuracy)
    history = protocol.history(scene.tabor) if isinstance(protocol, LoadingProtocol) else protocol
    controls = target.controls(elastic=scene.material.strengths.size == 0)
    problem, own_mesh = _discretise(scene, float(np.max(history.indentations)), controls, None, audit=True)
    counts = march(problem, own_mesh, np.array(history.times), np.array(history.indentations), False, MOST_STEPS)[2]
    return int(counts[COUNTS.index("unstable")])


def _discretise(
    scene: Scene, deepest: float, controls, mesh: ArrayLike | None, audit: bool = False
) -> tuple[Problem, Mesh]:
    """The problem in the kernels' terms, and the user's own mesh, empty where there is none."""
    hard = isinstance(scene.adhesion, HardContact)
    tabor, material = scene.tabor, scene.material
    strengths, times = np.array(material.strengths), np.array(material.times)
    glassy_hertz = float(hertz.force_from_indentation(max(deepest, 0.0), tabor)) / material.modulus_ratio
    force_scale = max(3e-2 * abs(glassy_hertz) * material.modulus_ratio, 1e-12) if hard else 1.0
    # The stiffer the glass, the fewer steps the gaps alone would give to a fast pull-off.
    force_weight = min(max(2.0, 0.2 / material.modulus_ratio), 20.0)
    # Extrapolation adds the errors of three states up to sevenfold; the step must not be chosen by them.
    force_error = _NOISE * controls.prediction / force_weight
    least_force = 1.05 * glassy_hertz - 4.0 / material.modulus_ratio
    radii = np.zeros(0)
    if mesh is not None:
        radii = require_mesh(mesh)
        contact = largest_contact_radius(deepest, tabor, hard)
        if radii[-1] <= contact:
            raise ValueError(
                f"mesh must reach beyond the contact, whose radius can be {contact:.4g}; received one that ends at "
                f"{radii[-1]:.4g}"
            )
        grid = Grid(radii.size, 0.0, np.zeros((0, 0)))
    else:
        grid = master_grid(tabor, deepest, hard, controls)
    problem = Problem(
        tabor=tabor,
        hard=hard,
        strengths=strengths,
        times=times,
        controls=controls,
        grid=grid,
        fixed_mesh=mesh is not None,
        force_scale=force_scale,
        force_weight=force_weight,
        local_weight=1.0 if strengths.size else _LOCAL_WEIGHT_ELASTIC,
        force_error=force_error,
        least_force=least_force,
        audit=audit,
    )
    return problem, fixed_mesh(tabor, radii, strengths.size > 0)


def _trajectory(
    problem, history, target, records, jumps, counts, segment_steps, energies, outcome, seconds
) -> Trajectory:
    by_name = dict(zip(COUNTS, (int(value) for value in counts), strict=True))
    steps_by_phase: dict[str, int] = {}
    for phase, steps in zip(history.phases, segment_steps, strict=True):
        steps_by_phase[phase] = steps_by_phase.get(phase, 0) + int(steps)
    stats = Statistics(
        steps=by_name["steps"],
        steps_by_phase=steps_by_phase,
        rejections=by_name["rejections"],
        iterations=by_name["iterations"],
        factorisations=by_name["factorisations"],
        fold_solves=by_name["fold_solves"],
        remeshings=by_name["remeshings"],
        memory_vectors=problem.strengths.size,
        nodes=by_name["nodes"] / max(by_name["steps"], 1),
        unknowns_per_solve=by_name["unknowns"] / max(by_name["iterations"], 1),
        grid_nodes=problem.grid.size,
        seconds=seconds,
    )
    status = _REASONS[outcome]
    if outcome != COMPLETED and len(records):
        status = f"{status} (at time {records[-1, 0]:.6g}, indentation {records[-1, 1]:.6g})"
    unloading = _in_phase(records[:, 0], history, "unloading")
    records, unloading = with_peaks(records, unloading)
    found = tuple(Jump(*map(float, row)) for row in jumps)
    balance = _energy_balance(records, energies, found, target) if problem.strengths.size == 0 else np.nan
    columns = (np.ascontiguousarray(records[:, k]) for k in range(4))
    return Trajectory(
        *columns, status=status, jumps=found, stats=stats, accuracy=target, unloading=unloading, energy_balance=balance
    )


def _energy_balance(records: np.ndarray, energies: np.ndarray, jumps: tuple[Jump, ...], target: float) -> float:
    """Work put into an elastic contact; back at the same indentation and force, it is in the same state as before."""
    lost = sum(jump.energy_lost for jump in jumps)
    first, last = records[0], records[-1]
    returned = first[1] == last[1] and abs(last[2] - first[2]) < target * max(1.0, abs(first[2]))
    return float(lost if returned else lost + energies[1] - energies[0])


def _in_phase(instants: np.ndarray, history: PiecewiseLinearProtocol, phase: str) -> np.ndarray:
    inside = np.zeros(instants.size, dtype=bool)
    for begin, end, name in zip(history.times[:-1], history.times[1:], history.phases, strict=True):
        if name == phase:
            inside |= (instants >= begin) & (instants <= end)
    return inside


def _unfinished(reason: str, target: float, terms: int) -> Trajectory:
    """A trajectory that was not begun, because the reason was known before."""
    empty = np.zeros(0)
    stats = Statistics(0, {}, 0, 0, 0, 0, 0, terms, 0.0, 0.0, 0, 0.0)
    return Trajectory(
        empty,
        empty,
        empty,
        empty,
        status=f"not started: {reason}",
        jumps=(),
        stats=stats,
        accuracy=target,
        unloading=np.zeros(0, bool),
    )

"""The same elastic sphere in other software, in closed forms, by the paper's discretisation and by the solver.

There are three problems, each with one number to find. With the Lennard-Jones law at two Tabor parameters, it is the
largest tension while unloading from an indentation of `START`; the error is relative to the solver's value at
`EXACT_TARGET`, with which two other programs agree (`tests/validation/test_elastic_limits.py`). Without adhesion, it is
the compression at that indentation; the error is relative to Hertz's. Adhesion solves the first two problems, tamaas
the third.

Times are processor seconds of one core, the median of `REPEATS` runs, or one run where other software takes long. Those
of the solver cover the whole loading and unloading; those of Adhesion begin with the relaxed state at `START` and end
soon after the largest tension; those of tamaas cover one state.

The other software uses a square grid on a half-space that is not periodic. The sphere's radius, the equilibrium gap h0
and the work of adhesion are 1. The contact modulus is therefore tabor^(-3/2), and lengths along the surface are
sqrt(tabor) times those of `bem`. Indentation and forces are those of `bem.results.trajectory`.

Sources: `Adhesion.Interactions.Lj82` is the law of `bem.problem.tractions`; for tamaas, Polonsky and Keer, Wear 231
(1999) 206.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from statistics import median
from types import ModuleType
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer

from bem import Elastic, HardContact, LennardJones, LoadingProtocol, Scene, Trajectory, simulate, simulate_paper_method
from bem._support.jit import uncompiled
from bem.methods.boundary_elements.meshes.cohesive_zone import largest_contact_radius
from bem.methods.closed_forms import dmt, hertz, jkr, maugis_dugdale
from bem.problem.tractions import tail_force
from experiments.cases import completed
from experiments.harness import progress, timed
from experiments.measurements.tools import EXACT_TARGET

TABORS = (1.0, 3.0)
HERTZ = "Hertz"
START = 2.0
PROTOCOL = LoadingProtocol(peak_indentation=START, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
ACCURACIES = ("draft", "standard", 0.001, "reference")
NODES = (50, 100, 200)
STEPS = 200
GRIDS = (32, 64, 128, 256)
REPEATS = 5
DEPTHS = np.linspace(-START, START, 120)
PACKAGES = ("Adhesion", "tamaas")
INSTALL = ".venv/bin/python -m pip install --no-build-isolation --editable '.[peers]'"
STEP, FINER = 0.25, 4
"""Indentation between two states while unloading, and the factor by which it is finer near the largest force.

A parabola through the three highest states gives the largest tension.
"""
EDGE_GAP = 5.0
"""Gap at the edge of the grid, in h0; the attraction outside the grid is added in closed form, as in the solver."""
ENOUGH = 0.8  # on a coarse grid the edge retreats node by node; the force then falls and rises, but by less than this
CHANGE = 1e-5  # of the displacement, at which a minimisation ends
LEAST_GAP = 0.6  # of a first guess; the law overflows at smaller gaps
TOLERANCE = 1e-6
MARGIN = 1.1  # half the width of the grid over the contact radius, for a contact without adhesion


def installed() -> dict[str, str]:
    """Versions of the packages.

    Raises:
        RuntimeError: One of them is not installed.
    """
    try:
        return {name: version(name) for name in PACKAGES}
    except PackageNotFoundError as error:
        raise RuntimeError(f"{' and '.join(PACKAGES)} must be installed: {INSTALL}") from error


def sphere(width: float, grid: int) -> np.ndarray:
    """Heights of a paraboloid of radius 1, highest at the node in the middle, (grid, grid)."""
    along = (np.arange(grid) - grid // 2) * width / grid
    return -0.5 * np.add.outer(along**2, along**2)


def force_beyond(half_width: float, indentation: float) -> float:
    """Tension that acts outside a square grid on an undeformed sphere, from the tail of the law."""
    reach = half_width / np.cos(np.linspace(0.0, 0.25 * np.pi, 201))
    return float(np.mean(uncompiled(tail_force)(1.0 + 0.5 * reach**2 - indentation)))


def adhesion_largest_tension(tabor: float, grid: int, start: float) -> float:
    """Largest tension while an elastic sphere is unloaded, by Adhesion with `grid` points a side.

    Every state minimises the energy from the last one, by Newton's method with the package's product of the Hessian
    (`Newton-CG` of SciPy), which takes fewer seconds than its default, L-BFGS. Unloading ends where the force has
    fallen to `ENOUGH` of the largest.

    Raises:
        RuntimeError: A minimisation failed.
    """
    from Adhesion.Interactions import Lj82
    from Adhesion.System import SmoothContactSystem
    from ContactMechanics import FreeFFTElasticHalfSpace
    from SurfaceTopography import Topography

    half_width = math.sqrt(tabor * largest_contact_radius(start, tabor) ** 2 + 2.0 * EDGE_GAP)
    size = (2.0 * half_width, 2.0 * half_width)
    heights = sphere(size[0], grid)
    half_space = FreeFFTElasticHalfSpace((grid, grid), tabor**-1.5, size)
    system = SmoothContactSystem(half_space, Lj82(1.0, 1.0), Topography(heights, physical_sizes=size, periodic=False))

    def state(depth: float, guess: np.ndarray) -> tuple[float, np.ndarray]:
        offset, first = depth - 1.0, guess.copy()
        np.maximum(first[:grid, :grid], heights + offset + LEAST_GAP, out=first[:grid, :grid])
        minimum = system.minimize_proxy(
            offset=offset,
            initial_displacements=first,
            method="Newton-CG",
            hessp=system.hessian_product_function(offset),
            options={"xtol": CHANGE},
        )
        if not minimum.success:
            raise RuntimeError(f"Adhesion found no state at indentation {depth:g}, tabor {tabor:g}: {minimum.message}")
        force = -system.compute_normal_force() / math.pi + force_beyond(half_width, depth)
        return force, minimum.x.reshape(first.shape)

    forces, displacements = list[float](), [np.zeros(half_space.nb_subdomain_grid_pts)]
    while not forces or max(forces) <= 0.0 or forces[-1] > ENOUGH * max(forces):
        force, displacement = state(start - STEP * len(forces), displacements[-1])
        forces.append(force)
        displacements.append(displacement)
    before = max(int(np.argmax(forces)) - 1, 0)
    fine, displacement = [forces[before]], displacements[before + 1]
    for step in range(1, 2 * FINER + 1):
        force, displacement = state(start - STEP * (before + step / FINER), displacement)
        fine.append(force)
    return highest(np.array(fine))


def highest(values: np.ndarray) -> float:
    """Height of the parabola through the largest of equally spaced values (n,) and its neighbours."""
    index = int(np.argmax(values))
    if not 0 < index < len(values) - 1:
        return float(values[index])
    left, top, right = values[index - 1 : index + 2]
    bend = left - 2.0 * top + right
    return float(top - 0.125 * (right - left) ** 2 / bend) if bend < 0.0 else float(top)


def tamaas_hertz(tabor: float, grid: int, indentation: float) -> float:
    """Compression of an elastic sphere without adhesion over Hertz's at the same indentation, by one state of tamaas.

    tamaas finds the pressures for a given force, here Hertz's force at `indentation`. Its indentation is the
    displacement in the middle of the contact, and the forces are compared at that indentation.
    """
    import tamaas

    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.warning)
    modulus, radius = tabor**-1.5, math.sqrt(indentation)
    width = 2.0 * MARGIN * radius
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [width, width], [grid, grid])
    model.E, model.nu = modulus, 0.0
    tamaas.ModelFactory.registerNonPeriodic(model, "half-space")
    solver = tamaas.PolonskyKeerRey(model, sphere(width, grid), TOLERANCE)
    solver.setIntegralOperator("half-space")
    solver.solve(4.0 / 3.0 * modulus * radius**3 / width**2)
    displacement = np.zeros_like(model.displacement)
    model.operators["half-space"](model.traction, displacement)
    force = -float(model.traction.sum()) * (width / grid) ** 2 / math.pi
    return force / float(hertz.force_from_indentation(float(displacement[grid // 2, grid // 2]), tabor))


class Run(NamedTuple):
    """One tool at one setting: the function that finds its number, and how often it is timed."""

    problem: str
    tool: str
    setting: str
    find: Callable[[], float]
    repeats: int = REPEATS


def simulated(tabor: float, accuracy: str | float, *, adhesive: bool = True) -> Trajectory:
    """The elastic sphere by the solver."""
    scene = Scene(tabor, Elastic(), LennardJones() if adhesive else HardContact())
    return completed(simulate(scene, PROTOCOL, accuracy), f"the sphere at {accuracy}")


def by_form(form: ModuleType, tabor: float) -> float:
    """Largest tension by JKR or DMT, which also compute a whole force curve."""
    form.force_from_indentation(DEPTHS, tabor)
    return form.PULL_OFF_FORCE


def runs(finest: int) -> Iterator[Run]:
    """All tools on all problems."""
    for tabor in TABORS:
        problem, scene = f"tabor {tabor:g}", Scene(tabor, Elastic())
        yield Run(problem, "closed form", "JKR", partial(by_form, jkr, tabor))
        yield Run(problem, "closed form", "DMT", partial(by_form, dmt, tabor))
        yield Run(problem, "closed form", "Maugis-Dugdale", partial(maugis_dugdale.pull_off_force, tabor))
        for level in ACCURACIES:
            yield Run(problem, "solver", str(level), lambda mu=tabor, level=level: simulated(mu, level).pull_off_force)
        for nodes in NODES:
            method = partial(simulate_paper_method, scene, PROTOCOL, nodes=nodes, steps=STEPS)
            find = lambda method=method: completed(method(), "the sphere by the paper's method").pull_off_force  # noqa: E731
            yield Run(problem, "paper's discretisation", f"{nodes} nodes", find)
        for grid in (size for size in GRIDS if size <= finest):
            find = partial(adhesion_largest_tension, tabor, grid, START)
            yield Run(problem, "Adhesion", f"{grid} x {grid}", find, 1)
    exact = float(hertz.force_from_indentation(START, TABORS[0]))
    for level in ACCURACIES:
        find = lambda level=level: float(simulated(TABORS[0], level, adhesive=False).force.min()) / exact  # noqa: E731
        yield Run(HERTZ, "solver", str(level), find)
    for grid in GRIDS:
        yield Run(HERTZ, "tamaas", f"{grid} x {grid}", partial(tamaas_hertz, TABORS[0], grid, START), 3)


def measured(run: Run, exact: float) -> dict[str, Any]:
    """Seconds, value and error of a run. The first call, which may load kernels, counts only if it is the only one."""
    values: list[float] = []
    seconds = timed(lambda: values.append(run.find()), run.repeats, first=run.repeats > 1)
    row = {name: getattr(run, name) for name in ("problem", "tool", "setting", "repeats")}
    return row | {"seconds": median(seconds), "value": values[-1], "error": abs(values[-1] / exact - 1.0)}


def study(
    *,
    finest: Annotated[int, typer.Option(help="Largest grid of Adhesion, in points a side: 32, 64, 128 or 256.")] = 128,
) -> dict[str, Any]:
    """Measure every tool on every problem."""
    if finest not in GRIDS:
        raise ValueError(f"finest must be one of {', '.join(map(str, GRIDS))}; received {finest}")
    exact = {f"tabor {tabor:g}": simulated(tabor, EXACT_TARGET).pull_off_force for tabor in TABORS} | {HERTZ: 1.0}
    packages = installed()
    adhesion_largest_tension(TABORS[0], GRIDS[0] // 2, START)  # loads the package
    rows = [measured(problem_run, exact[problem_run.problem]) for problem_run in progress(list(runs(finest)), "tools")]
    return {"packages": packages, "exact": exact, "start": START, "runs": rows}

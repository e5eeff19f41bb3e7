"""The same elastic sphere in other software, in closed forms, by the paper's discretisation and by the solver.

There are three problems, each with one number to find. With the Lennard-Jones law at two Tabor parameters, it is the
largest tension while unloading from an indentation of `START`; the error is relative to the solver's value at
`EXACT_TARGET`, with which two other programs agree (`tests/validation/test_elastic_limits.py`). Without adhesion, it is
the compression at that indentation; the error is relative to Hertz's. Adhesion solves the first two problems, tamaas
the third.

Times are processor seconds of one core, the median of `REPEATS` runs, or one run where other software takes long. Those
of the solver cover the whole loading and unloading; those of Adhesion begin with the relaxed state at `START` and end
soon after the largest tension; those of tamaas cover one state.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from statistics import median
from types import ModuleType
from typing import Annotated, Any

import numpy as np
import typer

from bem import Elastic, HardContact, LennardJones, LoadingProtocol, Scene, Trajectory, simulate, simulate_paper_method
from bem.reference_solutions import dmt, hertz, jkr, maugis_dugdale
from experiments.measurements.cases import completed
from experiments.measurements.harness import progress, timed
from experiments.measurements.other_software import adhesion_largest_tension, installed, tamaas_hertz
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


@dataclass(frozen=True)
class Run:
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
        for one in ACCURACIES:
            yield Run(problem, "solver", str(one), lambda mu=tabor, one=one: simulated(mu, one).pull_off_force)
        for nodes in NODES:
            method = partial(simulate_paper_method, scene, PROTOCOL, nodes=nodes, steps=STEPS)
            find = lambda method=method: completed(method(), "the sphere by the paper's method").pull_off_force  # noqa: E731
            yield Run(problem, "paper's discretisation", f"{nodes} nodes", find)
        for grid in (one for one in GRIDS if one <= finest):
            find = partial(adhesion_largest_tension, tabor, grid, START)
            yield Run(problem, "Adhesion", f"{grid} x {grid}", find, 1)
    exact = float(hertz.force_from_indentation(START, TABORS[0]))
    for one in ACCURACIES:
        find = lambda one=one: float(simulated(TABORS[0], one, adhesive=False).force.min()) / exact  # noqa: E731
        yield Run(HERTZ, "solver", str(one), find)
    for grid in GRIDS:
        yield Run(HERTZ, "tamaas", f"{grid} x {grid}", partial(tamaas_hertz, TABORS[0], grid, START), 3)


def measured(run: Run, exact: float) -> dict[str, Any]:
    """Seconds, value and error of a run. The first call, which may load kernels, counts only if it is the only one."""
    found: list[float] = []
    seconds = timed(lambda: found.append(run.find()), run.repeats, first=run.repeats > 1)
    row = {name: getattr(run, name) for name in ("problem", "tool", "setting", "repeats")}
    return row | {"seconds": median(seconds), "value": found[-1], "error": abs(found[-1] / exact - 1.0)}


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
    rows = [measured(one, exact[one.problem]) for one in progress(list(runs(finest)), "tools")]
    return {"packages": packages, "exact": exact, "start": START, "runs": rows}

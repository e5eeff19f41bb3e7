"""The same elastic sphere in other software, in closed forms, by the paper's discretisation and by the solver.

There are three problems, each with one number to find. With the Lennard-Jones law at two Tabor parameters, it is the
largest tension while unloading from an indentation of `START`; the error is relative to the solver's value at
`EXACT_TARGET`, with which two other programs agree (`experiments/paper_values/independent_solvers.toml`). Without
adhesion, it is the compression at that indentation; the error is relative to Hertz's. Adhesion solves the first two
problems, tamaas the third.

Times are processor seconds of one core, the median of `REPEATS` runs, or one run where other software takes long. Those
of the solver cover the whole loading and unloading; those of Adhesion begin with the relaxed state at `START` and end
soon after the largest tension; those of tamaas cover one state.

Usage: `python -m experiments peers [--finest POINTS] [--out FILE]`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import numpy as np
import typer

from bem import Elastic, HardContact, LennardJones, LoadingProtocol, Scene, Trajectory, simulate, simulate_paper_method
from bem.reference_solutions import dmt, hertz, jkr, maugis_dugdale
from experiments.peers.other_software import INSTALL, PACKAGES, adhesion_largest_tension, installed, tamaas_hertz
from experiments.solver.solver_processes import EXACT_TARGET
from experiments.timing import MEASUREMENTS, NOT_PUBLISHED, Busy, progress, publish, timed

OUT = MEASUREMENTS / "peers.json"
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
    """One tool at one setting: the function that finds its number, its repeats, and the seconds that a run may take."""

    problem: str
    tool: str
    setting: str
    find: Callable[[], float]
    repeats: int = REPEATS
    expected: float = 0.1


def of_tabor(tabor: float) -> str:
    """Name of the adhesive problem at a Tabor parameter."""
    return f"tabor {tabor:g}"


def simulated(tabor: float, accuracy: str | float, *, adhesive: bool = True) -> Trajectory:
    """Simulate the elastic sphere.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    scene = Scene(tabor, Elastic(), LennardJones() if adhesive else HardContact())
    return _completed(simulate(scene, PROTOCOL, accuracy))


def _completed(trajectory: Trajectory) -> Trajectory:
    if not trajectory.completed:
        raise RuntimeError(f"the simulation must complete; received {trajectory.status!r}")
    return trajectory


def adhesive_runs(tabor: float, finest: int, packages: dict[str, str]) -> Iterator[Run]:
    """Tools that find the largest tension; JKR and DMT also compute a whole force curve."""
    problem = of_tabor(tabor)

    def form(name: str, pull_off: float, force: Callable) -> Run:
        return Run(problem, "closed form", name, lambda: (force(DEPTHS, tabor), pull_off)[1])

    yield form("JKR", jkr.PULL_OFF_FORCE, jkr.force_from_indentation)
    yield form("DMT", dmt.PULL_OFF_FORCE, dmt.force_from_indentation)
    yield Run(problem, "closed form", "Maugis-Dugdale", lambda: maugis_dugdale.pull_off_force(tabor))
    for accuracy in ACCURACIES:
        yield Run(problem, "solver", str(accuracy), lambda one=accuracy: simulated(tabor, one).pull_off_force)
    for nodes in NODES:

        def by_the_paper(nodes: int = nodes) -> float:
            return _completed(
                simulate_paper_method(Scene(tabor, Elastic()), PROTOCOL, nodes=nodes, steps=STEPS)
            ).pull_off_force

        yield Run(problem, "paper's discretisation", f"{nodes} nodes", by_the_paper, expected=0.5 * (nodes / 100) ** 2)
    for grid in GRIDS if "Adhesion" in packages else ():
        if grid <= finest:
            seconds = 4.0 * tabor * (grid / 64) ** 2.3
            yield Run(
                problem,
                "Adhesion",
                f"{grid} x {grid}",
                lambda grid=grid: adhesion_largest_tension(tabor, grid, START),
                1,
                seconds,
            )


def hertz_runs(packages: dict[str, str]) -> Iterator[Run]:
    """Tools that find the compression at `START`, relative to Hertz's."""
    tabor = TABORS[0]
    exact = float(hertz.force_from_indentation(START, tabor))
    for accuracy in ACCURACIES:

        def ours(accuracy: str | float = accuracy) -> float:
            trajectory = simulated(tabor, accuracy, adhesive=False)
            return float(trajectory.force.min()) / exact

        yield Run(HERTZ, "solver", str(accuracy), ours)
    for grid in GRIDS if "tamaas" in packages else ():
        seconds = 0.2 * (grid / 64) ** 2.5
        yield Run(HERTZ, "tamaas", f"{grid} x {grid}", lambda grid=grid: tamaas_hertz(tabor, grid, START), 3, seconds)


def measured(run: Run, exact: float) -> dict[str, Any]:
    """Seconds, value and error of a run. The first call, which may load kernels, counts only if it is the only one."""
    found: list[float] = []
    seconds = timed(lambda: found.append(run.find()), run.repeats, first=run.repeats > 1)
    return {
        "problem": run.problem,
        "tool": run.tool,
        "setting": run.setting,
        "seconds": median(seconds),
        "repeats": run.repeats,
        "value": found[-1],
        "error": abs(found[-1] / exact - 1.0),
    }


def main(
    finest: Annotated[int, typer.Option(help="Largest grid of Adhesion, in points a side: 32, 64, 128 or 256.")] = 128,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
    busy: Busy = False,
) -> None:
    """Measure every tool on every problem."""
    if finest not in GRIDS:
        raise ValueError(f"finest must be one of {', '.join(map(str, GRIDS))}; received {finest}")
    packages = installed()
    missing = [name for name in PACKAGES if name not in packages]
    if missing:
        print(f"{' and '.join(missing)} not found and left out; install with {INSTALL}", file=sys.stderr)
    exact = {of_tabor(tabor): simulated(tabor, EXACT_TARGET).pull_off_force for tabor in TABORS} | {HERTZ: 1.0}
    runs = [run for tabor in TABORS for run in adhesive_runs(tabor, finest, packages)] + list(hertz_runs(packages))
    if "Adhesion" in packages:
        adhesion_largest_tension(TABORS[0], GRIDS[0] // 2, START)  # loads the package
    shares = [run.expected * (run.repeats + (run.repeats > 1)) for run in runs]
    rows = [measured(run, exact[run.problem]) for run in progress(runs, "tools", shares=shares)]
    content = {"packages": packages, "missing": missing, "exact": exact, "start": START, "runs": rows}
    place = NOT_PUBLISHED / out.name if missing else out
    publish(place, f"peers --finest {finest}", content, busy=busy)
    for row in rows:
        print(f"{row['problem']:10}{row['tool']:24}{row['setting']:16}{row['seconds']:12.3g} s {row['error']:10.2e}")
    if missing:
        raise RuntimeError(f"the measurement without {' and '.join(missing)} is in {str(place)!r} and not published")

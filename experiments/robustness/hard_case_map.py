"""Difficult cases of the solver: the paper's box, far beyond it, and named extremes.

Each case is simulated at standard accuracy and again with a quarter of the target error. The study reports how the
simulation ended, steps, jumps, seconds, the change of pull-off force and work under refinement, and the energy balance:
the work of the closed loop over the integral of |P d(delta)|, which is never negative in a solid that cannot create
energy. The extremes are also run at coarser accuracies, at which a solver fails first. Random protocols are drawn as in
`experiments.robustness.random_scenes`, inside the box and beyond it.
"""

from typing import Any

import numpy as np

from bem import Elastic, HardContact, LoadingProtocol, PiecewiseLinearProtocol, Scene, StandardLinearSolid, simulate
from bem.methods.closed_forms import jkr
from bem.problem.accuracy import resolve_accuracy
from bem.problem.effects import IndentationProtocol
from bem.problem.protocol import default_start_indentation
from experiments.cases import Case, drawn, rows_of
from experiments.harness import Count, Jobs, Seed, in_parallel, progress

ACCURACY = "standard"
REFINEMENT = 4.0
COARSER = ("draft", 0.05)
CYCLES = 50


def ramp(depth: float, loading: float, dwell: float, unloading: float) -> LoadingProtocol:
    """A `LoadingProtocol` from positional arguments."""
    return LoadingProtocol(peak_indentation=depth, loading_rate=loading, dwell_time=dwell, unloading_rate=unloading)


def cycles(tabor: float, depth: float, rate: float, count: int) -> PiecewiseLinearProtocol:
    """`count` triangular cycles between the start and a depth, at one rate."""
    start = default_start_indentation(tabor)
    half = (depth - start) / rate
    depths = [start, *([depth, start] * count)]
    return PiecewiseLinearProtocol(half * np.arange(len(depths)), depths)


def creeping(tabor: float, above: float, hold: float) -> PiecewiseLinearProtocol:
    """Press, relax, retract to an indentation that is `above` the rubbery fold of JKR, and hold there."""
    start, near = default_start_indentation(tabor), jkr.fold_indentation(tabor) + above
    times = [0.0, 1.0, 21.0, 31.0, 31.0 + hold, 41.0 + hold]
    return PiecewiseLinearProtocol(times, [start, 3.0, 3.0, near, near, start])


def extremes() -> dict[str, tuple[Scene, IndentationProtocol]]:
    """Scene and protocol of each named extreme."""
    sls, stiff = StandardLinearSolid(0.1), StandardLinearSolid(0.01)
    glass = PiecewiseLinearProtocol([0.0, 30.0, 30.1], [0.07, -1.0, 0.07])
    return {
        "deep and slow at large mu": (Scene(5.0, sls), ramp(60.0, 0.1, 3.0, 0.1)),
        "snap-in and snap-off, elastic": (Scene(3.2, Elastic()), ramp(5.0, 1.0, 0.0, 1.0)),
        "snap-off at once, fast from a relaxed state": (Scene(2.5, sls), ramp(2.0, 0.1, 100.0, 1000.0)),
        "detachment after the end of the protocol": (Scene(3.2, sls), ramp(2.0, 22.5, 0.02, 2.6)),
        "zero dwell": (Scene(1.0, sls), ramp(20.0, 100.0, 0.0, 100.0)),
        "never in contact": (Scene(1.0, sls), ramp(-1.5, 1.0, 0.1, 1.0)),
        "modulus ratio 1e-3": (Scene(1.0, StandardLinearSolid(1e-3)), ramp(10.0, 1.0, 1.0, 100.0)),
        "nearly rigid, stiff glass, dwell of 1e5": (Scene(0.03, stiff), ramp(0.3, 50.0, 1e5, 50.0)),
        "stiff glass without adhesion": (Scene(0.12, StandardLinearSolid(1e-3), HardContact()), glass),
        "rate 1e5": (Scene(1.0, sls), ramp(100.0, 1e5, 1e-3, 1e5)),
        "rate 1e-3": (Scene(1.0, sls), ramp(100.0, 1e-3, 1.0, 1e-3)),
        "long range, mu = 0.02": (Scene(0.02, sls), ramp(10.0, 10.0, 0.1, 10.0)),
        "short range, mu = 8": (Scene(8.0, sls), ramp(10.0, 10.0, 0.1, 10.0)),
        "dwell of 1e6 retardation times": (Scene(1.0, sls), ramp(20.0, 100.0, 1e6, 100.0)),
        "creeping towards a fold": (Scene(3.2, sls), creeping(3.2, 0.05, 1000.0)),
        "creeping past a fold": (Scene(3.2, sls), creeping(3.2, -0.3, 1000.0)),
        "50 cycles, relaxing between": (Scene(1.0, sls), cycles(1.0, 5.0, 1.0, CYCLES)),
        "50 cycles, fast": (Scene(1.0, sls), cycles(1.0, 5.0, 100.0, CYCLES)),
        "50 cycles with jumps, elastic": (Scene(3.2, Elastic()), cycles(3.2, 2.0, 1.0, CYCLES)),
    }


def relative_change(value: float, reference: float) -> float:
    """Change of a force from its reference; zero where both vanish, as without adhesion."""
    return 0.0 if value == reference else abs(value / reference - 1.0) if reference else np.inf


def compared(scene: Scene, protocol: IndentationProtocol) -> dict[str, Any]:
    """Status, cost and results of one case at both accuracies, and the change of the results."""
    simulate(Scene(0.2, StandardLinearSolid(0.1)), ramp(2.0, 1.0, 0.1, 1.0), "draft")  # loads the kernels, untimed
    target = resolve_accuracy(ACCURACY).target / REFINEMENT
    coarse, fine = (simulate(scene, protocol, accuracy) for accuracy in (ACCURACY, target))
    both = coarse.completed and fine.completed
    return {
        "status": coarse.status,
        "refined_status": fine.status,
        "pull_off_force": coarse.pull_off_force,
        "refined_pull_off_force": fine.pull_off_force,
        "change": relative_change(coarse.pull_off_force, fine.pull_off_force) if both else np.nan,
        "work_change": abs(coarse.work() - fine.work()) / fine.turnover() if both else np.nan,
        "energy": coarse.work() / coarse.turnover() if coarse.completed else np.nan,
        "end_over_pull_off": coarse.end_force / coarse.pull_off_force if coarse.pull_off_force else np.nan,
        "jumps": len(coarse.jumps),
        "steps": coarse.stats.steps,
        "seconds": coarse.stats.seconds,
    }


def extreme(name: str, scene: Scene, protocol: IndentationProtocol) -> dict[str, Any]:
    """One named extreme, compared with its refinement and at the coarser accuracies."""
    comparison = compared(scene, protocol)
    runs = {str(accuracy): simulate(scene, protocol, accuracy) for accuracy in COARSER}
    exact = comparison["refined_pull_off_force"]
    coarse = {
        key: {"status": run.status, "change": relative_change(run.pull_off_force, exact)} for key, run in runs.items()
    }
    return {"name": name, **comparison, "coarse": coarse}


def study(*, count: Count = 512, seed: Seed = 6, jobs: Jobs = 2) -> dict[str, Any]:
    """Simulate random protocols inside the box, as many beyond it, and the extremes."""
    points = [
        {"where": where, **row} for where in ("inside", "beyond") for row in rows_of(drawn(where, count, seed, "sobol"))
    ]
    # The most expensive cases run first, so that the other cores do not wait for the last one.
    points.sort(key=lambda point: -point["tabor"] * point["peak_indentation"])
    cases = [Case.of(point) for point in points]
    tasks = [(case.scene, case.protocol) for case in cases]
    comparisons = in_parallel(compared, tasks, jobs=jobs, label="random protocols")
    rows = [{**point, **comparison} for point, comparison in zip(points, comparisons, strict=True)]
    rows.sort(key=lambda row: (row["where"], row["tabor"], row["unloading_rate"]))
    named = [extreme(name, *case) for name, case in progress(extremes().items(), "extremes")]
    return {"accuracy": ACCURACY, "refinement": REFINEMENT, "map": rows, "extremes": named}

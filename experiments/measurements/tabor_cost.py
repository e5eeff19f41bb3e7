"""What accuracy costs at Tabor parameters of 3, 30 and 300: seconds and errors of `simulate` at several targets.

The cycles are random, of a standard linear solid of modulus ratio `MODULUS_RATIO`; their depths and rates are in units
of mu h0. The error is that of the pull-off force, relative to boundary elements of target `EXACT_TARGET`. At 300
these would take hours: the error is then the accuracy that the trajectory states, and `measured` is false. Seconds are
those of the processor; the tables that a sharp crack needs once for a solid are not in them.
"""

from typing import Any

import numpy as np

from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from experiments.cases import completed
from experiments.common import MODULUS_RATIO
from experiments.harness import Count, Seed, progress, timed
from experiments.measurements.statistics import spread

TABORS, MOST_COMPARED = (3.0, 30.0, 300.0), 30.0
TARGETS = (1.7e-2, 8e-3, 4e-3, 2e-3, 1e-3)
EXACT_TARGET, MOST_WORK = 5e-4, 1e12


def cycles(tabor: float, count: int, seed: int) -> list[LoadingProtocol]:
    """Random cycles with a dwell; the same for each Tabor parameter, in units of mu h0."""
    random = np.random.default_rng(seed)
    peaks, dwells = random.uniform(1.0, 5.0, count), random.uniform(0.0, 1.0, count)
    rates = 10.0 ** random.uniform(0.0, 2.0, (2, count))
    return [
        LoadingProtocol(
            peak_indentation=peak * tabor,
            loading_rate=loading * tabor,
            dwell_time=dwell,
            unloading_rate=unloading * tabor,
        )
        for peak, dwell, loading, unloading in zip(peaks, dwells, *rates, strict=True)
    ]


def measured_at(tabor: float, paths: list[LoadingProtocol]) -> list[dict[str, Any]]:
    """Seconds, errors and methods of each target."""
    scene, compared = Scene(tabor, StandardLinearSolid(MODULUS_RATIO)), tabor <= MOST_COMPARED
    exact = [
        simulate(scene, path, EXACT_TARGET, most_work=MOST_WORK).pull_off_force if compared else 0.0 for path in paths
    ]
    simulate(scene, paths[0])  # tables of the solid
    rows = []
    for target in progress(TARGETS, f"Tabor parameter {tabor:g}"):
        seconds, errors, methods = [], [], []
        for path, truth in zip(paths, exact, strict=True):
            trajectory = completed(simulate(scene, path, target), f"{scene}, {path}")
            seconds += timed(lambda path=path, target=target: simulate(scene, path, target), first=False)
            errors.append(abs(trajectory.pull_off_force / truth - 1.0) if compared else trajectory.accuracy)
            methods.append(trajectory.stats.method)
        shares = {method: methods.count(method) / len(methods) for method in sorted(set(methods))}
        rows.append({"target": target, "seconds": spread(seconds), "errors": spread(errors), "methods": shares})
    return [{"tabor": tabor, "measured": compared, **row} for row in rows]


def study(*, count: Count = 12, seed: Seed = 5) -> dict[str, Any]:
    """Measure all Tabor parameters."""
    rows = [row for tabor in TABORS for row in measured_at(tabor, cycles(tabor, count, seed))]
    return {"cycles": count, "exact_target": EXACT_TARGET, "rows": rows}

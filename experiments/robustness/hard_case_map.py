"""A map of the solver's difficult cases: the paper's box, far beyond it, and named extremes.

Each case is simulated at standard accuracy and again with a quarter of the target error. The study reports how the
simulation ended, steps, jumps, seconds, the change of pull-off force and work under refinement, and the energy balance:
the work of the closed loop over the integral of |P d(delta)|, which is never negative in a solid that cannot create
energy. The extremes are also run at coarser accuracies, at which a solver fails first. Random protocols are drawn as in
`experiments.robustness.soak`, inside the box and beyond it.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import typer

from bem import (
    Elastic,
    HardContact,
    LoadingProtocol,
    PiecewiseLinearProtocol,
    Scene,
    StandardLinearSolid,
    simulate,
)
from bem.effects.scene_effects import IndentationProtocol
from bem.protocol import default_start_indentation
from bem.reference_solutions import jkr
from experiments.common import write_result
from experiments.robustness.hard_cases import (
    ACCURACY,
    REFINEMENT,
    compared,
    energy,
    pair,
    relative_change,
    scene_of,
)
from experiments.robustness.soak import points_of, protocols
from experiments.timing import MEASUREMENTS, Jobs, Out, in_parallel, plain, progress

OUT = MEASUREMENTS / "hard_case_map.json"
COARSER = ("draft", 0.05)
CYCLES = 50


def ramp(depth: float, loading: float, dwell: float, unloading: float, **more: Any) -> LoadingProtocol:
    """A `LoadingProtocol` from positional arguments."""
    return LoadingProtocol(
        peak_indentation=depth, loading_rate=loading, dwell_time=dwell, unloading_rate=unloading, **more
    )


def cycles(tabor: float, depth: float, rate: float, count: int) -> PiecewiseLinearProtocol:
    """`count` triangular cycles between the start and a depth, at one rate."""
    start = default_start_indentation(tabor)
    half = (depth - start) / rate
    depths = [start, *([depth, start] * count)]
    return PiecewiseLinearProtocol(half * np.arange(len(depths)), depths)


def creeping(tabor: float, above: float, hold: float) -> PiecewiseLinearProtocol:
    """Press, relax, retract to an indentation that is `above` the rubbery fold of JKR, and hold there."""
    start = default_start_indentation(tabor)
    near = jkr.fold_indentation(tabor) + above
    return PiecewiseLinearProtocol(
        [0.0, 1.0, 21.0, 31.0, 31.0 + hold, 41.0 + hold], [start, 3.0, 3.0, near, near, start]
    )


def extremes() -> dict[str, tuple[Scene, IndentationProtocol]]:
    """Scene and protocol of each named extreme."""
    sls = StandardLinearSolid(0.1)
    return {
        "deep and slow at large mu": (Scene(5.0, sls), ramp(60.0, 0.1, 3.0, 0.1)),
        "snap-in and snap-off, elastic": (Scene(3.2, Elastic()), ramp(5.0, 1.0, 0.0, 1.0)),
        "snap-off at once, fast from a relaxed state": (Scene(2.5, sls), ramp(2.0, 0.1, 100.0, 1000.0)),
        "detachment after the end of the protocol": (Scene(3.2, sls), ramp(2.0, 22.5, 0.02, 2.6)),
        "zero dwell": (Scene(1.0, sls), ramp(20.0, 100.0, 0.0, 100.0)),
        "never in contact": (Scene(1.0, sls), ramp(-1.5, 1.0, 0.1, 1.0)),
        "modulus ratio 1e-3": (Scene(1.0, StandardLinearSolid(1e-3)), ramp(10.0, 1.0, 1.0, 100.0)),
        "nearly rigid, stiff glass, dwell of 1e5": (
            Scene(0.03, StandardLinearSolid(0.01)),
            ramp(0.3, 50.0, 1e5, 50.0),
        ),
        "stiff glass without adhesion": (
            Scene(0.12, StandardLinearSolid(1e-3), HardContact()),
            PiecewiseLinearProtocol([0.0, 30.0, 30.1], [0.07, -1.0, 0.07]),
        ),
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


def coarsely(scene: Scene, protocol: IndentationProtocol, pull_off_force: float) -> dict[str, dict[str, Any]]:
    """One case at the coarser accuracies, with the change of its pull-off force from a refined one."""
    found = {}
    for accuracy in COARSER:
        trajectory = simulate(scene, protocol, accuracy)
        found[str(accuracy)] = {
            "status": trajectory.status,
            "change": relative_change(trajectory.pull_off_force, pull_off_force),
            "energy": energy(trajectory),
            "seconds": trajectory.stats.seconds,
        }
    return found


def extreme(name: str, scene: Scene, protocol: IndentationProtocol) -> dict[str, Any]:
    """One named extreme, compared with its refinement and at the coarser accuracies."""
    found = {
        "name": name,
        "tabor": scene.tabor,
        "modulus_ratio": scene.material.modulus_ratio,
        **compared(*pair(scene, protocol)),
    }
    return {**found, "coarse": coarsely(scene, protocol, found["refined_pull_off_force"])}


def mapped(point: dict[str, Any]) -> dict[str, Any]:
    """One point of the map, compared with its refinement."""
    return {**point, **compared(*pair(*scene_of(point)))}


def main(
    count: Annotated[int, typer.Option(help="Random protocols inside the box, and as many beyond.")] = 512,
    seed: Annotated[int, typer.Option(help="Seed of the protocols.")] = 6,
    jobs: Jobs = 2,
    out: Out = OUT,
) -> None:
    """Simulate the map and the extremes."""
    points = [
        {"where": where, **point}
        for where in ("inside", "beyond")
        for point in points_of(protocols(where, count, seed, "sobol"))
    ]
    points.sort(key=lambda point: -point["tabor"] * point["peak_indentation"])
    rows = in_parallel(mapped, [(point,) for point in points], jobs=jobs, label="map", ordered=False)
    rows.sort(key=lambda row: (row["where"], row["tabor"], row["unloading_rate"]))
    named = [extreme(name, *case) for name, case in progress(extremes().items(), "extremes")]
    content = {"accuracy": ACCURACY, "refinement": REFINEMENT, "map": rows, "extremes": named}
    write_result(out, f"hard_case_map --count {count} --seed {seed}", plain(content))
    unfinished = [row for row in rows + named if row["status"] != "completed"]
    print(f"{len(rows) + len(named)} cases, {len(unfinished)} not completed")

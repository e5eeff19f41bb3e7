"""How often the 95 % intervals of a fit contain the true value: random contacts, simulated with noise, and fitted.

Each case draws modulus, work of adhesion, retardation time, modulus ratio, contact point and force offset of a soft
bead. It simulates a cycle of loading, dwell and unloading at a tighter accuracy than that of the fit, samples it at 300
instants, and adds noise of 1 % of its range. Six parameters are then fitted, from guesses that use the curve alone.
"""

from __future__ import annotations

import time
from typing import Annotated, Any

import numpy as np
import typer

from bem import StandardLinearSolid, simulate
from bem.lab import ForceCurve, Setup, fit
from bem.lab.fitting import ALL, FitError
from bem.lab.guess import guess_setup
from experiments.common import write_result
from experiments.timing import MEASUREMENTS, Jobs, Out, in_parallel

OUT = MEASUREMENTS / "lab_coverage.json"
RADIUS = 50e-6
NOISE = 0.01
POINTS = 300
TRUE_ACCURACY = 3e-4
LOGARITHMIC = {
    "relaxed_modulus": (0.5e6, 5e6),
    "work_of_adhesion": (0.02, 0.1),
    "retardation_time": (0.03, 0.3),
    "modulus_ratio": (0.15, 0.6),
}
DEEPEST, FARTHEST = 4.0, 6.0  # in adhesion lengths
RAMP, DWELL = 0.5, 0.5  # seconds


def drawn(rng: np.random.Generator) -> dict[str, float]:
    """True parameters of one case, in SI units."""
    truth = {name: float(np.exp(rng.uniform(*np.log(bounds)))) for name, bounds in LOGARITHMIC.items()}
    truth["contact_point"] = float(rng.uniform(-0.5, 0.5)) * setup_of(truth).adhesion_length
    truth["force_offset"] = float(rng.uniform(-0.5, 0.5)) * setup_of(truth).force_scale
    return truth


def setup_of(truth: dict[str, float]) -> Setup:
    """Setup of the bead with the true parameters of a case."""
    return Setup(
        radius=RADIUS,
        work_of_adhesion=truth["work_of_adhesion"],
        relaxed_modulus=truth["relaxed_modulus"],
        retardation_time=truth["retardation_time"],
        material=StandardLinearSolid(modulus_ratio=truth["modulus_ratio"]),
    )


def measured(truth: dict[str, float], rng: np.random.Generator) -> ForceCurve:
    """Noisy force curve of a case, in SI units.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    setup = setup_of(truth)
    length = setup.adhesion_length
    speed = (DEEPEST + FARTHEST) * length / RAMP
    protocol = setup.protocol(
        peak_indentation=DEEPEST * length,
        loading_rate=speed,
        dwell_time=DWELL,
        unloading_rate=speed,
        start_indentation=-FARTHEST * length,
    )
    trajectory = simulate(setup.scene(), protocol, TRUE_ACCURACY)
    if not trajectory.completed:
        raise RuntimeError(f"a curve of the study could not be simulated: {trajectory.status}")
    instants = np.linspace(0.0, trajectory.time[-1], POINTS)
    force = setup.force_scale * trajectory.at(instants)
    depth = setup.indentation_scale * protocol.history(setup.tabor).indentation_at(instants)
    noise = NOISE * np.ptp(force) * rng.standard_normal(POINTS)
    return ForceCurve(
        time=setup.time_scale * instants,
        indentation=depth + truth["contact_point"],
        force=force + truth["force_offset"] + noise,
    )


def one_case(seed: int, number: int) -> dict[str, Any]:
    """True values and estimates of a case, and whether each interval contains the true value, or why the fit failed."""
    rng = np.random.default_rng([seed, number])
    truth = drawn(rng)
    curve = measured(truth, rng)
    started = time.process_time()
    try:
        result = fit(curve, guess_setup(curve, radius=RADIUS), ALL)
    except (FitError, ValueError) as error:
        return {"truth": truth, "failure": str(error), "seconds": time.process_time() - started}
    return {
        "truth": truth,
        "values": result.values,
        "inside": {name: bool(low <= truth[name] <= high) for name, (low, high) in result.intervals.items()},
        "simulations": result.simulations,
        "seconds": time.process_time() - started,
    }


def main(
    cases: Annotated[int, typer.Option(help="Number of simulated and fitted curves.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of all draws.")] = 0,
    jobs: Jobs = 1,
    out: Out = OUT,
) -> None:
    """Simulate and fit the curves, and count the intervals that contain the true value."""
    results = in_parallel(one_case, [(seed, number) for number in range(cases)], jobs=jobs, label="fits")
    fitted = [result for result in results if "values" in result]
    inside = {name: sum(result["inside"][name] for result in fitted) for name in ALL}
    seconds = sorted(result["seconds"] for result in results)
    median, longest = seconds[len(seconds) // 2], seconds[-1]
    content = {"cases": cases, "fitted": len(fitted), "inside": inside, "noise": NOISE, "points": POINTS}
    content |= {"median_seconds": median, "longest_seconds": longest, "results": results}
    write_result(out, f"lab_coverage --cases {cases} --seed {seed}", content)
    print(f"{len(fitted)} of {cases} fitted, {median:.0f} s of processor each (longest {longest:.0f} s)")
    for name, count in inside.items():
        print(f"{name:17} inside its 95 % interval in {count}")

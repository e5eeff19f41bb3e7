"""How often the 95 % intervals of a fit contain the true value: random contacts, simulated with noise, and fitted.

Each case draws modulus, work of adhesion, retardation time, modulus ratio, contact point and force offset of a soft
bead, simulates a cycle of loading, dwell and unloading at a tighter accuracy than the fit's, samples it at 300 instants
and adds 1 % of its range as noise. Six parameters are then fitted from guesses that the curve alone gives. As many
cases are behind a cantilever, whose stage moves. Cases are kept, so that an interrupted run continues with the same
command; they are known by their number, the seed, the solver's version and the code of study and fit.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import bem.lab
from bem import StandardLinearSolid, simulate
from bem._support.outputs import write_whole
from bem._support.wording import markdown_table
from bem.lab import ForceCurve, Setup, fit
from bem.lab.fitting import ALL, FitError
from bem.lab.guess import guess_setup
from bem.solver.version import SOLVER_VERSION
from experiments.common import write_result
from experiments.timing import MEASUREMENTS, Jobs, Out, fingerprint, in_parallel, plain

OUT = MEASUREMENTS / "lab_coverage.json"
KEPT = Path("results/lab_coverage")
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
SPRING = (0.5, 5.0)  # stiffness of the cantilevers, in pi R dgamma over the adhesion length
DEEPEST, FARTHEST = 4.0, 6.0  # in adhesion lengths
PRESSED, STRETCHED = 6.0, 2.0  # forces of the spring, in pi R dgamma, by which the stage moves further
RAMP, DWELL = 0.5, 0.5  # seconds
INSTRUMENTS = {"sphere": "sphere moved", "stage": "stage moved, behind a cantilever"}


def drawn(rng: np.random.Generator, instrument: str = "sphere") -> dict[str, float]:
    """The truth of one case, in SI; with a `stiffness` where the stage is moved."""
    truth = {name: float(np.exp(rng.uniform(*np.log(bounds)))) for name, bounds in LOGARITHMIC.items()}
    truth["contact_point"] = float(rng.uniform(-0.5, 0.5)) * setup_of(truth).adhesion_length
    truth["force_offset"] = float(rng.uniform(-0.5, 0.5)) * setup_of(truth).force_scale
    if instrument == "stage":
        setup = setup_of(truth)
        truth["stiffness"] = float(np.exp(rng.uniform(*np.log(SPRING)))) * setup.force_scale / setup.adhesion_length
    return truth


def setup_of(truth: dict[str, float]) -> Setup:
    """Setup of the bead with the true parameters of a case."""
    return Setup(
        radius=RADIUS,
        work_of_adhesion=truth["work_of_adhesion"],
        relaxed_modulus=truth["relaxed_modulus"],
        retardation_time=truth["retardation_time"],
        material=StandardLinearSolid(modulus_ratio=truth["modulus_ratio"]),
        stiffness=truth.get("stiffness"),
    )


def measured(truth: dict[str, float], rng: np.random.Generator) -> ForceCurve:
    """A noisy curve of a case; behind a cantilever its indentation is that of stage and measured force.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    setup = setup_of(truth)
    length, stiffness = setup.adhesion_length, truth.get("stiffness", np.inf)
    deepest = DEEPEST * length + PRESSED * setup.force_scale / stiffness
    farthest = FARTHEST * length + STRETCHED * setup.force_scale / stiffness
    speed = (deepest + farthest) / RAMP
    protocol = setup.protocol(
        peak_indentation=deepest,
        loading_rate=speed,
        dwell_time=DWELL,
        unloading_rate=speed,
        start_indentation=-farthest,
    )
    trajectory = simulate(setup.scene(), protocol, TRUE_ACCURACY)
    if not trajectory.completed:
        raise RuntimeError(f"a curve of the study could not be simulated: {trajectory.status}")
    instants = np.linspace(0.0, trajectory.time[-1], POINTS)
    force = setup.force_scale * trajectory.at(instants)
    path = setup.indentation_scale * protocol.history(setup.tabor).indentation_at(instants) + truth["contact_point"]
    force = force + truth["force_offset"] + NOISE * np.ptp(force) * rng.standard_normal(POINTS)
    return ForceCurve(
        time=setup.time_scale * instants,
        indentation=path + force / stiffness,
        force=force,
        stage=None if np.isinf(stiffness) else path,
    )


def one_case(seed: int, number: int, instrument: str = "sphere", kept: Path | None = None) -> dict[str, Any]:
    """Truth, estimates and intervals of a case, and whether it was fitted at all; read where it is kept."""
    if kept is not None and kept.is_file():
        return json.loads(kept.read_text(encoding="utf-8"))
    rng = np.random.default_rng([seed, list(INSTRUMENTS).index(instrument), number])
    truth = drawn(rng, instrument)
    curve = measured(truth, rng)
    started = time.process_time()
    try:
        result = fit(curve, guess_setup(curve, radius=RADIUS), ALL)
    except (FitError, ValueError) as error:
        found: dict[str, Any] = {"failure": str(error)}
    else:
        found = {
            "values": result.values,
            "inside": {name: bool(low <= truth[name] <= high) for name, (low, high) in result.intervals.items()},
            "simulations": result.simulations,
        }
    found = plain({"truth": truth, "seconds": time.process_time() - started, **found})
    if kept is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        write_whole(kept, json.dumps(found) + "\n")
    return found


def counted(results: list[dict[str, Any]]) -> dict[str, Any]:
    """How many cases were fitted, contain the truth and took how long."""
    fitted = [result for result in results if "values" in result]
    seconds = sorted(result["seconds"] for result in results)
    return {
        "cases": len(results),
        "fitted": len(fitted),
        "inside": {name: sum(result["inside"][name] for result in fitted) for name in ALL},
        "median_seconds": seconds[len(seconds) // 2],
        "longest_seconds": seconds[-1],
        "results": results,
    }


def page_text(content: dict[str, Any]) -> str:
    """The table of docs/laboratory.md."""
    groups = [content[instrument] for instrument in INSTRUMENTS]
    rows = [[name, *(str(group["inside"][name]) for group in groups)] for name in ALL]
    rows.append(["fitted at all", *(str(group["fitted"]) for group in groups)])
    seconds = [f"{group['median_seconds']:.0f} s, {group['longest_seconds']:.0f} s at most" for group in groups]
    header = [f"inside its interval, of {groups[0]['cases']}", *INSTRUMENTS.values()]
    return markdown_table(header, [*rows, ["processor time of a fit", *seconds]], "lrr")


def main(
    cases: Annotated[int, typer.Option(help="Curves drawn, simulated and fitted, of either instrument.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of all draws.")] = 0,
    jobs: Jobs = 1,
    folder: Annotated[Path, typer.Option(help="Where cases are kept.")] = KEPT,
    out: Out = OUT,
) -> None:
    """Draw, fit and count."""
    code = [path.read_text(encoding="utf-8") for path in sorted(Path(bem.lab.__file__).parent.rglob("*.py"))]
    code.append(Path(__file__).read_text(encoding="utf-8"))
    place = folder / fingerprint(seed=seed, solver=SOLVER_VERSION, code=code)
    content: dict[str, Any] = {"noise": NOISE, "points": POINTS}
    for instrument, words in INSTRUMENTS.items():
        wanted = [(seed, number, instrument, place / f"{instrument}-{number}.json") for number in range(cases)]
        content[instrument] = counted(in_parallel(one_case, wanted, jobs=jobs, label=f"fits, {words}"))
    write_result(out, f"lab_coverage --cases {cases} --seed {seed}", content)
    print(page_text(content))

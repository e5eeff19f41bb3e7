"""How often the 95 % intervals of a fit contain the true value.

Curves of closed forms that share no code with the models are those of `experiments.robustness.lab_curves`. The solver's
own draw modulus, work of adhesion, retardation time, modulus ratio, contact point and force offset of a soft bead: a
cycle of loading, dwell and unloading at a tighter accuracy than the fit's, sampled at 300 instants, with 1 % of its
range as noise; half of them behind a cantilever, whose stage moves. The fit chooses a model from guesses that the
curve alone gives. Cases are kept, so that an interrupted run continues with the same command; they are known by their
number, the seed, the solver's version and the code of study and fit.
"""

import sys
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import bem.lab
from bem import StandardLinearSolid, simulate
from bem._support.wording import markdown_table
from bem.lab import ForceCurve, Setup, fit
from bem.lab.fitting import FitError, guess_setup
from bem.methods.version import SOLVER_VERSION
from experiments.cases import between, completed
from experiments.harness import CLOCK, Jobs, Seed, fingerprint, in_parallel, kept
from experiments.robustness import lab_curves
from experiments.robustness.lab_curves import CLASSES, UNKNOWN

KEPT = Path("results/lab_coverage")
RADIUS = 50e-6
NOISE = 0.01
POINTS = 300
TRUE_ACCURACY = 0.001  # at which the steps of a sharp crack are four times finer than at that of the fit, 0.004
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
INSTRUMENTS = {"sphere": "contact, sphere moved", "stage": "contact, stage moved"}
FORMS = CLASSES | UNKNOWN
QUANTITIES = ("relaxed_modulus", "work_of_adhesion", "retardation_time", "modulus_ratio", "contact_point")


def drawn(rng: np.random.Generator, instrument: str = "sphere") -> dict[str, float]:
    """The truth of one case, in SI; with a `stiffness` where the stage is moved."""
    truth = {name: between(rng, *bounds) for name, bounds in LOGARITHMIC.items()}
    setup = setup_of(truth)
    truth["contact_point"] = float(rng.uniform(-0.5, 0.5)) * setup.adhesion_length
    truth["force_offset"] = float(rng.uniform(-0.5, 0.5)) * setup.force_scale
    if instrument == "stage":
        truth["stiffness"] = between(rng, *SPRING) * setup.force_scale / setup.adhesion_length
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
    stiffness = truth.get("stiffness", np.inf)
    bent = setup.force_scale / stiffness
    deepest = DEEPEST * setup.adhesion_length + PRESSED * bent
    farthest = FARTHEST * setup.adhesion_length + STRETCHED * bent
    speed = (deepest + farthest) / RAMP
    protocol = setup.protocol(
        peak_indentation=deepest,
        loading_rate=speed,
        dwell_time=DWELL,
        unloading_rate=speed,
        start_indentation=-farthest,
    )
    trajectory = completed(simulate(setup.scene(), protocol, TRUE_ACCURACY), "a curve of the study")
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


def drawn_curve(group: str, seed: int, number: int) -> tuple[ForceCurve, Setup, dict[str, float]]:
    """A noisy curve of a class or an instrument, what is known of its setup, and the truth."""
    if group in FORMS:
        return FORMS[group](np.random.default_rng([number, 7 + seed]))
    rng = np.random.default_rng([seed, list(INSTRUMENTS).index(group), number])
    truth = drawn(rng, group)
    curve = measured(truth, rng)
    return curve, guess_setup(curve, radius=RADIUS), truth


def one_case(group: str, seed: int, number: int) -> dict[str, Any]:
    """Truth, estimates and intervals of a case, and whether the right model was chosen, or any."""
    curve, setup, truth = drawn_curve(group, seed, number)
    with CLOCK:
        try:
            result = fit(curve, setup)
        except (FitError, ValueError) as error:
            return {"truth": truth, "failure": str(error)}
    names = [name for name in QUANTITIES if name in truth and name in result.values]
    return {
        "truth": truth,
        "seconds": CLOCK.seconds,
        "model": result.model,
        "right": (group if group in FORMS else "contact") in (result.model, *result.alike),
        "adequate": result.adequate,
        "misfit": result.misfit,
        "values": {name: result.values[name] for name in names},
        "inside": {name: result.intervals[name][0] <= truth[name] <= result.intervals[name][1] for name in names},
    }


def counted(results: list[dict[str, Any]]) -> dict[str, Any]:
    """How many cases were fitted with the right model, contain the truth and took how long."""
    fitted = [result for result in results if "values" in result]
    quantities = {}
    for name in QUANTITIES:
        bounded = [result for result in fitted if name in result["inside"]]
        if bounded:
            errors = [abs(result["values"][name] / result["truth"][name] - 1.0) for result in bounded]
            inside = [result["inside"][name] for result in bounded]
            quantities[name] = {"inside": float(np.mean(inside)), "median_error": float(np.median(errors))}
    seconds = [result["seconds"] for result in fitted] or [np.nan]
    return {
        "cases": len(results),
        "fitted": len(fitted),
        "right": sum(result["right"] for result in fitted),
        "adequate": sum(result["adequate"] for result in fitted),
        "wrong": sum(result["adequate"] and not result["inside"]["relaxed_modulus"] for result in fitted),
        "quantities": quantities,
        "median_seconds": float(np.median(seconds)),
        "longest_seconds": float(np.max(seconds)),
        "results": results,
    }


def page_text(lab_coverage: Any) -> str:
    """The table of docs/laboratory.md."""
    rows = []
    for group_name in (*CLASSES, *INSTRUMENTS):
        group, cells = lab_coverage[group_name], []
        for name in QUANTITIES:
            statistics = group["quantities"].get(name)
            error = "" if name == "contact_point" else f" ({100.0 * (statistics or {}).get('median_error', 0.0):.2f} %)"
            cells.append(f"{100.0 * statistics['inside']:.1f} %{error}" if statistics else "")
        seconds = f"{group['median_seconds']:.2g}, {group['longest_seconds']:.2g}"
        rows.append([INSTRUMENTS.get(group_name, group_name), f"{group['right']} of {group['cases']}", *cells, seconds])
    names = [name.replace("relaxed_", "").replace("_", " ") for name in QUANTITIES]
    return markdown_table(
        ["class", "right model", *names, "CPU s: median, longest"], rows, "lr" + "r" * len(names) + "r"
    )


def shapes_text(lab_coverage: Any) -> str:
    """The table of docs/laboratory.md of shapes that no model is for."""
    names = [(name, lab_coverage[name]) for name in UNKNOWN]
    rows = [
        [name.replace("_", " "), *(str(shape[key]) for key in ("cases", "adequate", "wrong"))] for name, shape in names
    ]
    return markdown_table(["shape", "curves", "a model adequate", "adequate, interval without the truth"], rows, "lrrr")


def limits_text(lab_coverage: Any) -> str:
    """How often the intervals of the solver's own curves contain the truth, and how long its fits take at most."""
    sentences, groups = [], [lab_coverage[instrument] for instrument in INSTRUMENTS]
    for name, group in zip(INSTRUMENTS, groups, strict=True):
        shares = [100.0 * quantity["inside"] for quantity in group["quantities"].values()]
        sentences.append(
            f"{min(shares):.0f} to {max(shares):.0f} % ({name} moved, {group['right']} of {group['cases']} right)"
        )
    longest = max(group["longest_seconds"] for group in groups)
    return f"{' and '.join(sentences)}; a fit takes up to {longest:.0f} s of processor time"


def study(
    *,
    curves: Annotated[int, typer.Option(help="Curves of each class of closed forms.")] = 200,
    shapes: Annotated[int, typer.Option(help="Curves of each shape that no model is for.")] = 50,
    cases: Annotated[int, typer.Option(min=1, help="Curves of the solver's own, of either instrument.")] = 40,
    seed: Seed = 0,
    jobs: Jobs = 1,
    folder: Annotated[Path, typer.Option(help="Where cases are kept.")] = KEPT,
) -> dict[str, Any]:
    """Draw, fit and count."""
    code = [path.read_text(encoding="utf-8") for path in sorted(Path(bem.lab.__file__).parent.rglob("*.py"))]
    code += [Path(module.__file__).read_text(encoding="utf-8") for module in (sys.modules[__name__], lab_curves)]
    cache = folder / fingerprint(seed=seed, solver=SOLVER_VERSION, code=code)
    counts: dict[str, Any] = {"noise": NOISE, "points": POINTS}
    for group, count in {
        **dict.fromkeys(CLASSES, curves),
        **dict.fromkeys(UNKNOWN, shapes),
        **dict.fromkeys(INSTRUMENTS, cases),
    }.items():
        tasks = [(cache / f"{group}-{number}.json", partial(one_case, group, seed, number)) for number in range(count)]
        counts[group] = counted(in_parallel(kept, tasks, jobs=jobs, label=f"fits, {group}"))
    return counts

"""Infer a material with its uncertainty: the posterior of three parameters from one noisy force curve.

A sphere is pressed in, held and pulled off. Radius, work of adhesion and range h0 of the adhesion are known; Tabor
parameter, modulus ratio and retardation time are not, and are uniform in their logarithms before the measurement.
`surrogate.load("fast")` predicts the curves of many parameters. A few hundred simulations near the answer tell how far
it is from the solver, and this error belongs to the likelihood (`surrogate.posterior`). The same posterior
with the solver instead, of fewer samples, shows whether the surrogate may be believed.

Units: lengths in h0, force in pi R dgamma (tension positive), time in s.

Run: `python examples/infer_material.py [PICTURE] [--samples N] [--solver-samples N]`. It draws into
`infer_material.png`, or the file named.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

import surrogate
from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem._support.outputs import IMAGES, require_output, require_suffix
from bem.plots import COLOURS
from bem.protocol import default_start_indentation
from surrogate.posterior import Sample, batches, draw, likelihood, search

PRIOR = {"tabor": (0.8, 3.2), "modulus_ratio": (0.02, 0.5), "retardation_time": (0.2, 5.0)}
TRUE = (1.37, 0.113, 1.21)
PEAK, APPROACH, DWELL, RETRACTION = 15.0, 10.0, 0.5, 30.0  # h0, h0/s, s, h0/s
LAST = -1.7
"""Indentation at the last measured instant, which every history of the prior reaches."""
POINTS = (60, 30, 110)
NOISE = 0.01
"""Standard deviation of the noise over the range of the force; known, as from the baseline before contact."""
CALIBRATION, LEAST = 256, 100
"""Simulations that measure the surrogate's error, and fewest samples."""
SURROGATE, IGNORED, SOLVER = "surrogate", "surrogate, its error ignored", "solver"
SHADES = {SURROGATE: COLOURS["fast"], IGNORED: COLOURS["M5"], SOLVER: COLOURS["solver"]}
LABELS = {
    "tabor": "Tabor parameter",
    "modulus_ratio": "modulus ratio",
    "retardation_time": "retardation time (s)",
}
Show = Callable[[list, str], Iterable]


def instants() -> np.ndarray:
    """Measured instants, shape (200,), in s from the first touch of the undeformed sphere."""
    top, turn = PEAK / APPROACH, PEAK / APPROACH + DWELL
    end = turn + (PEAK - LAST) / RETRACTION
    phases = zip((0.0, top, turn), (top, turn, end), POINTS, strict=True)
    return np.concatenate([np.linspace(begin, stop, count + 1)[1:] for begin, stop, count in phases])


def protocol(retardation_time: float) -> LoadingProtocol:
    """The experiment in the solver's units of time."""
    return LoadingProtocol(
        peak_indentation=PEAK,
        loading_rate=APPROACH * retardation_time,
        dwell_time=DWELL / retardation_time,
        unloading_rate=RETRACTION * retardation_time,
    )


def own_instants(tabor: np.ndarray, retardation_time: np.ndarray) -> np.ndarray:
    """The measured instants in histories of some parameters (n,), which begin at other indentations: shape (n, 200)."""
    touch = -default_start_indentation(tabor) / (APPROACH * retardation_time)
    return touch[:, np.newaxis] + instants() / retardation_time[:, np.newaxis]


def predicted(model: Any, logarithms: np.ndarray) -> np.ndarray:
    """Forces of the surrogate for some hundred parameters (n, 3), shape (n, 200)."""
    tabor, ratio, times = np.exp(logarithms).T
    scenes = [Scene(*pair) for pair in zip(tabor.tolist(), map(StandardLinearSolid, ratio.tolist()), strict=True)]
    found = model.predict(scenes, [protocol(one) for one in times.tolist()])
    own = np.array([one.time for one in found])
    # One after the other on one axis, all histories are interpolated at once.
    shift = (own[:, -1].max() + 1.0) * np.arange(len(found))[:, np.newaxis]
    curve = PchipInterpolator((own + shift).ravel(), np.concatenate([one.force for one in found]))
    return curve(own_instants(tabor, times) + shift)


def simulated(logarithms: np.ndarray, accuracy: str | float = "standard") -> np.ndarray:
    """Forces of the solver for parameters (n, 3), shape (n, 200); NaN where a simulation does not complete."""
    tabor, ratio, times = np.exp(logarithms).T
    forces = np.full((len(logarithms), sum(POINTS)), np.nan)
    for row, wanted in enumerate(own_instants(tabor, times)):
        scene = Scene(float(tabor[row]), StandardLinearSolid(float(ratio[row])))
        found = simulate(scene, protocol(float(times[row])), accuracy)
        if found.completed:
            forces[row] = found.at(wanted)
    return forces


def measured_curve(true: tuple[float, ...] = TRUE, seed: int = 0) -> tuple[np.ndarray, float]:
    """Forces that a laboratory might record, shape (200,), and the noise: the solver's, finer than in the inference."""
    (force,) = simulated(np.log([true]), accuracy="reference")
    noise = NOISE * float(np.ptp(force))
    return force + noise * np.random.default_rng(seed).standard_normal(force.size), noise


@dataclass(frozen=True)
class Inference:
    """Posteriors of one measured curve by the name of the tool, and what they cost.

    Args:
        posteriors: By the names `SURROGATE`, `IGNORED` and `SOLVER`.
        seconds: Processor seconds of a sample of the surrogate and of the solver.
        searched: Processor seconds of search and calibration together.
    """

    posteriors: dict[str, Sample]
    seconds: dict[str, float]
    searched: float


def infer(
    measured: np.ndarray,
    noise: float,
    model: Any,
    *,
    samples: int,
    solver_samples: int,
    seed: int = 0,
    show: Show = lambda items, _: items,
) -> Inference:
    """Sample the posterior of forces at `instants()`, shape (200,), with the surrogate and with the solver.

    Args:
        measured: The forces.
        noise: Standard deviation of their noise.
        model: As `surrogate.load("fast")` returns it.
        samples: Samples of the surrogate's posterior.
        solver_samples: Samples of the solver's.
        seed: Of all draws.
        show: Reports the progress over a list, which it yields, under a label.
    """
    clock = time.process_time()
    forces = partial(predicted, model)
    exact = likelihood(measured, noise)
    around = search(forces, exact, PRIOR, seed=seed, wider=3.6)
    near = draw(PRIOR, CALIBRATION, seed + 100, around).logarithms
    true = np.concatenate([simulated(part) for part in show(batches(near, 16), "error of the surrogate")])
    careful = likelihood(measured, noise, true - forces(near))
    proposal = search(forces, careful, PRIOR, start=around, seed=seed + 200)
    searched = time.process_time() - clock

    clock = time.process_time()
    sample = draw(PRIOR, samples, seed + 300, proposal)
    rows = [(careful(one), exact(one)) for one in map(forces, show(batches(sample.logarithms), SURROGATE))]
    both = [np.concatenate(found) for found in zip(*rows, strict=True)]
    posteriors = {name: sample.times(found) for name, found in zip((SURROGATE, IGNORED), both, strict=True)}
    seconds = {SURROGATE: (time.process_time() - clock) / len(sample)}

    clock = time.process_time()
    sample = draw(PRIOR, solver_samples, seed + 400, proposal)
    found = [exact(simulated(part)) for part in show(batches(sample.logarithms, 16), SOLVER)]
    posteriors[SOLVER] = sample.times(np.concatenate(found))
    seconds[SOLVER] = (time.process_time() - clock) / len(sample)
    return Inference(posteriors, seconds, searched)


def draw_densities(found: Inference, true: tuple[float, ...], path: str) -> None:
    """Density of each parameter."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 2.8), layout="constrained")
    panels = figure.subplots(1, 3)
    for column, (axes, name, expected) in enumerate(zip(panels, PRIOR, true, strict=True)):
        for tool, sample in found.posteriors.items():
            values, bins = np.exp(sample.logarithms[:, column]), 25 if tool == SOLVER else 80
            look = {"histtype": "step", "color": SHADES[tool], "label": tool}
            axes.hist(values, bins, weights=sample.weights, density=True, **look)
        axes.axvline(expected, color="0.6", linestyle="--", label="true")
        summaries = [sample.summary() for sample in found.posteriors.values()]
        margin = max(one["sd"][column] for one in summaries)
        low, high = min(one["low"][column] for one in summaries), max(one["high"][column] for one in summaries)
        axes.set(xlabel=LABELS[name], yticks=[], xlim=(low - 2.0 * margin, high + 2.0 * margin))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(path, dpi=150)


def shown(items: list, label: str) -> Iterable:
    """Items, with their progress and the time left on the terminal."""
    from rich.console import Console
    from rich.progress import track

    return track(items, label, console=Console(stderr=True))


def main() -> None:
    """Make a noisy curve, forget its parameters, and find their posterior in two ways."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture", nargs="?", default="infer_material.png")
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("--solver-samples", type=int, default=2_000)
    chosen = parser.parse_args()
    for name in ("samples", "solver_samples"):
        if (count := getattr(chosen, name)) < LEAST:
            parser.error(f"--{name.replace('_', '-')} must be at least {LEAST}; received {count}")
    try:
        require_suffix(chosen.picture, IMAGES)
        require_output(chosen.picture)
    except ValueError as error:
        parser.error(str(error))
    measured, noise = measured_curve(TRUE)
    model = surrogate.load("fast")
    found = infer(measured, noise, model, samples=chosen.samples, solver_samples=chosen.solver_samples, show=shown)
    print("true", dict(zip(PRIOR, TRUE, strict=True)))
    for name, sample in found.posteriors.items():
        print(f"{name}, {len(sample)} samples, as good as {sample.effective:.0f} of equal weight:")
        rows = sample.summary()
        for parameter, mean, low, high in zip(PRIOR, rows["mean"], rows["low"], rows["high"], strict=True):
            print(f"  {parameter:16} {mean:.4f}, 95 % interval {low:.4f} to {high:.4f}")
    costs = ", ".join(f"{name} {1e3 * seconds:.3f} ms" for name, seconds in found.seconds.items())
    print(f"processor time of a sample: {costs}; search and calibration {found.searched:.1f} s")
    draw_densities(found, TRUE, chosen.picture)


if __name__ == "__main__":
    main()

"""An inverse problem with uncertainty: what a surrogate of a batch of thousands is for.

A sphere is pressed in, held and pulled off. Radius, work of adhesion and range h0 of the adhesion are known; Tabor
parameter, modulus ratio and retardation time are not, and are uniform in their logarithms before the measurement. Their
posterior follows from one noisy curve: with a million samples of the pretrained `fast`, whose error around the answer
belongs to the likelihood (`surrogate.posterior`), and with some thousand of the solver. The seconds of a sample, from
parameters to likelihood, are taken in turns.

Units: lengths in h0, force in pi R dgamma (tension positive), time in s.
"""

from functools import partial
from typing import Annotated, Any

import numpy as np
import typer
from scipy.interpolate import PchipInterpolator

import surrogate
from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.protocol import default_start_indentation
from experiments.measurements.harness import CLOCK, Seed, in_turn, progress
from surrogate.posterior import BATCH, Map, Sample, batches, draw, likelihood, search

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
ROUNDS, TIMED = 7, 32
"""Rounds of the timing, and simulations in each."""
BINS, PAIR_BINS = {SOLVER: 24}, 50
SHOWN = 400
"""Samples of the solver that are drawn in the figure."""


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


def measured_curve(seed: int) -> tuple[np.ndarray, float]:
    """Forces that a laboratory might record, shape (200,), and the noise: the solver's, finer than in the inference."""
    (force,) = simulated(np.log([TRUE]), accuracy="reference")
    noise = NOISE * float(np.ptp(force))
    return force + noise * np.random.default_rng(seed).standard_normal(force.size), noise


def infer(
    measured: np.ndarray, noise: float, model: Any, *, samples: int, solver_samples: int, seed: int = 0
) -> tuple[dict[str, Sample], float]:
    """Posteriors of forces at `instants()` by the name of the tool, and processor seconds of search and calibration.

    `noise` is the standard deviation of the independent errors of `measured`, of shape (200,).
    """
    forces, exact = partial(predicted, model), likelihood(measured, noise)
    with CLOCK:
        around = search(forces, exact, PRIOR, seed=seed, wider=3.6)
        near = draw(PRIOR, CALIBRATION, seed + 100, around).logarithms
        true = np.concatenate([simulated(part) for part in progress(batches(near, 16), "error of the surrogate")])
        careful = likelihood(measured, noise, true - forces(near))
        proposal = search(forces, careful, PRIOR, start=around, seed=seed + 200)
    searched = CLOCK.seconds
    sample = draw(PRIOR, samples, seed + 300, proposal)
    rows = [(careful(one), exact(one)) for one in map(forces, progress(batches(sample.logarithms), SURROGATE))]
    both = [np.concatenate(found) for found in zip(*rows, strict=True)]
    posteriors = {name: sample.times(found) for name, found in zip((SURROGATE, IGNORED), both, strict=True)}
    sample = draw(PRIOR, solver_samples, seed + 400, proposal)
    found = [exact(simulated(part)) for part in progress(batches(sample.logarithms, 16), SOLVER)]
    return posteriors | {SOLVER: sample.times(np.concatenate(found))}, searched


def cost(model: Any, points: np.ndarray, judge: Map) -> dict[str, float]:
    """Median processor seconds of a sample of surrogate and solver, a batch of one after some of the other.

    `points` are logarithms of parameters of the posterior, (n, 3), n at least `BATCH`.
    """
    batch = points[:BATCH]

    def by_solver(turn: int) -> None:
        judge(simulated(np.roll(points, -turn * TIMED, axis=0)[:TIMED]))

    by_surrogate = lambda _: judge(predicted(model, batch))  # noqa: E731
    return in_turn({SURROGATE: (by_surrogate, len(batch)), SOLVER: (by_solver, TIMED)}, ROUNDS)


def densities(sample: Sample, bounds: np.ndarray, bins: int) -> list[dict[str, np.ndarray]]:
    """Histogram of each parameter between bounds (3, 2)."""
    found = []
    for values, ends in zip(np.exp(sample.logarithms).T, bounds, strict=True):
        density, edges = np.histogram(values, bins, ends, weights=sample.weights)
        found.append({"edges": edges, "density": density / np.diff(edges)})
    return found


def described(posteriors: dict[str, Sample]) -> dict[str, Any]:
    """Summaries and histograms of the posteriors, on the same bounds; of pairs for the surrogate alone."""
    summaries = {name: sample.summary() for name, sample in posteriors.items()}
    margin = 2.0 * np.max([one["sd"] for one in summaries.values()], axis=0)
    low, high = (np.array([one[end] for one in summaries.values()]) for end in ("low", "high"))
    bounds = np.column_stack([low.min(axis=0) - margin, high.max(axis=0) + margin])
    content: dict[str, dict[str, Any]] = {
        name: {
            "samples": len(sample),
            "effective": sample.effective,
            "summary": summaries[name],
            "densities": densities(sample, bounds, BINS.get(name, 80)),
        }
        for name, sample in posteriors.items()
    }
    sample, pairs = posteriors[SURROGATE], []
    for pair in ([0, 1], [1, 2]):
        values, ends = np.exp(sample.logarithms).T[pair], bounds[pair]
        density, x, y = np.histogram2d(*values, PAIR_BINS, ends, weights=sample.weights)
        pairs.append({"parameters": pair, "x": x, "y": y, "density": density})
    content[SURROGATE]["pairs"] = pairs
    return content


def study(
    *,
    samples: Annotated[int, typer.Option(min=LEAST, help="Samples of the surrogate.")] = 1_000_000,
    solver_samples: Annotated[int, typer.Option(min=LEAST, help="Samples of the solver.")] = 4_000,
    seed: Seed = 0,
) -> dict[str, Any]:
    """Infer, time and describe."""
    measured, noise = measured_curve(seed)
    model = surrogate.load("fast")
    posteriors, searched = infer(measured, noise, model, samples=samples, solver_samples=solver_samples, seed=seed)
    seconds = cost(model, posteriors[SURROGATE].logarithms[: 2 * BATCH], likelihood(measured, noise))
    solver = posteriors[SOLVER]
    chosen = np.random.default_rng(seed).choice(len(solver), SHOWN, p=solver.weights)
    mean = posteriors[SURROGATE].summary()["mean"]
    return {
        "parameters": list(PRIOR),
        "true": TRUE,
        "calibration": CALIBRATION,
        "posteriors": described(posteriors),
        "seconds": seconds,
        "searched": searched,
        "solver_shown": np.exp(solver.logarithms[chosen]),
        "curve": {"time": instants(), "measured": measured, "mean": simulated(np.log([mean]))[0]},
    }

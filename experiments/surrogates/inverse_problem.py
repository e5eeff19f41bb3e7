"""An inverse problem with uncertainty: what a surrogate of a batch of thousands is for.

The posterior of `examples/infer_material.py`, of a million samples by the pretrained `fast` and of some thousand by the
solver, from the same noisy curve. The seconds of a sample, from parameters to likelihood, are taken in turns.
"""

from typing import Annotated, Any

import numpy as np
import typer

import surrogate
from examples import infer_material as example
from experiments.measurements.harness import CLOCK, Seed, in_turn, progress
from surrogate.posterior import BATCH, Map, Sample, likelihood

ROUNDS, TIMED = 7, 32
"""Rounds of the timing, and simulations in each."""
BINS, PAIR_BINS = {example.SOLVER: 24}, 50
SHOWN = 400
"""Samples of the solver that are drawn in the figure."""


def cost(model: Any, points: np.ndarray, judge: Map) -> dict[str, float]:
    """Median processor seconds of a sample of surrogate and solver, a batch of one after some of the other.

    `points` are logarithms of parameters of the posterior, (n, 3), n at least `BATCH`.
    """
    batch = points[:BATCH]

    def by_solver(turn: int) -> None:
        judge(example.simulated(np.roll(points, -turn * TIMED, axis=0)[:TIMED]))

    by_surrogate = lambda _: judge(example.predicted(model, batch))  # noqa: E731
    return in_turn({example.SURROGATE: (by_surrogate, len(batch)), example.SOLVER: (by_solver, TIMED)}, ROUNDS)


def densities(sample: Sample, bounds: np.ndarray, bins: int) -> list[dict[str, np.ndarray]]:
    """Histogram of each parameter between bounds (3, 2)."""
    found = []
    for values, ends in zip(np.exp(sample.logarithms).T, bounds, strict=True):
        density, edges = np.histogram(values, bins, ends, weights=sample.weights)
        found.append({"edges": edges, "density": density / np.diff(edges)})
    return found


def described(found: example.Inference) -> dict[str, Any]:
    """Summaries and histograms of the posteriors, on the same bounds; of pairs for the surrogate alone."""
    summaries = {name: sample.summary() for name, sample in found.posteriors.items()}
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
        for name, sample in found.posteriors.items()
    }
    sample, pairs = found.posteriors[example.SURROGATE], []
    for pair in ([0, 1], [1, 2]):
        values, ends = np.exp(sample.logarithms).T[pair], bounds[pair]
        density, x, y = np.histogram2d(*values, PAIR_BINS, ends, weights=sample.weights)
        pairs.append({"parameters": pair, "x": x, "y": y, "density": density})
    content[example.SURROGATE]["pairs"] = pairs
    return content


def study(
    *,
    samples: Annotated[int, typer.Option(min=example.LEAST, help="Samples of the surrogate.")] = 1_000_000,
    solver_samples: Annotated[int, typer.Option(min=example.LEAST, help="Samples of the solver.")] = 4_000,
    seed: Seed = 0,
) -> dict[str, Any]:
    """Infer, time and describe."""
    measured, noise = example.measured_curve(seed=seed)
    model = surrogate.load("fast")
    counts = {"samples": samples, "solver_samples": solver_samples}
    with CLOCK:
        found = example.infer(measured, noise, model, **counts, seed=seed, show=progress)
    posteriors = found.posteriors
    seconds = cost(model, posteriors[example.SURROGATE].logarithms[: 2 * BATCH], likelihood(measured, noise))
    solver = posteriors[example.SOLVER]
    chosen = np.random.default_rng(seed).choice(len(solver), SHOWN, p=solver.weights)
    mean = posteriors[example.SURROGATE].summary()["mean"]
    return {
        "parameters": list(example.PRIOR),
        "prior": example.PRIOR,
        "true": example.TRUE,
        "calibration": example.CALIBRATION,
        "posteriors": described(found),
        "seconds": seconds,
        "spent": found.seconds,
        "searched": found.searched,
        "solver_shown": np.exp(solver.logarithms[chosen]),
        "curve": {"time": example.instants(), "measured": measured, "mean": example.simulated(np.log([mean]))[0]},
    }

"""How well measurement steps hold what they measure, uniform ones as in the paper and physical ones; where these lie.

The floor: the solver's own forces at the steps are a perfect model's. Their largest, and the top of the parabola
through it and its neighbours, are compared with the solver's pull-off force, their loop area with its hysteresis: by
the trapezoidal rule, as the paper does, and by monotone cubics.

The place where the pull-off of a protocol is to be expected is a polynomial for the physical steps. Its coefficients
are fitted by least absolute residuals to the solver's pull-offs over the ranges, towards their edges and in their
corners. Judged on other protocols are the residual of log s (`bem.dataset.physical_steps`), and the error of the
pull-off force that the solver's own forces at the steps show, in percent.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bem import Trajectory
from bem.dataset import physical_steps
from bem.dataset.designs import OUTERMOST, PAPER_RANGES
from bem.dataset.measurement_steps import PHYSICAL, STEPS_VERSION
from bem.problem.protocol import default_start_indentation
from experiments.cases import ANY_SOLID, RANGES, STEPS, Hidden, results_of
from experiments.harness import Count
from experiments.measurements.statistics import quantiles

EXAMPLE = {
    "tabor": 0.55,
    "peak_indentation": 69.0,
    "loading_rate": 1.2,
    "dwell_time": 0.003,
    "unloading_rate": 900.0,
    "modulus_ratio": 0.04,
}
"""A narrow peak, drawn with both kinds of steps."""
READINGS = ("pull_off", "pull_off_parabola", "hysteresis_trapezoids", "hysteresis_cubics")
"""Highest step, a parabola's top there, and the loop by trapezoids and by cubics."""
CORNERS = 2 ** len(RANGES)
FITTED = {"box": (3000, 1), "edges": (3000, 2), "corners": (20 * CORNERS, 3)}
JUDGED = {"box": (3000, 4), "corners": (60 * CORNERS, 5)}
"""Protocols of each kind and their seeds."""
KNEE = 0.05  # residual below which least squares are used


def reading_errors(
    times: np.ndarray, indentations: np.ndarray, force: np.ndarray, counts: tuple[int, int, int], true: np.ndarray
) -> np.ndarray:
    """Relative errors of what forces at the steps show, shape (4, n), in the order of `READINGS`.

    Args:
        times, indentations, force: Histories of shape (n, N).
        counts: Points of loading, dwell and unloading.
        true: Pull-off force and hysteresis, shape (2, n).
    """
    from surrogate.data.metrics import hysteresis
    from surrogate.intervals import results

    top, _, area, *_ = results(times, indentations, force, np.array(counts))
    highest = force[:, counts[0] + counts[1] - 1 :].max(axis=1)
    readings = np.stack([highest, top, hysteresis(indentations, force), np.abs(area)])
    return np.abs(readings / np.repeat(true, 2, axis=0) - 1.0)


def errors(
    trajectories: Sequence[Trajectory], times: np.ndarray, indentations: np.ndarray, counts: tuple[int, int, int]
) -> np.ndarray:
    """The same of the solver's own forces at the steps, which are a perfect model's."""
    force = np.array([trajectory.at(instants) for trajectory, instants in zip(trajectories, times, strict=True)])
    return reading_errors(times, indentations, force, counts, results_of(trajectories).T)


def example() -> dict[str, Any]:
    """The force of one protocol, and both kinds of steps on it, while unloading."""
    protocol = {name: np.array([value]) for name, value in EXAMPLE.items()}
    hidden = Hidden(protocol)
    (true,) = hidden.simulated()
    curves = {"indentation": true.indentation[true.unloading], "force": true.force[true.unloading], "steps": {}}
    for steps, counts in STEPS.items():
        times, indentations = (values[0, counts[0] + counts[1] - 1 :] for values in hidden.grid(steps))
        curves["steps"][steps] = {"indentation": indentations, "force": true.at(times)}
    return curves


def study_measurement_floor(*, count: Count = 2000) -> dict[str, Any]:
    """Measure the floor of both kinds of steps on hidden protocols of any modulus ratio."""
    hidden = Hidden.draw(count, ANY_SOLID)
    trajectories = list(hidden.simulated())
    result: dict[str, Any] = {"count": count, "example": example(), "kinds": {}}
    for steps, counts in STEPS.items():
        relative_errors = errors(trajectories, *hidden.grid(steps), counts)
        readings = {name: quantiles(values) for name, values in zip(READINGS, relative_errors, strict=True)}
        result["kinds"][steps] = {"counts": counts, **readings, "pull_off_errors": np.sort(relative_errors[0])}
    return result


def drawn(region: str, count: int, seed: int) -> Hidden:
    """Protocols over the ranges, denser towards their edges, or in each corner in turn."""
    unit = np.random.default_rng(seed).random((count, len(RANGES)))
    if region == "edges":
        unit = np.sin(0.5 * np.pi * unit) ** 2
    elif region == "corners":
        bits = (np.arange(count)[:, np.newaxis] >> np.arange(len(RANGES))) & 1
        unit = OUTERMOST * unit + (1.0 - OUTERMOST) * bits
    low, high = np.array(list(RANGES.values())).T
    values = np.clip(low * (high / low) ** unit, low, high)
    return Hidden(dict(zip(RANGES, values.T.copy(), strict=True)))


def features(hidden: Hidden) -> tuple[np.ndarray, np.ndarray]:
    """The features of each protocol with 1, (n, 7), and where its force without adhesion vanishes, (n,)."""
    columns = hidden.quantities
    start, ratio = default_start_indentation(columns["tabor"]), columns["modulus_ratio"]
    protocols = np.stack([*(columns[name] for name in PAPER_RANGES), start, ratio])
    nowhere = np.zeros(len(physical_steps.FACTORS))
    *_, crossings, factors = physical_steps.on_steps(protocols, np.array(PHYSICAL), nowhere)
    return factors, crossings


def study_pull_off_place() -> dict[str, Any]:
    """Fit the expected place of the pull-off, and judge it and the steps."""
    terms, logs, parts = {}, {}, {}
    for purpose, kinds in (("fitted", FITTED), ("judged", JUDGED)):
        for region, (count, seed) in kinds.items():
            hidden, key = drawn(region, count, seed), (purpose, region)
            factors, crossings = features(hidden)
            parts[key] = hidden, list(hidden.simulated())
            places = [np.interp(run.pull_off_time, run.time, run.indentation) for run in parts[key][1]]
            terms[key] = factors[:, physical_steps.FACTORS].prod(axis=2)
            logs[key] = np.log(np.maximum(crossings - places, 1e-3 * np.exp(factors[:, 3])))
    chosen = [key for key in terms if key[0] == "fitted"]
    fitted, targets = (np.concatenate([values[key] for key in chosen]) for values in (terms, logs))
    size, weights = np.abs(fitted).max(axis=0), np.ones(len(targets))
    for _ in range(11):  # least absolute residuals, by least squares of changing weights
        root = np.sqrt(weights)
        coefficients = np.linalg.lstsq(fitted / size * root[:, np.newaxis], targets * root, rcond=None)[0] / size
        weights = 1.0 / np.maximum(np.abs(targets - fitted @ coefficients), KNEE)
    physical_steps._PLACE[:] = coefficients
    result: dict[str, Any] = {"steps_version": STEPS_VERSION, "coefficients": coefficients.tolist()}
    for region in JUDGED:
        hidden, trajectories = parts["judged", region]
        floor = 100.0 * errors(trajectories, *hidden.grid("physical"), PHYSICAL)[1]
        residual = logs["judged", region] - terms["judged", region] @ coefficients
        result[region] = {"residual": np.quantile(residual, [0.05, 0.5, 0.95]), "p99": float(np.quantile(floor, 0.99))}
        if region == "corners":
            result[region]["worst_p90"] = max(float(np.quantile(floor[row::CORNERS], 0.9)) for row in range(CORNERS))
    return result

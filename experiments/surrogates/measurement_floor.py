"""How well measurement steps hold what they measure: uniform ones as in the paper, and physical ones.

The solver's own forces at the steps are a perfect model's. Their largest, and the top of the parabola through it and
its neighbours, are compared with the solver's pull-off force, their loop area with its hysteresis: by the trapezoidal
rule, as the paper does, and by monotone cubics.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bem import Trajectory
from experiments.measurements.cases import ANY_SOLID, STEPS, Hidden, results_of
from experiments.measurements.harness import Count
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
    from surrogate.prediction.bands import results

    top, _, _, area, _ = results(times, indentations, force, np.array(counts))
    highest = force[:, counts[0] + counts[1] - 1 :].max(axis=1)
    found = np.stack([highest, top, hysteresis(indentations, force), np.abs(area)])
    return np.abs(found / np.repeat(true, 2, axis=0) - 1.0)


def errors(
    trajectories: Sequence[Trajectory], times: np.ndarray, indentations: np.ndarray, counts: tuple[int, int, int]
) -> np.ndarray:
    """The same of the solver's own forces at the steps, which are a perfect model's."""
    force = np.array([one.at(instants) for one, instants in zip(trajectories, times, strict=True)])
    return reading_errors(times, indentations, force, counts, results_of(trajectories).T)


def example() -> dict[str, Any]:
    """The force of one protocol, and both kinds of steps on it, while unloading."""
    protocol = {name: np.array([value]) for name, value in EXAMPLE.items()}
    hidden = Hidden(protocol)
    (true,) = hidden.simulated()
    found = {"indentation": true.indentation[true.unloading], "force": true.force[true.unloading], "steps": {}}
    for kind, counts in STEPS.items():
        times, indentations = (values[0, counts[0] + counts[1] - 1 :] for values in hidden.grid(kind))
        found["steps"][kind] = {"indentation": indentations, "force": true.at(times)}
    return found


def study(*, count: Count = 2000) -> dict[str, Any]:
    """Measure the floor of both kinds of steps on hidden protocols of any modulus ratio."""
    hidden = Hidden.draw(count, ANY_SOLID)
    trajectories = list(hidden.simulated())
    content: dict[str, Any] = {"count": count, "example": example(), "kinds": {}}
    for kind, counts in STEPS.items():
        found = errors(trajectories, *hidden.grid(kind), counts)
        readings = {name: quantiles(values) for name, values in zip(READINGS, found, strict=True)}
        content["kinds"][kind] = {"counts": counts, **readings, "pull_off_errors": np.sort(found[0])}
    return content

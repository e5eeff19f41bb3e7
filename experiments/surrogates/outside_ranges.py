"""Errors of the pull-off force outside the ranges of the training: how far predictions can be trusted there.

One quantity at a time lies beyond an end of its range, by a share of the range's width in its logarithm, and the others
anywhere inside; then all lie beyond an end, by shares that add up to the same. The pull-off force is compared with the
solver's, and that of M1-concat, whose steps alone err by more, with the solver's at the same steps.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import surrogate
from bem._support.wording import markdown_table
from bem.results.trajectory import Trajectory
from experiments.cases import RANGES, cases_of
from experiments.common import MODULUS_RATIO
from experiments.harness import Count, Seed, progress
from experiments.measurements.tools import predicted
from surrogate.files import PRETRAINED
from surrogate.trajectory import INTERVALS, PredictedTrajectory
from surrogate.validity import MARGIN, allowed

DISTANCES = (0.0, 0.04, MARGIN)
ENDS = tuple(f"{end} {name}" for name in RANGES for end in ("low", "high"))[:-1]  # no solid is beyond elastic
ALL = "all"
LEVELS = (0.5, 0.9)
RESULTS = ("pull_off_force", "pull_off_time", "hysteresis")
"""Those with intervals, in the order of `INTERVALS`."""


def beyond(where: str, distance: float, count: int, seed: int) -> dict[str, np.ndarray]:
    """Draw columns of protocols beyond one of `ENDS`, or beyond an end of every range, by `distance` in all."""
    rng, columns = np.random.default_rng(seed), {}
    for name, (low, high) in RANGES.items():
        share = rng.random(count)
        end, _, quantity = where.partition(" ")
        if where == ALL or quantity == name:
            upper = share > 0.5 if where == ALL else np.full(count, end == "high")
            own = distance / len(RANGES) if where == ALL else distance
            share = np.where(upper, 1.0 + own, -own)
        columns[name] = low * (high / low) ** share
    return columns | {"modulus_ratio": np.minimum(columns["modulus_ratio"], 1.0)}


def pull_off_error(prediction: PredictedTrajectory, trajectory: Trajectory, on_steps: bool) -> float:
    """Error of a predicted pull-off force in percent of the solver's, or of the largest at the steps of unloading."""
    times = np.clip(prediction.time[prediction.unloading], trajectory.time[0], trajectory.time[-1])
    force = trajectory.at(times).max() if on_steps else trajectory.pull_off_force
    return 100.0 * abs(prediction.pull_off_force / force - 1.0)


def covered_share(pairs: Sequence[tuple[PredictedTrajectory, Trajectory]], interval: str, result: str) -> float:
    """Share of the solver's values that lie inside the intervals of a result."""
    ends = [getattr(prediction, interval) for prediction, _ in pairs]
    values = (getattr(trajectory, result) for _, trajectory in pairs)
    return float(np.mean([low <= value <= high for (low, high), value in zip(ends, values, strict=True)]))


def vertices_text(outside_ranges: Any) -> str:
    """The coverage at the vertices of the ranges, as a sentence of the table of limits."""
    shares = (
        f"{', '.join(f'{100 * share:.0f}' for share in covered)} % (`{name}`)"
        for name, covered in outside_ranges["covered at the vertices"].items()
    )
    return f"at the vertices the 90 % intervals of pull-off force, its time and hysteresis contain {', '.join(shares)}"


def study(*, count: Count = 100, seed: Seed = 5) -> dict[str, Any]:
    """Compare predictions of `fast`, `accurate` and M1-concat with the solver beyond each end of the ranges."""
    models = {name: surrogate.load(name) for name in (*PRETRAINED, "M1-concat")}
    quantiles: dict[str, Any] = {name: {} for name in models}
    covered: dict[str, list[float]] = {}
    for name, model in models.items():  # which refuse nothing then
        if name in PRETRAINED:
            everywhere = {"low": np.full_like(model.reach.low, -np.inf), "high": np.full_like(model.reach.high, np.inf)}
            model.reach = replace(model.reach, **everywhere, limit=np.array(np.inf))
        else:
            wide = {name: (1e-9 * low, 1e9 * high) for name, (low, high) in model.scaling.ranges.items()}
            model.network.scaling = replace(model.scaling, ranges=wide)
    places = [(where, distance) for where in (*ENDS, ALL) for distance in DISTANCES]
    for where, distance in progress(places, "ends of ranges"):
        solids = beyond(where, distance, count, seed)
        paper = solids | {"modulus_ratio": np.full(count, MODULUS_RATIO)}
        exact = [[case.simulated("standard") for case in cases_of(columns)] for columns in (solids, paper)]
        for name, model in models.items():
            on_steps = name not in PRETRAINED
            hidden = paper if on_steps else solids
            pairs = list(zip(predicted(model, name, hidden), exact[on_steps], strict=True))
            errors = [pull_off_error(*pair, on_steps) for pair in pairs]
            quantiles[name].setdefault(where, {})[f"{distance:g}"] = np.quantile(errors, LEVELS).tolist()
            if not on_steps and (where, distance) == (ALL, 0.0):
                covered[name] = [covered_share(pairs, *results) for results in zip(INTERVALS, RESULTS, strict=True)]
    return {"count": count, "models": quantiles, "covered at the vertices": covered}


def page_text(outside_ranges: Any) -> str:
    """The errors at the end of a range that errs most, and beyond all of them, as a table of a page."""
    rows = []
    for name, places in outside_ranges["models"].items():
        ends = {where: errors for where, errors in places.items() if where != ALL}
        for title, chosen in (
            ("one range, at the end that errs most", ends),
            ("all ranges at once", {ALL: places[ALL]}),
        ):
            largest = [np.max([errors[f"{away:g}"] for errors in chosen.values()], axis=0) for away in DISTANCES]
            rows.append([name, title, *(", ".join(f"{level:.2g}" for level in levels) for levels in largest)])
    limits = ["`{}` {:.3g} to {:.4g}".format(name, *allowed(name, *bounds)) for name, bounds in RANGES.items()]
    heads = ["Model", "Beyond", *(f"{100 * distance:g} %" for distance in DISTANCES)]
    return (
        f"{markdown_table(heads, rows, 'llrrr')}\n\nThe margin is {100 * MARGIN:g} %. One quantity alone may be "
        f"{', '.join(limits)}. Measured by `{outside_ranges['command']}`."
    )

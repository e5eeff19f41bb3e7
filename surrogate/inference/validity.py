"""Range of validity: the quantities of a history that lie outside those of the training, with value and range.

The protocol's own quantities have the ranges of the training set. The others are what all training histories have in
common: they begin and end at -pi^(2/3) mu, consist of a straight ramp, a dwell and a straight ramp back, and have 50,
20 and 50 equally spaced points there. Deviations below the tolerances of this module hardly change the error against
the solver, except for the number of points: 100 to 140, in proportion, are the nearby resolutions that the paper shows
(its appendix "FMS-resolution transferability"); `experiments.paper.fms_transfer` measures their error.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bem.dataset.measurement_steps import proportional_counts
from bem.protocol import default_start_indentation
from surrogate.data.features import plateau

# Leaves room for rates recovered from rounded times.
RANGE_TOLERANCE = 1e-6

FEWEST, MOST = (proportional_counts(total) for total in (100, 140))
POINTS = {
    f"{phase}_points": bounds
    for phase, bounds in zip(("loading", "dwell", "unloading"), zip(FEWEST, MOST, strict=True), strict=True)
}
"""Points of each phase without a warning."""

START_TOLERANCE = 0.03
"""How far start and end may lie from -pi^(2/3) mu, as a share of it."""

BEND_TOLERANCE = 0.005
"""How far indentations may lie from the straight ramps and the dwell, as a share of the travel."""

LARGEST_STEP_RATIO = 1.5
"""How much longer the longest time step of a phase may be than its shortest."""


PROTOCOL = "compare with the solver before you trust a protocol the model has not seen (`surrogate predict --check`)"
ENDS = "begin and end the history at -pi^(2/3) tabor, as all of the training do"
STEPS = (
    "the model counts points: give it 50 equally spaced ones in loading, 20 in the dwell and 50 in unloading, to which "
    "`surrogate predict --in` and `surrogate.inference.histories.predict_history` resample a measured history"
)
BEND = "the model knows straight ramps and a flat dwell: average noise away, or ask the solver about another path"
ADVICE = {
    **dict.fromkeys(("start_indentation", "end_indentation"), ENDS),
    **dict.fromkeys((*POINTS, "step_ratio"), STEPS),
    "bend": BEND,
}
"""Advice on a quantity out of its range; `PROTOCOL` for those of the protocol itself."""


class ExtrapolationWarning(UserWarning):
    """A prediction was asked for outside the ranges the model was trained on."""


@dataclass(frozen=True)
class Excess:
    """A quantity that leaves its range somewhere; arrays of shape `(batch,)`."""

    name: str
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    beyond: np.ndarray
    """How far each value lies outside, zero for those inside and those that do not exist."""

    def words(self, index: int) -> str:
        """Name, value and range for one history."""
        return f"{self.name} = {self.values[index]:.6g} lies outside [{self.low[index]:.6g}, {self.high[index]:.6g}]"


def excesses(quantities: dict[str, np.ndarray], ranges: dict[str, tuple[float, float]]) -> list[Excess]:
    """Return the quantities that leave their range.

    Args:
        quantities: Values by name, each of shape `(batch,)`; NaN where a history has no such thing.
        ranges: Smallest and largest training value by name. The others' ranges are this module's.
    """
    bounds: dict[str, tuple[float | np.ndarray, float | np.ndarray]] = {
        **ranges,
        **POINTS,
        "bend": (0.0, BEND_TOLERANCE),
        "step_ratio": (1.0, LARGEST_STEP_RATIO),
    }
    if "tabor" in quantities:
        usual = default_start_indentation(quantities["tabor"])
        around = ((1.0 + START_TOLERANCE) * usual, (1.0 - START_TOLERANCE) * usual)
        bounds |= {"start_indentation": around, "end_indentation": around}
    names = [name for name in quantities if name in bounds]
    if not names:
        return []
    # All at once, because a single prediction takes little longer than a few dozen array operations.
    values = np.array([quantities[name] for name in names])
    low, high = np.empty_like(values), np.empty_like(values)
    for row, name in enumerate(names):
        low[row], high[row] = bounds[name]
    below, above = low - values, values - high
    beyond = np.maximum(below, above)
    outside = (below > RANGE_TOLERANCE * np.abs(low)) | (above > RANGE_TOLERANCE * np.abs(high))
    return [
        Excess(names[row], values[row], low[row], high[row], np.where(outside[row], beyond[row], 0.0))
        for row in np.flatnonzero(outside.any(axis=1))
    ]


def worst(found: Iterable[Excess]) -> list[str]:
    """Describe for every quantity the value farthest outside."""
    return [excess.words(int(excess.beyond.argmax())) for excess in found]


def advice(words: Iterable[str]) -> str:
    """Return the advice on what `Excess.words` reported, each piece once."""
    return "; ".join(dict.fromkeys(ADVICE.get(quantity.split(" = ")[0], PROTOCOL) for quantity in words))


def of_history(found: Iterable[Excess], index: int) -> tuple[str, ...]:
    """Describe what of one history lies outside."""
    return tuple(excess.words(index) for excess in found if excess.beyond[index] > 0.0)


def history_quantities(
    times: np.ndarray, indentations: np.ndarray, edge: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """Recover what `excesses` judges from histories; NaN where a phase is absent.

    Args:
        times: Times of shape `(batch, steps)`.
        indentations: Indentations of the same shape.
        edge: Marks of the dwell's ends, of the same shape, where the caller knows them. By default, and where there are
            not one or two marks, the dwell is the longest run of constant indentation.
    """
    marks = [None] * len(times) if edge is None else edge
    rows = [_history(*row) for row in zip(times, indentations, marks, strict=True)]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def has_measurement_steps(times: np.ndarray, indentations: np.ndarray, edge: np.ndarray | None = None) -> bool:
    """Tell whether the points of one history are about as many in each phase, and as even, as the models learned from.

    Args:
        times: Times of shape `(steps,)`.
        indentations: Indentations of the same shape.
        edge: Marks of the dwell's ends, where they are known.
    """
    found = _history(times, indentations, edge)
    shape = {name: np.array([found[name]]) for name in (*POINTS, "bend", "step_ratio")}
    return not np.isnan(shape["dwell_points"]).any() and not excesses(shape, {})


def dwell_ends(indentation: np.ndarray, edge: np.ndarray | None = None) -> tuple[int, int]:
    """Return the first and the last point of the dwell; twice the highest point where there is none."""
    if edge is not None and 1 <= np.count_nonzero(edge) <= 2:
        marks = np.flatnonzero(edge)
        return int(marks[0]), int(marks[-1])
    peak = int(np.argmax(indentation))
    return plateau(indentation) or (peak, peak)


def _history(time: np.ndarray, indentation: np.ndarray, edge: np.ndarray | None) -> dict[str, float]:
    onset, end = dwell_ends(indentation, edge)
    last = len(time) - 1
    corners = sorted({0, onset, end, last})
    travel = np.ptp(indentation)
    straight = np.interp(time, time[corners], indentation[corners])
    steps = np.diff(time)
    phases = (steps[begin:stop] for begin, stop in pairwise(corners))
    ratios = [float(phase.max() / phase.min()) for phase in phases]
    return {
        "peak_indentation": float(indentation.max()),
        "loading_rate": _slope(time, indentation, 0, onset),
        "dwell_time": float(time[end] - time[onset]),
        "unloading_rate": -_slope(time, indentation, end, last),
        "start_indentation": float(indentation[0]),
        "end_indentation": float(indentation[last]),
        "loading_points": onset + 1.0,
        # Without a dwell there is nothing to count; its time of zero is checked anyway.
        "dwell_points": float(end - onset) if end > onset else np.nan,
        "unloading_points": float(last - end),
        "bend": float(np.abs(indentation - straight).max() / travel) if travel else 0.0,
        "step_ratio": max(ratios, default=1.0),
    }


def _slope(time: np.ndarray, indentation: np.ndarray, begin: int, end: int) -> float:
    return float((indentation[end] - indentation[begin]) / (time[end] - time[begin])) if end > begin else np.nan

"""Range of validity: the quantities of a history that are outside the range of the training set.

The ranges of the protocol quantities are those of the training set. The other ranges describe what all training
histories have in common: they start and end at -pi^(2/3) mu, and consist of a straight ramp, a dwell and a straight
ramp back with 50, 20 and 50 equally spaced points. Deviations within the tolerances of this module hardly change the
error against the solver. The number of points is an exception: 100 to 140 points in the same proportions are the
resolutions that the paper compares (its appendix "FMS-resolution transferability of the M1-concat surrogate"), and
`experiments.paper.fms_transfer` measures their error. Units as in `bem.protocol`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from bem.dataset.measurement_steps import proportional_counts
from bem.protocol import default_start_indentation
from surrogate.data.features import plateau

RANGE_TOLERANCE = 1e-6
"""Relative tolerance of all bounds, for rates that are computed from rounded times."""

FEWEST, MOST = (proportional_counts(total) for total in (100, 140))
POINTS = {
    f"{phase}_points": bounds
    for phase, bounds in zip(("loading", "dwell", "unloading"), zip(FEWEST, MOST, strict=True), strict=True)
}
"""Smallest and largest number of points in each phase."""
SHAPE = (*POINTS, "bend", "step_ratio")
"""Quantities that tell whether a history has points like those of the training."""

START_TOLERANCE = 0.03
"""Largest relative difference of start and end from -pi^(2/3) mu."""

BEND_TOLERANCE = 0.005
"""Largest difference of an indentation from the straight ramps and the dwell, as a fraction of the travel."""

LARGEST_STEP_RATIO = 1.5
"""Largest ratio of the longest to the shortest time step within a phase."""

PROTOCOL = "compare with the solver before you trust a protocol the model has not seen (`surrogate predict --check`)"
ENDS = "begin and end the history at -pi^(2/3) tabor, as all of the training do"
STEPS = (
    "the model counts points: give it 50 equally spaced ones in loading, 20 in the dwell and 50 in unloading, to which "
    "`surrogate predict --in` and `surrogate.prediction.measured.predict_measured` resample a measured history; `fast` "
    "and `accurate` count those of `bem.dataset.physical_steps.physical_grid`"
)
BEND = "the model knows straight ramps and a flat dwell: average noise away, or ask the solver about another path"
EDGE = "set edge=True at the first and at the last point of the dwell, and nowhere else"
CYCLES = "start every cycle with a new stream or `reset`"
ADVICE = {
    **dict.fromkeys(("start_indentation", "end_indentation"), ENDS),
    **dict.fromkeys((*POINTS, "step_ratio", "compression_points"), STEPS),
    "bend": BEND,
    "edge_marks": EDGE,
    "cycles": CYCLES,
}
"""Advice by the name of the quantity outside its range; `PROTOCOL` holds for the quantities that are not listed."""


class ExtrapolationWarning(UserWarning):
    """A prediction is outside the ranges of the training set."""


@dataclass(frozen=True)
class Excess:
    """A quantity that is outside its range in at least one history.

    Args:
        name: Name of the quantity.
        values: Its values, shape `(batch,)`.
        low: Lower bounds, shape `(batch,)`.
        high: Upper bounds, shape `(batch,)`.
        beyond: Distance of each value from its range, shape `(batch,)`; zero inside the range, and for NaN.
    """

    name: str
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    beyond: np.ndarray

    def words(self, index: int) -> str:
        """Return name, value and range for the history `index` as text."""
        return f"{self.name} = {self.values[index]:.6g} lies outside [{self.low[index]:.6g}, {self.high[index]:.6g}]"


def excesses(quantities: dict[str, np.ndarray], ranges: dict[str, tuple[float, float]]) -> list[Excess]:
    """Return the quantities that are outside their range.

    Args:
        quantities: Values by name, each of shape `(batch,)`; NaN if a history does not have the quantity. Names without
            a range are ignored.
        ranges: Smallest and largest value in the training set, by name. This module has the ranges of the others.

    Returns:
        One entry for each quantity of which at least one value is outside; empty if there is none.
    """
    bounds = bounds_of(ranges, quantities.get("tabor"))
    names = [name for name in quantities if name in bounds]
    if not names:
        return []
    # One set of array operations for all quantities: a prediction takes hardly longer than a few dozen of them.
    values = np.array([quantities[name] for name in names])
    low, high = np.empty_like(values), np.empty_like(values)
    for row, name in enumerate(names):
        low[row], high[row] = bounds[name]
    below, above = low - values, values - high
    outside = (below > RANGE_TOLERANCE * np.abs(low)) | (above > RANGE_TOLERANCE * np.abs(high))
    if not outside.any():
        return []
    beyond = np.where(outside, np.maximum(below, above), 0.0)
    rows = np.flatnonzero(outside.any(axis=1))
    return [Excess(names[row], values[row], low[row], high[row], beyond[row]) for row in rows]


def bounds_of(ranges: dict[str, Any], tabor: Any) -> dict[str, tuple[Any, Any]]:
    """Return the bounds of all quantities by name; those of start and end if the Tabor parameter is known."""
    ends = {}
    if tabor is not None:
        start = default_start_indentation(tabor)
        near = (1.0 + START_TOLERANCE) * start, (1.0 - START_TOLERANCE) * start
        ends = {"start_indentation": near, "end_indentation": near}
    return {
        **POINTS,
        "bend": (0.0, BEND_TOLERANCE),
        "step_ratio": (1.0, LARGEST_STEP_RATIO),
        "edge_marks": (2.0, 2.0),
        "cycles": (1.0, 1.0),
        **ends,
        **ranges,
    }


def warn_of_extrapolation(name: str, found: list[Excess], where: str = "") -> None:
    """Issue one `ExtrapolationWarning` for all excesses, if there are any, at the caller of the calling method.

    Args:
        name: Name of the model.
        found: What `excesses` returned; of each quantity, the value farthest outside is named.
        where: What lies outside, in words; by default the model.
    """
    if found:
        words = [excess.words(int(excess.beyond.argmax())) for excess in found]
        message = f"{where or f'{name} extrapolates beyond its training'}: {'; '.join(words)}. Advice: {advice(words)}"
        warnings.warn(message, ExtrapolationWarning, stacklevel=3)


def advice(words: Iterable[str]) -> str:
    """Return the advice on the texts of `Excess.words`, without repetition."""
    return "; ".join(dict.fromkeys(ADVICE.get(quantity.split(" = ")[0], PROTOCOL) for quantity in words))


def of_history(found: Iterable[Excess], index: int) -> tuple[str, ...]:
    """Return the quantities of the history `index` that are outside their range, as text."""
    return tuple(excess.words(index) for excess in found if excess.beyond[index] > 0.0)


def history_quantities(
    times: np.ndarray, indentations: np.ndarray, edge: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """Return the quantities of histories that `excesses` checks, by name, each of shape `(batch,)`.

    A quantity of a phase that a history does not have is NaN.

    Args:
        times: Times of shape `(batch, steps)`.
        indentations: Indentations of the same shape.
        edge: Marks of the same shape, one at the first and the last point of the dwell and zero elsewhere, if known. By
            default, and for a history without one or two marks, the dwell is the longest run of constant indentation.

    Returns:
        Arrays of shape `(batch,)` by the name of the quantity.
    """
    marks = [None] * len(times) if edge is None else edge
    rows = [_history(*row) for row in zip(times, indentations, marks, strict=True)]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def dwell_ends(indentation: np.ndarray, edge: np.ndarray | None = None) -> tuple[int, int]:
    """Return the indices of the first and the last point of the dwell; without a dwell, twice that of the peak.

    Args:
        indentation: Indentations of one history, shape `(steps,)`.
        edge: Marks of the same shape, as for `history_quantities`.

    Returns:
        The two indices.
    """
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
        # Without a dwell there is no number of points; the dwell time of zero is checked.
        "dwell_points": float(end - onset) if end > onset else np.nan,
        "unloading_points": float(last - end),
        "bend": float(np.abs(indentation - straight).max() / travel) if travel else 0.0,
        "step_ratio": max(ratios, default=1.0),
    }


def _slope(time: np.ndarray, indentation: np.ndarray, begin: int, end: int) -> float:
    return float((indentation[end] - indentation[begin]) / (time[end] - time[begin])) if end > begin else np.nan

"""Prediction of the force along a measured, noisy indentation history.

The paper's models were trained on 50 points of loading, 20 of dwell and 50 of unloading, without noise. To a history
with other points, a protocol is fitted by least squares: straight from the first point to the peak, constant over the
dwell, and straight to the last point. The force is predicted at the measurement steps of that protocol, and
interpolated to the times of the history. The path is linear in the indentations of start, peak and end, so only the two
times at which the dwell begins and ends are searched for. Two assumptions hold unless the points contradict them: the
dwell begins and ends where the sampling interval changes, and the path starts and ends at -pi^(2/3) mu. Units as in
`bem.protocol`.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import least_squares

from bem.dataset.measurement_steps import FMS
from bem.protocol import PiecewiseLinearProtocol, default_start_indentation
from bem.scene import Scene
from surrogate.data.features import edge_from_counts
from surrogate.prediction.predicted import PredictedTrajectory, predicted_trajectories
from surrogate.prediction.validity import SHAPE, ExtrapolationWarning, check_history, dwell_ends

if TYPE_CHECKING:
    from surrogate.prediction.predictor import Surrogate

EXACT = 1e-6
"""Largest residual in an exact history, as a fraction of the range of the indentations; it allows for rounding."""
LARGEST_BEND, BLOCKS = 0.02, 24
"""Largest mean residual over a block of neighbouring points, as a fraction of the travel, and number of blocks."""
LARGEST_NOISE = 0.05
"""Largest standard deviation of the noise, as a fraction of the travel."""
SAMPLING_TOLERANCE = 1e-3
"""Largest relative difference between two time steps of the same sampling interval."""
SMALLEST_RETURN = 0.1
"""Smallest change of indentation in each ramp, as a fraction of the travel."""
FEWEST_POINTS = 4
"""Smallest number of points in a ramp, to determine its rate."""
PEAK = 0.05
"""Depth below the largest indentation, as a fraction of their range, at which the search for the corners begins."""


@dataclass(frozen=True)
class FittedProtocol:
    """A path of two straight ramps with a dwell between them.

    Args:
        corners: Times of start, first and last point of the dwell, and end, shape `(4,)`. Without a dwell, the two in
            the middle are equal.
        levels: Indentations there.
        residual: Root mean square difference between the indentations of the history and the path.
        exact: Whether the points of the history lie on the path up to rounding.
    """

    corners: np.ndarray
    levels: np.ndarray
    residual: float
    exact: bool

    def with_dwell(self, dwell_time: float) -> FittedProtocol:
        """Return the path with a longer dwell of the same middle.

        Each ramp gives at most a tenth of its duration to the dwell, which may then be shorter than `dwell_time`.
        """
        ramps = 0.1 * np.diff(self.corners)[[0, 2]]
        lent = np.minimum(0.5 * (dwell_time - (self.corners[2] - self.corners[1])), ramps)
        return replace(self, corners=self.corners + np.array([0.0, -lent[0], lent[1], 0.0]))

    def summary(self) -> dict[str, float]:
        """Return the quantities of the protocol and the residual by name, ready for JSON."""
        start, peak, _, end = self.levels.tolist()
        begin, onset, turn, last = self.corners.tolist()
        return {
            "start_indentation": start,
            "peak_indentation": peak,
            "end_indentation": end,
            "loading_rate": (peak - start) / (onset - begin),
            "dwell_time": turn - onset,
            "unloading_rate": (peak - end) / (last - turn),
            "residual": self.residual,
        }

    def words(self) -> str:
        """Return the path and its residual as one line of text."""
        share = 100.0 * self.residual / np.ptp(self.levels)
        return (
            "from {start_indentation:.4g} to {peak_indentation:.4g} at {loading_rate:.4g}, dwell {dwell_time:.4g}, to "
            "{end_indentation:.4g} at {unloading_rate:.4g}; the points differ by {residual:.2g} (rms), "
        ).format(**self.summary()) + f"{share:.2g} % of its travel"


@dataclass(frozen=True)
class HistoryPrediction:
    """Prediction along a history; the files of `surrogate predict` hold it at the points of the history.

    Args:
        time: Times of the history, shape `(steps,)`.
        indentation: Indentations of the history, shape `(steps,)`.
        trajectory: The prediction, at the measurement steps of the fitted protocol, or at the points of the history if
            no protocol was fitted.
        fitted: The fitted protocol; `None` if the history was predicted at its own points.
        unlike: Why no protocol could be fitted, as a sentence; otherwise `""`.
    """

    time: np.ndarray
    indentation: np.ndarray
    trajectory: PredictedTrajectory
    fitted: FittedProtocol | None = None
    unlike: str = ""

    @property
    def force(self) -> np.ndarray:
        """The force at the points of the history, shape `(steps,)`."""
        return np.interp(self.time, self.trajectory.time, self.trajectory.force)

    @property
    def protocol(self) -> PiecewiseLinearProtocol:
        """The path of the prediction, as the solver takes it."""
        if self.fitted is None:
            return PiecewiseLinearProtocol(self.time, self.indentation)
        return PiecewiseLinearProtocol(self.fitted.corners, self.fitted.levels)

    def summary(self) -> dict[str, Any]:
        """Return the scalars and the fitted protocol by name, ready for JSON."""
        summary = self.trajectory.summary()
        return summary if self.fitted is None else summary | {"fitted": self.fitted.summary()}


class NotOneCycleError(ValueError):
    """The history is not one load-dwell-unload cycle."""


def predict_measured(
    model: Surrogate, times: np.ndarray, indentations: np.ndarray, scene: Scene, edge: np.ndarray | None = None
) -> HistoryPrediction:
    """Predict the force along one measured history.

    Args:
        model: A trained model, of uniform measurement steps.
        times: Times of shape `(steps,)`, strictly increasing.
        indentations: Indentations of the same shape; they may have noise.
        scene: The scene.
        edge: Marks of the same shape, one at the first and the last point of the dwell and zero elsewhere, if known.

    Returns:
        The prediction. A history that is not one load-dwell-unload cycle is predicted at its own points, and `unlike`
        says why.

    Raises:
        ValueError: as for `Surrogate.predict_history`, the model has steps of its own, or a ramp has too few points to
            determine its rate.
    """
    if model.steps != "uniform":
        raise ValueError(
            f"Expected a model of uniform measurement steps for a measured history, such as M1-concat of the paper; "
            f"its protocol may be given to any model. Received: {model.name}, which computes at steps of its own"
        )
    check_history(times[np.newaxis], indentations[np.newaxis])
    fitted, unlike = None, ""
    try:
        fitted = fit_protocol(times, indentations, edge=edge, ends=float(default_start_indentation(scene.tabor)))
    except NotOneCycleError as error:
        unlike = str(error)
    (words,) = model.extrapolated(times, indentations, scene, edge)
    if fitted is not None and fitted.exact and fitted.corners[1] < fitted.corners[2]:
        learned = not any(one.partition(" = ")[0] in SHAPE for one in words)
        fitted = None if learned else fitted
    instants, depths, marks = times, indentations, edge
    if fitted is not None:
        # A dwell that is shorter than the interval between two points, or absent, is replaced by the shortest dwell of
        # the training set, or by that interval if it is smaller. Without a dwell there would be fewer steps, on which
        # the model was not trained.
        point = min(int(np.searchsorted(times, fitted.corners[1], side="right")), len(times) - 1)
        shortest = model.scaling.ranges.get("dwell_time", (0.0,))[0] or 1e-3
        shortest = min(float(times[point] - times[point - 1]), shortest)
        if fitted.summary()["dwell_time"] < shortest:
            fitted = fitted.with_dwell(shortest)
        steps, ends = np.arange(sum(FMS)), [0, *np.cumsum(FMS) - 1]
        instants, depths = (np.interp(steps, ends, one) for one in (fitted.corners, fitted.levels))
        marks = edge_from_counts(FMS, 1)[0]
        (words,) = model.extrapolated(instants, depths, scene, marks)
    clock = time.perf_counter()
    with warnings.catch_warnings(action="ignore", category=ExtrapolationWarning):
        force = model.predict_history(instants, depths, scene, marks)
    (trajectory,) = predicted_trajectories(
        instants[np.newaxis],
        depths[np.newaxis],
        force[np.newaxis],
        unloading_from=max(int(depths.argmax()), dwell_ends(depths, marks)[1]),
        seconds=time.perf_counter() - clock,
        extrapolated=[words],
        model=model.name,
    )
    return HistoryPrediction(times, indentations, trajectory, fitted, unlike)


def fit_protocol(
    times: np.ndarray, indentations: np.ndarray, *, edge: np.ndarray | None = None, ends: float | None = None
) -> FittedProtocol:
    """Fit a load-dwell-unload path to a measured indentation history.

    Args:
        times: Times of shape `(steps,)`, strictly increasing.
        indentations: Indentations of the same shape.
        edge: Marks of the same shape, one at the first and the last point of the dwell and zero elsewhere, if known.
            The dwell then begins and ends at these points.
        ends: Expected indentation at start and end; it is used if the points do not contradict it.

    Returns:
        The fitted path.

    Raises:
        NotOneCycleError: the history is not one cycle, or its noise is too large.
        ValueError: a ramp has too few points to determine its rate.
    """
    last = len(times) - 1
    if last < 2:
        raise NotOneCycleError(f"Expected a history of at least three points. Received: {len(times)}")
    marks = np.flatnonzero(edge) if edge is not None else np.empty(0, dtype=int)
    if marks.size > 2 or (marks.size and not 0 < marks[0] <= marks[-1] < last):
        raise NotOneCycleError(
            f"Expected marks of one dwell inside the history. Received: marks at {marks[:5].tolist()}"
        )
    # A corner is a real-valued index into the points, because all phases have points even if their durations differ.
    place = marks[[0, -1]] if marks.size else np.clip(dwell_ends(indentations), 1, last - 1)
    found, fixed = _path(times, indentations, place), bool(marks.size)
    if not (fixed or found.exact):
        top = np.flatnonzero(indentations >= indentations.max() - PEAK * np.ptp(indentations))[[0, -1]]
        begins = (place, np.clip(top, 1, last - 1))
        found = min((_path(times, indentations, one, free=True) for one in begins), key=lambda one: one.residual)
        steps = np.diff(times)
        # Some instruments record each phase with its own sampling interval.
        changes = 1 + np.flatnonzero(np.abs(np.diff(steps)) > SAMPLING_TOLERANCE * np.minimum(steps[1:], steps[:-1]))
        if 1 <= changes.size <= 2 and not found.exact:
            other = _path(times, indentations, changes[[0, -1]])
            found, fixed = (other, True) if _as_good(other, found, len(times)) else (found, False)
    _require_cycle(times, indentations, found)
    if found.exact:
        return found
    if not fixed:
        _require_points(times, found)
    if ends is not None:
        place = np.interp(found.corners[1:3], times, np.arange(len(times)))
        other = _path(times, indentations, place, ends, free=not fixed)
        found = other if _as_good(other, found, len(times)) else found
    return found


def _as_good(other: FittedProtocol, found: FittedProtocol, count: int) -> bool:
    """Return whether `other`, with two parameters fixed, fits as well: a likelihood-ratio test at three sigma."""
    return other.residual**2 <= (1.0 + 9.0 / max(count - 5, 1)) * found.residual**2


def _path(
    times: np.ndarray, indentations: np.ndarray, place: np.ndarray, ends: float | None = None, *, free: bool = False
) -> FittedProtocol:
    """Fit the levels of start, peak and end, of which `ends` fixes two, to two corners at real-valued indices.

    Corners that are `free` are searched for from there.
    """
    last = len(times) - 2.0

    def solved(place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times of the corners, levels, and residuals of all points."""
        first, second = corners = np.interp(place, np.arange(len(times)), times)
        start = np.clip((first - times) / (first - times[0]), 0.0, 1.0)
        end = np.clip((times - second) / (times[-1] - second), 0.0, 1.0)
        weights = np.stack([start, peak := 1.0 - start - end, end], axis=-1)
        if ends is None:
            levels = np.linalg.lstsq(weights, indentations, rcond=None)[0]
        else:
            levels = np.array([ends, peak @ (indentations - ends * (start + end)) / (peak @ peak), ends])
        return corners, levels, indentations - weights @ levels

    def corners_of(found: np.ndarray) -> np.ndarray:
        """Indices from that of the first corner and the number of points of the dwell."""
        first = np.clip(found[0], 1.0, last)
        return np.array([first, np.clip(first + max(found[1], 0.0), first, last)])

    if free:
        low, high = np.array([1.0, 0.0]), np.full(2, last)
        begin, bounds = np.clip([place[0], place[1] - place[0]], low, high), (low - 1e-9, high + 1e-9)
        found = least_squares(lambda one: solved(corners_of(one))[2], begin, bounds=bounds, diff_step=1e-3)
        place = corners_of(found.x)
    corners, levels, residuals = solved(place)
    exact = bool(np.abs(residuals).max() <= EXACT * np.ptp(indentations))
    corners = np.array([times[0], *corners, times[-1]])
    return FittedProtocol(corners, levels[[0, 1, 1, 2]], float(np.sqrt(np.mean(residuals**2))), exact)


def _require_cycle(times: np.ndarray, indentations: np.ndarray, found: FittedProtocol) -> None:
    """Check that the residuals are noise, whose mean over a block of points is small, and that both ramps return.

    Raises:
        NotOneCycleError: they are not, or one does not.
    """
    travel, (start, peak, _, end) = np.ptp(found.levels), found.levels
    residual = indentations - np.interp(times, found.corners, found.levels)
    block = max(len(times) // BLOCKS, 1)
    means = np.convolve(residual, np.full(block, 1.0 / block), mode="valid")
    scatter = float(np.std(np.diff(residual)) / np.sqrt(2.0))
    bend = float(np.abs(means).max()) - 4.0 * scatter / np.sqrt(block)
    returns = peak - max(start, end) > SMALLEST_RETURN * travel
    if not (returns and bend <= LARGEST_BEND * travel and scatter <= LARGEST_NOISE * travel):
        raise NotOneCycleError(
            f"Expected one cycle of a straight approach, a dwell and a straight withdrawal. Received: points "
            f"{100.0 * found.residual / np.ptp(indentations):.2g} % of their range (rms) from the nearest such path"
            if np.ptp(indentations)
            else "Expected one cycle of approach, dwell and withdrawal. Received: a constant indentation"
        )


def _require_points(times: np.ndarray, found: FittedProtocol) -> None:
    counts = {"loading": np.sum(times <= found.corners[1]), "unloading": np.sum(times >= found.corners[2])}
    few = [f"{count} in {phase}" for phase, count in counts.items() if count < FEWEST_POINTS]
    if few:
        raise ValueError(
            f"Expected at least {FEWEST_POINTS} points in loading and in unloading, to determine their rates; record "
            "more of them, mark both ends of the dwell in a column edge, or give the protocol instead of a history. "
            f"Received: {len(times)} points, {' and '.join(few)}"
        )

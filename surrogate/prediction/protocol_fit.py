"""Fit of a load-dwell-unload protocol to a measured, noisy indentation history.

The path is straight from the first point to the peak, constant over the dwell, and straight to the last point. It is
fitted by least squares. The path is linear in the indentations of start, peak and end, so only the two times at which
the dwell begins and ends are searched for: at the ends of a plateau, and from the points near the peak. Two assumptions
hold unless the points contradict them: the dwell begins and ends where the sampling interval changes, and the path
starts and ends at the expected indentation. Units as in `bem.protocol`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from bem.dataset.measurement_steps import FMS, measurement_grid
from surrogate.prediction.validity import dwell_ends

EXACT = 1e-6
"""Largest residual in an exact history, as a fraction of the range of the indentations; it allows for rounding."""
LARGEST_BEND = 0.02
"""Largest mean residual over a block of neighbouring points, as a fraction of the travel."""
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
BLOCKS = 24
"""Blocks for `LARGEST_BEND`."""


@dataclass(frozen=True)
class FittedProtocol:
    """A path of two straight ramps with a dwell between them.

    Args:
        corners: Times of start, first and last point of the dwell, and end, shape `(4,)`. Without a dwell, the two in
            the middle are equal.
        start_indentation: Indentation at the start.
        peak_indentation: Indentation during the dwell.
        end_indentation: Indentation at the end.
        residual: Root mean square difference between the indentations of the history and the path.
        exact: Whether the points of the history lie on the path up to rounding.
    """

    corners: np.ndarray
    start_indentation: float
    peak_indentation: float
    end_indentation: float
    residual: float
    exact: bool

    @property
    def loading_rate(self) -> float:
        """Rate of indentation in loading."""
        return float((self.peak_indentation - self.start_indentation) / (self.corners[1] - self.corners[0]))

    @property
    def dwell_time(self) -> float:
        """Duration of the dwell."""
        return float(self.corners[2] - self.corners[1])

    @property
    def unloading_rate(self) -> float:
        """Rate of indentation in unloading, as a positive number."""
        return float((self.peak_indentation - self.end_indentation) / (self.corners[3] - self.corners[2]))

    @property
    def travel(self) -> float:
        """Difference between the peak and the lowest indentation."""
        return self.peak_indentation - min(self.start_indentation, self.end_indentation)

    def with_dwell(self, dwell_time: float) -> FittedProtocol:
        """Return the path with a longer dwell of the same middle.

        Each ramp gives at most a tenth of its duration to the dwell, which may then be shorter than `dwell_time`.
        """
        begin, first, second, end = self.corners
        half = 0.5 * (dwell_time - self.dwell_time)
        first, second = first - min(half, 0.1 * (first - begin)), second + min(half, 0.1 * (end - second))
        return replace(self, corners=np.array([begin, first, second, end]))

    def summary(self) -> dict[str, float]:
        """Return the quantities of the protocol and the residual by name, ready for JSON."""
        names = ("start_indentation", "peak_indentation", "end_indentation", "loading_rate", "dwell_time")
        return {name: float(getattr(self, name)) for name in (*names, "unloading_rate", "residual")}

    def levels(self) -> np.ndarray:
        """Return the indentations at the corners, shape `(4,)`."""
        return np.array([self.start_indentation, *[self.peak_indentation] * 2, self.end_indentation])

    def measurement_steps(self) -> tuple[np.ndarray, np.ndarray]:
        """Return times and indentations of the fixed measurement steps, each of shape `(120,)`.

        Raises:
            ValueError: the path has no dwell.
        """
        unit = {"tabor": 1.0, "start_indentation": 0.0, "peak_indentation": 1.0}
        rates = {"loading_rate": 1.0, "dwell_time": float(self.dwell_time > 0.0), "unloading_rate": 1.0}
        (phase,), _ = measurement_grid(**unit, **rates, counts=FMS)
        return np.interp(phase, range(4), self.corners), np.interp(phase, range(4), self.levels())

    def words(self) -> str:
        """Return the path and its residual as one line of text."""
        return (
            f"from {self.start_indentation:.4g} to {self.peak_indentation:.4g} at {self.loading_rate:.4g}, dwell "
            f"{self.dwell_time:.4g}, to {self.end_indentation:.4g} at {self.unloading_rate:.4g}; the points differ by "
            f"{self.residual:.2g} (rms), {100.0 * self.residual / self.travel:.2g} % of its travel"
        )


class NotOneCycleError(ValueError):
    """The history is not one load-dwell-unload cycle."""


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
    if len(times) < 3:
        raise NotOneCycleError(f"Expected a history of at least three points. Received: {len(times)}")
    marks = np.flatnonzero(edge) if edge is not None else np.empty(0, dtype=int)
    if marks.size > 2 or (marks.size and not 0 < marks[0] <= marks[-1] < len(times) - 1):
        raise NotOneCycleError(
            f"Expected marks of one dwell inside the history. Received: marks at {marks[:5].tolist()}"
        )
    # A corner is a real-valued index into the points, because all phases have points even if their durations differ.
    if marks.size:
        found, fixed = _path(times, indentations, marks[[0, -1]]), True
    else:
        found, fixed = _searched(times, indentations), False
        sampled = _where_sampling_changes(times)
        if sampled is not None and not found.exact:
            other = _path(times, indentations, sampled)
            found, fixed = (other, True) if _as_good(other, found, len(times)) else (found, False)
    _require_cycle(times, indentations, found)
    if found.exact:
        return found
    if not fixed:
        _require_points(times, found)
    if ends is not None:
        place = np.interp(found.corners[1:3], times, np.arange(len(times)))
        place = place if fixed else _between_points(times, indentations, place, ends)
        other = _path(times, indentations, place, ends)
        found = other if _as_good(other, found, len(times)) else found
    return found


def _as_good(other: FittedProtocol, found: FittedProtocol, count: int) -> bool:
    """Return whether `other`, with two parameters fixed, fits as well: a likelihood-ratio test at three sigma."""
    return other.residual**2 <= (1.0 + 9.0 / max(count - 5, 1)) * found.residual**2


def _searched(times: np.ndarray, indentations: np.ndarray) -> FittedProtocol:
    """Return the path with its corners at the plateau if it is then exact, otherwise that of least squares."""
    place = np.clip(dwell_ends(indentations), 1, len(times) - 2).astype(np.float64)
    found = _path(times, indentations, place)
    if found.exact:
        return found
    near = np.flatnonzero(indentations >= indentations.max() - PEAK * np.ptp(indentations))
    begins = (place, np.clip(near[[0, -1]], 1, len(times) - 2))
    tried = [_path(times, indentations, _between_points(times, indentations, begin)) for begin in begins]
    return min(tried, key=lambda one: one.residual)


def _where_sampling_changes(times: np.ndarray) -> np.ndarray | None:
    """Return the first and the last point at which the sampling interval changes; `None` without one or two changes.

    Some instruments record each phase with its own sampling interval.
    """
    steps = np.diff(times)
    changes = 1 + np.flatnonzero(np.abs(np.diff(steps)) > SAMPLING_TOLERANCE * np.minimum(steps[1:], steps[:-1]))
    return changes[[0, -1]].astype(np.float64) if 1 <= changes.size <= 2 else None


def _solved(
    times: np.ndarray, indentations: np.ndarray, place: np.ndarray, ends: float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit the levels of start, peak and end, of which `ends` fixes two, to two corners at real-valued indices.

    Returns the times of the corners, the levels, and the residuals of all points.
    """
    first, second = corners = np.interp(place, np.arange(len(times)), times)
    start = np.clip((first - times) / (first - times[0]), 0.0, 1.0)
    end = np.clip((times - second) / (times[-1] - second), 0.0, 1.0)
    weights = np.stack([start, peak := 1.0 - start - end, end], axis=-1)
    if ends is None:
        levels = np.linalg.lstsq(weights, indentations, rcond=None)[0]
    else:
        levels = np.array([ends, peak @ (indentations - ends * (start + end)) / (peak @ peak), ends])
    return corners, levels, indentations - weights @ levels


def _between_points(
    times: np.ndarray, indentations: np.ndarray, place: np.ndarray, ends: float | None = None
) -> np.ndarray:
    """Return real-valued indices of the corners with the least sum of squares, starting from `place`."""

    def residuals(found: np.ndarray) -> np.ndarray:
        return _solved(times, indentations, np.array([found[0], min(found.sum(), len(times) - 2.0)]), ends)[2]

    last = len(times) - 2.0
    begin = np.clip([place[0], place[1] - place[0]], [1.0, 0.0], [last, last])
    found = least_squares(residuals, begin, bounds=([1.0 - 1e-9, -1e-9], [last + 1e-9, last + 1e-9]), diff_step=1e-3).x
    first = float(np.clip(found[0], 1.0, last))
    return np.array([first, np.clip(first + max(found[1], 0.0), first, last)])


def _path(times: np.ndarray, indentations: np.ndarray, place: np.ndarray, ends: float | None = None) -> FittedProtocol:
    corners, levels, residuals = _solved(times, indentations, place, ends)
    rms, largest = float(np.sqrt(np.mean(residuals**2))), np.abs(residuals).max()
    start, peak, end = levels.tolist()
    exact = bool(largest <= EXACT * np.ptp(indentations))
    return FittedProtocol(np.array([times[0], *corners, times[-1]]), start, peak, end, rms, exact)


def _require_cycle(times: np.ndarray, indentations: np.ndarray, found: FittedProtocol) -> None:
    """Check that the residuals are noise, whose mean over a block of points is small, and that both ramps return.

    Raises:
        NotOneCycleError: they are not, or one does not.
    """
    residual = indentations - np.interp(times, found.corners, found.levels())
    block = max(len(times) // BLOCKS, 1)
    means = np.convolve(residual, np.full(block, 1.0 / block), mode="valid")
    scatter = float(np.std(np.diff(residual)) / np.sqrt(2.0))
    bend = float(np.abs(means).max()) - 4.0 * scatter / np.sqrt(block)
    away = found.peak_indentation - max(found.start_indentation, found.end_indentation)
    returns = away > SMALLEST_RETURN * found.travel
    if not (returns and bend <= LARGEST_BEND * found.travel and scatter <= LARGEST_NOISE * found.travel):
        raise NotOneCycleError(
            f"Expected one cycle of a straight approach, a dwell and a straight withdrawal. Received: points "
            f"{100.0 * found.residual / np.ptp(indentations):.2g} % of their range (rms) from the nearest such path"
            if np.ptp(indentations)
            else "Expected one cycle of approach, dwell and withdrawal. Received: a constant indentation"
        )


def _require_points(times: np.ndarray, found: FittedProtocol) -> None:
    counts = {
        "loading": int(np.count_nonzero(times <= found.corners[1])),
        "unloading": int(np.count_nonzero(times >= found.corners[2])),
    }
    few = [f"{count} in {phase}" for phase, count in counts.items() if count < FEWEST_POINTS]
    if few:
        raise ValueError(
            f"Expected at least {FEWEST_POINTS} points in loading and in unloading, to determine their rates; record "
            "more of them, mark both ends of the dwell in a column edge, or give the protocol instead of a history. "
            f"Received: {len(times)} points, {' and '.join(few)}"
        )

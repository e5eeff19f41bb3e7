"""The top of a narrow force peak, between two steps.

Steps follow the curvature of the history, so a polynomial through the highest step and its neighbours gives a peak
where the highest step alone is too low. It is the cubic through two steps before, because a contact detaches faster
than it was loaded, so the steps before the peak are those that resolve it. Where these are missing, a parabola is used.
The top is added to the records as one more entry.
"""

import math

import numpy as np

_UNEVEN = 10.0  # ratio of neighbouring steps from which no curve is drawn through them


def with_peaks(records: np.ndarray, unloading: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Insert the top of every local maximum of the force.

    Args:
        records: (n, 4) time, indentation, force, contact radius; a jump is two rows at one time.
        unloading: (n,) bool, carried along.

    Returns:
        records (n + peaks, 4) and unloading (n + peaks,).
    """
    if len(records) < 3:
        return records, unloading
    time, force = records[:, 0], records[:, 2]
    smooth = _smooth(records)
    tops = np.flatnonzero(smooth & (force[1:-1] > force[:-2]) & (force[1:-1] > force[2:])) + 1
    positions, rows = [], []
    for i in tops:
        first = i - 2 if i >= 2 and smooth[i - 2] else i - 1
        found = _top((time[first : i + 2] - time[i]).tolist(), (force[first : i + 2] - force[i]).tolist())
        if found is None:
            continue
        after, rise = found
        side = i - 1 if after < 0.0 else i + 1
        part = after / (time[side] - time[i])
        row = records[i] + part * (records[side] - records[i])
        row[2] = force[i] + rise
        if not time[min(i, side)] < row[0] < time[max(i, side)]:
            continue
        positions.append(max(i, side))
        rows.append(row)
    if not rows:
        return records, unloading
    # by hand, as `numpy.insert` takes longer than the search
    new = np.array(positions) + np.arange(len(positions))
    old = np.ones(len(records) + len(new), bool)
    old[new] = False
    extended, phase = np.empty((old.size, records.shape[1])), np.empty(old.size, bool)
    extended[old], extended[new] = records, rows
    phase[old], phase[new] = unloading, unloading[np.array(positions) - 1]
    return extended, phase


def _smooth(records: np.ndarray) -> np.ndarray:
    """(n - 2,) bool: whether a curve may be drawn through an entry and both its neighbours."""
    steps = np.diff(records[:, 0])
    before, after = steps[:-1], steps[1:]
    even = (before > 0.0) & (after > 0.0) & (before < _UNEVEN * after) & (after < _UNEVEN * before)
    rate = np.diff(records[:, 1]) / np.maximum(steps, 1e-300)
    # no corner of the protocol
    return even & (np.abs(np.diff(rate)) <= 1e-4 * np.maximum(np.abs(rate[1:]), np.abs(rate[:-1])))


def _top(time: list[float], force: list[float]) -> tuple[float, float] | None:
    """Time and force of a maximum between the neighbours of the last entry but one, both counted from there."""
    left, right = time[-3], time[-1]
    slope, curvature, third = _polynomial([*time[:-2], right], [*force[:-2], force[-1]])
    if third == 0.0:
        after = -slope / (2.0 * curvature)
    else:
        discriminant = curvature**2 - 3.0 * third * slope
        if discriminant < 0.0:
            return None
        # of the two, where the curve is highest; in the form that does not cancel
        after = -slope / (curvature - math.sqrt(discriminant))
    rise = after * (slope + after * (curvature + after * third))
    # What rises further above the highest step than its neighbours lie below is not resolved by the steps.
    if not left < after < right or not 0.0 < rise <= 2.0 * max(-force[-3], -force[-1]):
        return None
    return after, rise


def _polynomial(times: list[float], values: list[float]) -> tuple[float, float, float]:
    """Coefficients of t, t^2 and t^3 of the polynomial through two or three points and the origin, by its differences.

    Written here because a general solver takes longer for three unknowns than all else that follows a simulation.
    """
    quotients = [value / time for time, value in zip(times, values, strict=True)]
    first = (quotients[1] - quotients[0]) / (times[1] - times[0])
    if len(times) == 2:
        return quotients[0] - first * times[0], first, 0.0
    second = ((quotients[2] - quotients[1]) / (times[2] - times[1]) - first) / (times[2] - times[0])
    slope = quotients[0] - times[0] * (first - times[1] * second)
    return slope, first - second * (times[0] + times[1]), second

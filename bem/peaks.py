"""The top of a narrow force peak, between two steps.

Steps follow the curvature of the history, so the parabola through the highest step and its neighbours gives a peak to
third order, where the highest step alone is too low. The vertex is added to the records as one more entry.
"""

import numpy as np


def with_peaks(records: np.ndarray, unloading: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Insert the vertex of every local maximum of the force.

    Args:
        records: (n, 4) time, indentation, force, contact radius; a jump is two rows at one time.
        unloading: (n,) bool, carried along.

    Returns:
        records (n + peaks, 4) and unloading (n + peaks,).
    """
    if len(records) < 3:
        return records, unloading
    time, force = records[:, 0], records[:, 2]
    smooth = (np.diff(time)[:-1] > 0.0) & (np.diff(time)[1:] > 0.0)
    rate = np.diff(records[:, 1]) / np.maximum(np.diff(time), 1e-300)
    same_rate = np.abs(np.diff(rate)) <= 1e-4 * np.maximum(np.abs(rate[1:]), np.abs(rate[:-1]))
    tops = np.flatnonzero(smooth & same_rate & (force[1:-1] > force[:-2]) & (force[1:-1] > force[2:])) + 1
    if tops.size == 0:
        return records, unloading
    positions, rows = [], []
    for i in tops:
        left, right = time[i - 1] - time[i], time[i + 1] - time[i]
        a, b = force[i - 1] - force[i], force[i + 1] - force[i]
        curvature = (b / right - a / left) / (right - left)
        slope = a / left - curvature * left
        vertex = -slope / (2.0 * curvature)
        if not left < vertex < right or vertex == 0.0:
            continue
        side = i - 1 if vertex < 0.0 else i + 1
        part = vertex / (time[side] - time[i])
        row = records[i] + part * (records[side] - records[i])
        rise = slope * vertex + curvature * vertex**2
        # Beside a step cut to nothing, at a fold, the slope is rounding: no peak that the steps resolve rises so far.
        if rise > 2.0 * max(-a, -b):
            continue
        row[2] = force[i] + rise
        if not time[min(i, side)] < row[0] < time[max(i, side)]:
            continue
        positions.append(max(i, side))
        rows.append(row)
    if not rows:
        return records, unloading
    return np.insert(records, positions, rows, axis=0), np.insert(
        unloading, positions, unloading[np.array(positions) - 1]
    )

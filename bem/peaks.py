"""The top of a narrow force peak, between two steps.

Steps follow the curvature of the history, so a parabola through the highest step and two neighbours gives a peak to
third order, where the highest step alone is too low. Up to three parabolas can be laid through it (one neighbour on
each side, two before, two after). They agree on a resolved peak; where the force falls off a cliff the first one
overshoots, so the lowest vertex is taken. It is added to the records as one more entry.
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
    smooth = np.zeros(len(records), dtype=bool)  # neither a corner of the protocol nor a jump nor an end
    rate = np.diff(records[:, 1]) / np.maximum(np.diff(time), 1e-300)
    same_rate = np.abs(np.diff(rate)) <= 1e-4 * np.maximum(np.abs(rate[1:]), np.abs(rate[:-1]))
    smooth[1:-1] = (np.diff(time)[:-1] > 0.0) & (np.diff(time)[1:] > 0.0) & same_rate
    tops = np.flatnonzero(smooth[1:-1] & (force[1:-1] > force[:-2]) & (force[1:-1] > force[2:])) + 1
    positions, rows = [], []
    for i in tops:
        vertices = [_vertex(time, force, i, i - 1, i + 1)]
        if smooth[i - 1]:
            vertices.append(_vertex(time, force, i, i - 2, i - 1))
        if smooth[i + 1]:
            vertices.append(_vertex(time, force, i, i + 1, i + 2))
        inside = [(height, at) for at, height in vertices if time[i - 1] < at < time[i + 1] and height > force[i]]
        if not inside:
            continue
        height, at = min(inside)
        side = i - 1 if at < time[i] else i + 1
        row = records[i] + (at - time[i]) / (time[side] - time[i]) * (records[side] - records[i])
        row[0], row[2] = at, height
        if time[min(i, side)] < at < time[max(i, side)]:
            positions.append(max(i, side))
            rows.append(row)
    if not rows:
        return records, unloading
    carried = unloading[np.array(positions) - 1]
    return np.insert(records, positions, rows, axis=0), np.insert(unloading, positions, carried)


def _vertex(time: np.ndarray, force: np.ndarray, top: int, one: int, other: int) -> tuple[float, float]:
    """Instant and height of the vertex of the parabola through three entries; NaN unless it opens downwards."""
    x, z = time[one] - time[top], time[other] - time[top]
    a, b = (force[one] - force[top]) / x, (force[other] - force[top]) / z
    curvature = (b - a) / (z - x)
    slope = a - curvature * x
    if not curvature < 0.0:
        return np.nan, np.nan
    return float(time[top] - slope / (2.0 * curvature)), float(force[top] - slope**2 / (4.0 * curvature))

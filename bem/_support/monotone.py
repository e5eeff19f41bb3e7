"""Monotone cubics through given points: their slopes, values and integral.

After F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300, as SciPy's `PchipInterpolator`, against
which they are tested; setting that up takes longer than solving a short trajectory.
"""

import numpy as np

from bem._support.jit import kernel


@kernel
def monotone_slopes(times: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Slopes (n,) at instants (n,), strictly increasing, n >= 2, so that the cubics between them do not overshoot."""
    count = times.size
    slopes = np.zeros(count)
    if count == 2:
        slopes[:] = (force[1] - force[0]) / (times[1] - times[0])
        return slopes
    for i in range(1, count - 1):
        before, after = times[i] - times[i - 1], times[i + 1] - times[i]
        chord, next_chord = (force[i] - force[i - 1]) / before, (force[i + 1] - force[i]) / after
        if chord * next_chord > 0.0:
            weight, next_weight = 2.0 * after + before, after + 2.0 * before
            slopes[i] = (weight + next_weight) / (weight / chord + next_weight / next_chord)
    for end, inner, third in ((0, 1, 2), (count - 1, count - 2, count - 3)):
        near, far = abs(times[inner] - times[end]), abs(times[third] - times[inner])
        chord = (force[inner] - force[end]) / (times[inner] - times[end])
        next_chord = (force[third] - force[inner]) / (times[third] - times[inner])
        slope = ((2.0 * near + far) * chord - near * next_chord) / (near + far)
        if slope * chord <= 0.0:
            slope = 0.0
        elif chord * next_chord <= 0.0 and abs(slope) > 3.0 * abs(chord):
            slope = 3.0 * chord
        slopes[end] = slope
    return slopes


@kernel
def monotone_values(times: np.ndarray, force: np.ndarray, slopes: np.ndarray, queries: np.ndarray) -> np.ndarray:
    """The cubics at `queries` (m,), instants within the range of `times` (n,)."""
    values = np.empty(queries.size)
    places = np.searchsorted(times, queries, side="right")
    for k in range(queries.size):
        i = min(max(places[k] - 1, 0), times.size - 2)
        width, offset = times[i + 1] - times[i], queries[k] - times[i]
        chord = (force[i + 1] - force[i]) / width
        cubic = (slopes[i] + slopes[i + 1] - 2.0 * chord) / width
        square = (chord - slopes[i]) / width - cubic
        values[k] = force[i] + offset * (slopes[i] + offset * (square + offset * cubic / width))
    return values


@kernel
def monotone_integral(times: np.ndarray, force: np.ndarray, slopes: np.ndarray) -> float:
    """Integral of the cubics over all `times` (n,)."""
    total = 0.0
    for i in range(times.size - 1):
        width = times[i + 1] - times[i]
        total += width * (0.5 * (force[i] + force[i + 1]) + width * (slopes[i] - slopes[i + 1]) / 12.0)
    return total

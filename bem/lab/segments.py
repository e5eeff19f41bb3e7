"""The segments of a measured curve: approach, hold in position or in force, retraction; pauses and cycles.

They are found in path and force alone, whatever the instrument says.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.signal import find_peaks

from bem._support.validation import FloatArray
from bem.lab.contact_point import noise_of
from bem.lab.units import readable

_CLOSENESS = 1e-3  # of the range of the path, by which straight lines may miss a measured point
_FEWEST = 4  # samples between two corners, from which a line through them is better than one through the corners
_MOST_KNOTS = 400
_PLATEAU, _LOUD = 0.01, 4.0  # of the range, and times the noise, within which a path or a force is held
_LONGER = 1.2  # times the hold of the path, from which it is the force that was held
_TURNS, _BEYOND = 0.2, 10.0  # of the depth, and times the noise of the path, by which an instrument turns
_PAUSE = 0.03  # of the duration, from which a path that stands still pauses


@dataclass(frozen=True)
class Segments:
    """Where a curve of one cycle turns: indices of its points, and instants in s."""

    top: int
    """Last point of the approach."""
    leaves: int
    """First point of the retraction."""
    held: Literal["position", "force"] | None
    """What was held between them."""
    pauses: tuple[tuple[float, float], ...]
    """Instants of stops elsewhere."""

    def sentence(self, time: FloatArray) -> str:
        """The segments with their instants, in words."""
        begin, end = (readable(float(time[n] - time[0]), "s") for n in (self.top, self.leaves))
        text = f"approach to {begin}"
        text += f", hold in {self.held} to {end}" if self.held else ""
        text += f", retraction to {readable(float(time[-1] - time[0]), 's')}" if self.leaves < time.size - 1 else ""
        for pause in self.pauses:
            text += f", pause from {readable(pause[0], 's')} to {readable(pause[1], 's')}"
        return text


def segments_of(time: FloatArray, position: FloatArray, compression: FloatArray, first: int) -> Segments:
    """Find the segments of a curve.

    Args:
        time: in s, (n,).
        place: what the instrument moved, in m, positive towards the sample, (n,).
        compression: force, in N, positive in compression, (n,).
        first: the first point in contact.

    Raises:
        ValueError: the curve has several cycles; the sentence names the instants between them.
    """
    _require_one_cycle(time, position, first)
    by_position, by_force = _plateau(position), tuple(first + n for n in _plateau(compression[first:]))
    lengths = [time[end] - time[begin] for begin, end in (by_position, by_force)]
    pressed = float(compression.max() - np.median(compression[: max(first, 1)])) > 0.3 * float(np.ptp(compression))
    in_force = pressed and lengths[1] > _LONGER * lengths[0] and by_force[1] - by_force[0] >= 5
    top, leaves = by_force if in_force else by_position
    held = time[leaves] - time[top] > _PAUSE * (time[-1] - time[0]) and leaves - top >= 5
    since = time - time[0]
    return Segments(
        top,
        top if in_force and not held else leaves,
        ("force" if in_force else "position") if held else None,
        tuple((begin, end) for begin, end in _still(time, position) if end < since[top] or begin > since[leaves]),
    )


def _plateau(values: FloatArray) -> tuple[int, int]:
    """First and last point near the largest value."""
    allowed = max(_PLATEAU * float(np.ptp(values)), _LOUD * noise_of(values))
    near = np.flatnonzero(values >= values.max() - allowed)
    return int(near[0]), int(near[-1])


def _still(time: FloatArray, position: FloatArray) -> list[tuple[float, float]]:
    """Instants, in s from the first, between which a path stands still."""
    instants, positions = straight_lines(time, position)
    allowed = max(_PLATEAU * float(np.ptp(position)), _LOUD * noise_of(position))
    still = (np.abs(np.diff(positions)) < allowed) & (np.diff(instants) > _PAUSE * instants[-1]) & (instants[:-1] > 0.0)
    return [(float(instants[n]), float(instants[n + 1])) for n in np.flatnonzero(still)]


def _require_one_cycle(time: FloatArray, position: FloatArray, first: int) -> None:
    """Refuse a path that rises again after a fall, both by more than noise; what it does out of contact is free."""
    depth = np.pad(np.maximum(position, position[first]), 1, constant_values=position[first])
    least = max(_TURNS * float(np.ptp(depth)), _BEYOND * noise_of(position))
    tops = find_peaks(depth, prominence=max(least, 1e-300))[0] - 1
    if len(tops) > 1:
        cuts = [time[a + int(np.argmin(position[a:b]))] for a, b in itertools.pairwise(tops)]
        raise ValueError(
            f"a force curve must approach and retract once; received {len(tops)} cycles: cut it at "
            f"{', '.join(readable(float(cut), 's') for cut in cuts)} and fit one of them"
        )


def straight_lines(time: FloatArray, path: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Instants from zero, in s, and positions, in m, of few points between which a measured path is straight.

    Lines are split at the point they miss most (Ramer, 1972; Douglas and Peucker, 1973) until none is missed by more
    than a thousandth of the range, or by three standard deviations of the noise. A corner falls between two samples: it
    is where the lines through the points on either side of it meet.
    """
    time, first = np.unique(time - time[0], return_index=True)
    depth = path[first]
    allowed = max(_CLOSENESS * float(np.ptp(depth)), 3.0 * noise_of(depth))
    kept, open_pieces = {0, time.size - 1}, [(0, time.size - 1)]
    while open_pieces and len(kept) < _MOST_KNOTS:
        begin, end = open_pieces.pop()
        line = np.interp(time[begin : end + 1], time[[begin, end]], depth[[begin, end]])
        missed = np.abs(depth[begin : end + 1] - line)
        worst = int(np.argmax(missed))
        if missed[worst] > allowed:
            kept.add(begin + worst)
            open_pieces += [(begin, begin + worst), (begin + worst, end)]
    return _corners(time, depth, sorted(kept))


def _corners(time: FloatArray, depth: FloatArray, knots: list[int]) -> tuple[FloatArray, FloatArray]:
    """Corners near the samples `knots`: where the lines through the points on either side meet, if within a sample."""
    corners = {knot: (float(time[knot]), float(depth[knot])) for knot in knots}
    straight = [(a, b) for a, b in itertools.pairwise(knots) if b - a > _FEWEST]
    lines = [_line(time[begin + 1 : end], depth[begin + 1 : end]) for begin, end in straight]
    for ((_, end), (begin, _)), (before, after) in zip(
        itertools.pairwise(straight), itertools.pairwise(lines), strict=True
    ):
        # One corner may have left two knots, the samples on either side of it.
        if begin - end > 1 or 0.0 in (before[1], after[1]) or before[1] == after[1]:
            continue
        instant = (after[0] - before[0]) / (before[1] - after[1])
        if time[end - 1] <= instant <= time[begin + 1]:
            corners[end] = float(instant), float(before[0] + before[1] * instant)
            if begin > end:
                del corners[begin]
    instants, places = np.array(list(corners.values())).T
    return instants, places


def _line(time: FloatArray, depth: FloatArray) -> tuple[float, float]:
    """Ordinate and slope of the line through points; `convert` of NumPy would swallow what a signal handler raises."""
    line = np.polynomial.Polynomial.fit(time, depth, 1)
    offset, scale = line.mapparms()
    return line.coef[0] + line.coef[1] * offset, line.coef[1] * scale

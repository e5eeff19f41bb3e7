"""Interpolation of the force between the time steps of a solution."""

import numpy as np
from numpy.typing import ArrayLike

from bem._support.validation import FloatArray, real_array
from bem._support.wording import shown

ROUNDINGS = 4.0
"""Tolerance of a time outside the range, in spacings of floating-point numbers at the larger bound."""


class ForceInterpolant:
    """Interpolate a force history by monotone cubics, piecewise between jumps and corners of the protocol.

    Args:
        times: native instants, non-decreasing, shape (n,); a jump is two entries at the same instant.
        force: force at them, shape (n,).
        jump_times: instants of the jumps, shape (j,), each listed at least twice in `times`; other entries at one
            instant are merged, the last one kept.
        corner_times: instants in `times` at which the protocol bends, shape (c,): the force is continuous there, its
            rate is not.

    Raises:
        ValueError: for unequal lengths, decreasing instants, or jumps and corners not found.
    """

    def __init__(self, times: ArrayLike, force: ArrayLike, jump_times: ArrayLike, corner_times: ArrayLike = ()) -> None:
        self.times = np.asarray(times, dtype=np.float64)
        self.force = np.asarray(force, dtype=np.float64)
        shapes = (self.times.shape, self.force.shape)
        if len(shapes[0]) != 1 or shapes[0] != shapes[1] or shapes[0] == (0,) or np.any(np.diff(self.times) < 0.0):
            raise ValueError(
                f"times must be non-decreasing and as long as force; received shapes {shapes[0]} and {shapes[1]}"
            )
        jumps = np.unique(np.asarray(jump_times, dtype=np.float64))
        before, behind = (np.searchsorted(self.times, jumps, side=side) for side in ("left", "right"))
        if np.any(behind - before < 2):
            raise ValueError(
                "jump_times must each be listed before and after the jump in times; "
                f"received {float(jumps[np.flatnonzero(behind - before < 2)[0]])!r}"
            )
        corners = np.setdiff1d(np.asarray(corner_times, dtype=np.float64), jumps)
        at_corner = np.searchsorted(self.times, corners)
        if np.any(self.times[np.minimum(at_corner, self.times.size - 1)] != corners):
            raise ValueError(f"corner_times must be instants of times; received {shown(corners.tolist())}")
        # The entry before a jump closes one piece, the entry after it opens the next; both share that of a corner.
        cuts = sorted([(int(i), 1) for i in before] + [(int(i), 0) for i in at_corner if 0 < i < self.times.size - 1])
        begins, ends = (index + jump for index, jump in cuts), (index + 1 for index, _ in cuts)
        self.ranges = list(zip([0, *begins], [*ends, self.times.size], strict=True))
        self._bounds = self.times[[index for index, _ in cuts]]
        self._curves: dict[int, tuple[FloatArray, FloatArray, FloatArray]] = {}

    def at(self, times: ArrayLike) -> FloatArray:
        """Force at `times`, any shape, within the native range; exactly at a jump, the value after it.

        Times a few roundings outside, as other ways to compute the ends of a protocol give, count as the ends.

        Raises:
            ValueError: for times outside the native range.
        """
        queries = real_array("times", times)
        first, last = self.times[0], self.times[-1]
        slack = ROUNDINGS * np.spacing(max(abs(first), abs(last)))
        if not np.all((queries >= first - slack) & (queries <= last + slack)):
            raise ValueError(
                f"times must lie between {float(first)!r} and {float(last)!r}; "
                f"received {float(np.min(queries))!r} to {float(np.max(queries))!r}"
            )
        queries = np.clip(queries, first, last)
        # Imported here, as below, because a surrogate measures protocols without a compiler.
        from bem._support.monotone import monotone_values

        piece_of = np.searchsorted(self._bounds, queries, side="right")
        result = np.empty(queries.shape)
        for piece in np.unique(piece_of):
            inside = piece_of == piece
            instants, force, slopes = self._curve(piece)
            result[inside] = force if force.size == 1 else monotone_values(instants, force, slopes, queries[inside])
        return result

    def integrals(self) -> list[float]:
        """Integral of the force over the time of each of `ranges`."""
        from bem._support.monotone import monotone_integral

        return [monotone_integral(*self._curve(piece)) for piece in range(len(self.ranges))]

    def _curve(self, piece: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distinct instants of a piece, and force and slope at them."""
        from bem._support.monotone import monotone_slopes

        if piece not in self._curves:
            begin, end = self.ranges[piece]
            times, force = self.times[begin:end], self.force[begin:end]
            keep = np.append(np.diff(times) > 0.0, True)
            times, force = times[keep], force[keep]
            slopes = monotone_slopes(times, force) if times.size > 1 else np.zeros(1)
            self._curves[piece] = times, force, slopes
        return self._curves[piece]

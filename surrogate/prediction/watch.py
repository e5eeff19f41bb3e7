"""Range of validity point by point: what a stream checks while it advances, by the bounds for whole histories."""

from __future__ import annotations

import math

import numpy as np

from surrogate.data.features import PLATEAU_TOLERANCE
from surrogate.prediction.validity import (
    BEND_TOLERANCE,
    LARGEST_STEP_RATIO,
    RANGE_TOLERANCE,
    Excess,
    bounds_of,
    excesses,
)

BEFORE, LOADING, DWELL, UNLOADING, OVER = range(5)
SETTLED = 5
"""Points after which the rate of an unloading tells how many will follow."""
MOST = 256
"""Points of a phase that are kept to see whether it is straight; there are too many before."""


class Watch:
    """Checks one history point by point, by the bounds for whole histories; `see` names each cause once.

    A phase is checked where it ends. What is known before is checked before: rates, step lengths, the largest
    indentation, and too many points. A point takes a microsecond or two and no array.

    Args:
        tabor: The Tabor parameter.
        ranges: Smallest and largest value of each quantity; also of `POINTS`, if they are others. Those of
            `compression_points` mean steps that follow the physics (`bem.dataset.physical_steps`), equal in the loading
            only: so many points of the unloading come before the force without adhesion vanishes.
    """

    def __init__(self, tabor: float, ranges: dict[str, tuple[float, float]]) -> None:
        self.bounds, self.equal = bounds_of(ranges, tabor), "compression_points" not in ranges
        self.reset()

    def reset(self) -> None:
        """Begin a new history."""
        self._begin(BEFORE, 0.0, 0.0)
        self._named: set[str] = set()

    def _begin(self, phase: int, time: float, depth: float) -> None:
        """Begin a phase at a point, of which it counts those that follow."""
        self.phase, self.points = phase, 0.0
        self.path: tuple[tuple[float, float], ...] = ((time, depth),)
        self.latest, self.last, self.lowest = time, depth, depth
        self.shortest, self.longest, self.pressed = math.inf, 0.0, True

    def see(self, time: float, indentation: float, marked: bool, pressed: bool = False) -> list[Excess]:
        """Check the next point.

        Args:
            time: Time of the point.
            indentation: Indentation there.
            marked: Whether it has an edge mark.
            pressed: Whether the force without adhesion is still a compression.

        Returns:
            What is outside its range and has not been named before in this history.
        """
        self._found: dict[str, float] = {}
        if self.phase == BEFORE:
            self.start = self.level = indentation
            self._begin(LOADING, time, indentation)
            self.points = 1.0
            self._note("start_indentation", indentation)
        else:
            self._turn(indentation)
            self._follow(time, indentation, pressed)
        if marked and self.phase < UNLOADING:
            self._end()
        elif marked:
            self._note("edge_marks", 3.0)
        if not self._found:
            return []
        self._named.update(self._found)
        return excesses({name: np.array([value]) for name, value in self._found.items()}, self.bounds)

    def _turn(self, indentation: float) -> None:
        """End a phase of which no mark said so, and name a second cycle."""
        slack = BEND_TOLERANCE * (self.level - self.start)
        if self.phase == LOADING:
            if abs(indentation - self.last) <= PLATEAU_TOLERANCE * abs(indentation):
                self._note("edge_marks", 0.0)
                self._end()
            elif indentation < self.level - slack:
                self._end()
        if self.phase == DWELL and indentation < self.level - slack:
            if self.points:
                self._note("edge_marks", 1.0)
            self._end()
        elif indentation > (self.level if self.phase == DWELL else self.lowest) + slack and self.phase > LOADING:
            self._note("cycles", 2.0)

    def _follow(self, time: float, indentation: float, pressed: bool) -> None:
        """Take the point into its phase."""
        step = time - self.latest
        self.latest, self.last, self.points = time, indentation, self.points + 1.0
        self.shortest, self.longest = min(self.shortest, step), max(self.longest, step)
        if self.points < MOST:
            self.path += ((time, indentation),)
        if self.longest > LARGEST_STEP_RATIO * self.shortest and (self.phase == LOADING or self.equal):
            self._note("step_ratio", self.longest / self.shortest)
        if self.phase == LOADING:
            self.level = max(self.level, indentation)
        elif self.phase > DWELL:
            self.lowest = min(self.lowest, indentation)
            if indentation < self.bounds["end_indentation"][0]:
                self._note("end_indentation", indentation)
        self._judge(over=False)
        if self.phase == UNLOADING:
            if self.pressed:
                self._note("compression_points", self.points, growing=pressed)
                self.pressed = pressed
            if self.lowest - self.start <= RANGE_TOLERANCE * (self.level - self.start):
                self._end()

    def _end(self) -> None:
        """End the phase at the latest point."""
        self._judge(over=True)
        self.level = max(self.level, self.last)
        self._begin(self.phase + 1, self.latest, self.last)

    def _judge(self, *, over: bool) -> None:
        """Check what the phase is so far; what may still grow is too small only where it is over."""
        (begin, first), growing = self.path[0], not over
        past, travel = self.latest - begin, self.level - self.start
        slope = (self.last - first) / past if past else 0.0
        if self.phase == LOADING:
            if past:
                self._note("loading_rate", slope)
            self._note("peak_indentation", self.last, growing=growing)
            self._note("loading_points", self.points, growing=growing)
        elif self.phase == DWELL:
            self._note("dwell_time", past, growing=growing)
            # Without a dwell there is no number of points.
            self._note("dwell_points", self.points, growing=growing or not past)
        elif self.phase == UNLOADING:
            self._note("unloading_rate", -slope)
            self._note("unloading_points", self.points, growing=growing)
            if self.equal and self.points == SETTLED and slope < 0.0:
                self._note("unloading_points", self.points * travel / (-slope * past))
        if over and travel > 0.0:
            far = max(abs(depth - first - slope * (time - begin)) for time, depth in self.path)
            self._note("bend", far / travel)

    def _note(self, name: str, value: float, *, growing: bool = False) -> None:
        """Add a value outside its bounds; one that may still grow, only above them."""
        if name in self.bounds and name not in self._named:
            low, high = self.bounds[name]
            if not value <= high or not (growing or low <= value):
                self._found.setdefault(name, value)

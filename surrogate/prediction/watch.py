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

    __slots__ = (
        *("ranges", "equal", "tabor", "bounds", "phase", "start", "level", "points", "path", "latest", "last"),
        *("lowest", "shortest", "longest", "pressed", "_named", "_found"),
    )

    def __init__(self, tabor: float, ranges: dict[str, tuple[float, float]]) -> None:
        self.ranges, self.equal = ranges, "compression_points" not in ranges
        self.tabor = np.array([tabor])
        self.bounds = bounds_of(ranges, tabor)
        self.reset()

    def _begin(self, phase: int, time: float, depth: float) -> None:
        """Begin a phase at a point, of which it counts those that follow."""
        self.phase, self.points = phase, 0.0
        self.path: tuple[tuple[float, float], ...] = ((time, depth),)
        self.latest, self.last, self.lowest = time, depth, depth
        self.shortest, self.longest, self.pressed = math.inf, 0.0, True

    def reset(self) -> None:
        """Begin a new history."""
        self._begin(BEFORE, 0.0, 0.0)
        self._named: set[str] = set()

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
        self.latest, self.last = time, indentation
        if marked and self.phase < UNLOADING:
            self._end()
        elif marked:
            self._note("edge_marks", 3.0)
        if not self._found:
            return []
        self._named.update(self._found)
        values = {name: np.array([value]) for name, value in self._found.items()}
        return [one for one in excesses({"tabor": self.tabor, **values}, self.ranges) if one.name in self._found]

    def _turn(self, indentation: float) -> None:
        """End a phase of which no mark said so, and name a second cycle."""
        slack = BEND_TOLERANCE * (self.level - self.start)
        if self.phase == LOADING:
            if abs(indentation - self.last) <= PLATEAU_TOLERANCE * abs(indentation):
                self._note("edge_marks", 0.0)
                self._end()
            elif indentation < self.level - slack:
                self._end()
        if self.phase == DWELL:
            if indentation < self.level - slack:
                if self.points:
                    self._note("edge_marks", 1.0)
                self._end()
            elif indentation > self.level + slack:
                self._note("cycles", 2.0)
        elif self.phase > DWELL and indentation > self.lowest + slack:
            self._note("cycles", 2.0)

    def _follow(self, time: float, indentation: float, pressed: bool) -> None:
        """Take the point into its phase."""
        begin, level = self.path[0]
        step, past, depth = time - self.latest, time - begin, indentation - level
        self.points += 1.0
        self.shortest, self.longest = min(self.shortest, step), max(self.longest, step)
        if self.points < MOST:
            self.path += ((time, indentation),)
        if self.longest > LARGEST_STEP_RATIO * self.shortest and (self.phase == LOADING or self.equal):
            self._note("step_ratio", self.longest / self.shortest)
        if self.phase == LOADING:
            self.level = max(self.level, indentation)
            self._note("loading_rate", depth / past)
            self._note("peak_indentation", indentation, growing=True)
            self._note("loading_points", self.points, growing=True)
        elif self.phase == DWELL:
            self._note("dwell_time", past, growing=True)
            self._note("dwell_points", self.points, growing=True)
        else:
            self.lowest = min(self.lowest, indentation)
            if self.phase == UNLOADING:
                self._unload(past, -depth / past, pressed)
            if indentation < self.bounds["end_indentation"][0]:
                self._note("end_indentation", indentation)

    def _unload(self, past: float, rate: float, pressed: bool) -> None:
        self._note("unloading_rate", rate)
        self._note("unloading_points", self.points, growing=True)
        if self.equal and self.points == SETTLED and rate > 0.0:
            self._note("unloading_points", self.points * (self.level - self.start) / (rate * past))
        if self.pressed:
            self._note("compression_points", self.points, growing=pressed)
            self.pressed = pressed
        if self.lowest - self.start <= RANGE_TOLERANCE * (self.level - self.start):
            self._note("unloading_points", self.points)
            self._note("bend", self._bend())
            self.phase = OVER

    def _end(self) -> None:
        """End the phase at the latest point."""
        self._note("bend", self._bend())
        if self.phase == LOADING:
            self._note("peak_indentation", self.last)
            self._note("loading_points", self.points)
        else:
            self._note("dwell_time", self.latest - self.path[0][0])
            if self.latest > self.path[0][0]:
                self._note("dwell_points", self.points)
        self.level = max(self.level, self.last)
        self._begin(self.phase + 1, self.latest, self.last)

    def _bend(self) -> float:
        """Largest distance of the phase from a straight line between its ends, as a fraction of the travel."""
        (begin, first), *_, (end, last) = (*self.path, (self.latest, self.last))
        slope, travel = (last - first) / (end - begin) if end > begin else 0.0, self.level - self.start
        far = max(abs(depth - first - slope * (time - begin)) for time, depth in self.path)
        return far / travel if travel > 0.0 else 0.0

    def _note(self, name: str, value: float, *, growing: bool = False) -> None:
        """Add a value outside its bounds; one that may still grow, only above them."""
        if name in self.bounds and name not in self._named:
            low, high = self.bounds[name]
            if not value <= high or not (growing or low <= value):
                self._found.setdefault(name, value)

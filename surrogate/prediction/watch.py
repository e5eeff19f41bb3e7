"""Range of validity point by point: what a stream checks while it advances, by the bounds for whole histories."""

from __future__ import annotations

import math
from dataclasses import dataclass

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

LOADING, DWELL, UNLOADING, OVER = range(4)
SETTLED = 5
"""Points after which the rate of an unloading tells how many will follow."""


@dataclass(slots=True)
class Seen:
    """What a watch has seen: of the history its start and its peak, and of the latest phase the rest.

    `time` and `depth` are where the phase began, `latest` and `last` time and indentation of the latest point, `sums`
    those of a straight line through the phase, and `pressed` whether the force without adhesion is still a compression.
    """

    start: float
    level: float
    phase: int
    points: float
    time: float
    depth: float
    latest: float
    last: float
    lowest: float
    shortest: float = math.inf
    longest: float = 0.0
    sums: tuple[float, ...] = (0.0,) * 5
    pressed: bool = True


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
        self.ranges, self.equal = ranges, "compression_points" not in ranges
        self.tabor = np.array([tabor])
        self.bounds = bounds_of(ranges, tabor)
        self.reset()

    def reset(self) -> None:
        """Begin a new history."""
        self.seen: Seen | None = None
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
        if self.seen is None:
            self.seen = self._phase(LOADING, time, indentation, 1.0, indentation, indentation)
            self._note("start_indentation", indentation)
        else:
            self._follow(self._turn(self.seen, indentation), time, indentation, pressed)
        self.seen.latest, self.seen.last = time, indentation
        if marked and self.seen.phase < UNLOADING:
            self._end(self.seen)
        elif marked:
            self._note("edge_marks", 3.0)
        if not self._found:
            return []
        self._named.update(self._found)
        values = {name: np.array([value]) for name, value in self._found.items()}
        return [one for one in excesses({"tabor": self.tabor, **values}, self.ranges) if one.name in self._found]

    def _turn(self, now: Seen, indentation: float) -> Seen:
        """End a phase of which no mark said so, name a second cycle, and return the phase of the point."""
        slack = BEND_TOLERANCE * (now.level - now.start)
        if now.phase == LOADING:
            if abs(indentation - now.last) <= PLATEAU_TOLERANCE * abs(indentation):
                self._note("edge_marks", 0.0)
                now = self._end(now)
            elif indentation < now.level - slack:
                now = self._end(now)
        if now.phase == DWELL:
            if indentation < now.level - slack:
                if now.points:
                    self._note("edge_marks", 1.0)
                now = self._end(now)
            elif indentation > now.level + slack:
                self._note("cycles", 2.0)
        elif now.phase > DWELL and indentation > now.lowest + slack:
            self._note("cycles", 2.0)
        return now

    def _follow(self, now: Seen, time: float, indentation: float, pressed: bool) -> None:
        """Take the point into its phase."""
        step, past, depth = time - now.latest, time - now.time, indentation - now.depth
        now.points += 1.0
        now.shortest, now.longest = min(now.shortest, step), max(now.longest, step)
        terms = (past, depth, past * past, past * depth, depth * depth)
        now.sums = tuple([total + term for total, term in zip(now.sums, terms, strict=True)])
        if now.longest > LARGEST_STEP_RATIO * now.shortest and (now.phase == LOADING or self.equal):
            self._note("step_ratio", now.longest / now.shortest)
        if now.phase == LOADING:
            now.level = max(now.level, indentation)
            self._note("loading_rate", depth / past)
            self._note("peak_indentation", indentation, growing=True)
            self._note("loading_points", now.points, growing=True)
        elif now.phase == DWELL:
            self._note("dwell_time", past, growing=True)
            self._note("dwell_points", now.points, growing=True)
        else:
            now.lowest = min(now.lowest, indentation)
            if now.phase == UNLOADING:
                self._unload(now, past, -depth / past, pressed)
            if indentation < self.bounds["end_indentation"][0]:
                self._note("end_indentation", indentation)

    def _unload(self, now: Seen, past: float, rate: float, pressed: bool) -> None:
        self._note("unloading_rate", rate)
        self._note("unloading_points", now.points, growing=True)
        if self.equal and now.points == SETTLED and rate > 0.0:
            self._note("unloading_points", now.points * (now.level - now.start) / (rate * past))
        if now.pressed:
            self._note("compression_points", now.points, growing=pressed)
            now.pressed = pressed
        if now.lowest - now.start <= RANGE_TOLERANCE * (now.level - now.start):
            self._note("unloading_points", now.points)
            self._note("bend", _bend(now))
            now.phase = OVER

    def _end(self, now: Seen) -> Seen:
        """End the phase at the latest point, and return the next one."""
        self._note("bend", _bend(now))
        if now.phase == LOADING:
            self._note("peak_indentation", now.last)
            self._note("loading_points", now.points)
        else:
            self._note("dwell_time", now.latest - now.time)
            if now.latest > now.time:
                self._note("dwell_points", now.points)
        self.seen = self._phase(now.phase + 1, now.latest, now.last, 0.0, now.start, max(now.level, now.last))
        return self.seen

    @staticmethod
    def _phase(phase: int, time: float, depth: float, points: float, start: float, level: float) -> Seen:
        return Seen(start, level, phase, points, time, depth, latest=time, last=depth, lowest=depth)

    def _note(self, name: str, value: float, *, growing: bool = False) -> None:
        """Add a value outside its bounds; one that may still grow, only above them."""
        if name in self.bounds and name not in self._named:
            low, high = self.bounds[name]
            if not value <= high or not (growing or low <= value):
                self._found.setdefault(name, value)


def _bend(now: Seen) -> float:
    """Root mean square of the distances from the best straight line, as a fraction of the travel."""
    times, depths, squares, products, rest = now.sums
    count, travel = max(now.points, 1.0), now.level - now.start
    spread = squares - times * times / count
    if spread <= 0.0 or travel <= 0.0:
        return 0.0
    rest -= depths * depths / count + (products - times * depths / count) ** 2 / spread
    return float(max(rest / count, 0.0) ** 0.5 / travel)

"""What a model of a force curve is: its parameters, and the tension along the path of an instrument.

A model knows neither offset, tilt, drag nor drift: those enter linearly and belong to the fit. Lengths in m, tensions
in N, positive in tension, moduli in Pa, times in s.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.contact_point import noise_of
from bem.lab.setup import Setup

_CLOSENESS = 1e-3  # of the range of the path, by which the lines may miss a measured point
_FEWEST = 4  # samples between two corners, from which a line through them is better than one through the corners
MOST_KNOTS = 400

Values = Mapping[str, float]


@dataclass(frozen=True)
class Jump:
    """A change of a measured force between two samples that stands out of noise and neighbours."""

    time: float
    """Midway between the samples, in s."""
    level: float
    """Tension midway between theirs, over that of the baseline, in N."""
    out: bool
    """Whether out of contact, where the tension falls, or into it."""


@dataclass(frozen=True, eq=False)
class Path:
    """What an instrument moved: `place` (m), of the stage behind the setup's spring or of the sphere, at `time` (s)."""

    time: FloatArray
    place: FloatArray
    setup: Setup

    @property
    def compliance(self) -> float:
        """Of the spring, in m/N; zero without one."""
        return 0.0 if self.setup.stiffness is None else 1.0 / self.setup.stiffness

    @cached_property
    def lines(self) -> tuple[FloatArray, FloatArray]:
        """Instants, in s from the first, and places, in m, of the corners between which the path is straight."""
        return straight_lines(self.time, self.place)


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model, with its bounds and what would determine it."""

    name: str
    unit: str
    scale: Literal["logarithm", "logit", "linear"]
    """How it is searched: positive quantities as logarithms, shares between 0 and 1 as logits."""
    low: float
    high: float
    advice: str

    def inner(self, value: float) -> float:
        """The transformed value, in which the search works."""
        if self.scale == "logarithm":
            return math.log(value)
        # An interval may end at a share that rounds to one.
        return math.log(value / max(1.0 - value, 1e-16)) if self.scale == "logit" else value

    def outer(self, inner: float) -> float:
        """The value that belongs to a transformed one."""
        if self.scale == "logarithm":
            return math.exp(inner) if inner < 700.0 else math.inf
        return 1.0 / (1.0 + math.exp(-max(min(inner, 700.0), -700.0))) if self.scale == "logit" else inner


MODULUS = Parameter("relaxed_modulus", "Pa", "logarithm", 1e0, 1e12, "a deeper indentation")
ADHESION = Parameter("work_of_adhesion", "J/m^2", "linear", 0.0, 1e3, "a retraction up to detachment")
CONTACT_POINT = Parameter("contact_point", "m", "linear", -math.inf, math.inf, "an approach from out of contact")
RETARDATION_TIME = Parameter("retardation_time", "s", "logarithm", 1e-9, 1e9, "a dwell or a ramp about as long as it")
MODULUS_RATIO = Parameter(
    "modulus_ratio", "", "logit", 0.01, 0.999, "a ramp shorter than the retardation time, and a dwell longer"
)


@dataclass(frozen=True)
class Model:
    """A model of a force curve.

    Args:
        name: by which `fit` and `--model` know it.
        title: in words.
        parameters: all but the contact point, which every model has.
        tension: of the contact along a path, shape (n,), by values and path; an adhesive model's is that in contact,
            everywhere.
        difference: change of a transformed parameter, relative to its scale, over which derivatives are taken.
        adhesive: whether the tension is that in contact alone, so that the fit looks for where the contact ends.
    """

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    tension: Callable[..., FloatArray]
    difference: float = 1e-4
    adhesive: bool = False


def setup_of(values: Values, setup: Setup) -> Setup:
    """The setup with the fitted values, as far as it has them."""
    names = ("relaxed_modulus", "work_of_adhesion", "retardation_time", "modulus_ratio")
    return setup.replaced(**{name: values[name] for name in names if values.get(name, 0.0) > 0.0})


def contact_modulus(values: Values, setup: Setup) -> float:
    """E* = E / (1 - nu^2), in Pa."""
    return values["relaxed_modulus"] / (1.0 - setup.poisson_ratio**2)


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
    while open_pieces and len(kept) < MOST_KNOTS:
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

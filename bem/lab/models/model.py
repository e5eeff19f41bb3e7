"""What a model of a force curve is: source, assumptions, parameters, and the tension along the path of an instrument.

A model knows neither offset, tilt, drag nor drift: those enter linearly and belong to the fit. Lengths in m, tensions
in N, positive in tension, moduli in Pa, times in s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.segments import straight_lines
from bem.lab.setup import Setup

Values = Mapping[str, float]
TABLE = np.linspace(0.0, 1.0, 1500) ** 2
"""Shares of the largest value at which a branch is tabulated, denser where the contact begins."""


@dataclass(frozen=True, eq=False)
class Path:
    """What an instrument moved: `position` (m), of the stage behind the setup's spring or the sphere, at `time` (s)."""

    time: FloatArray
    position: FloatArray
    setup: Setup

    @property
    def compliance(self) -> float:
        """Of the spring, in m/N; zero without one."""
        return 0.0 if self.setup.stiffness is None else 1.0 / self.setup.stiffness

    @cached_property
    def lines(self) -> tuple[FloatArray, FloatArray]:
        """Instants, in s from the first, and places, in m, of the corners between which the path is straight."""
        return straight_lines(self.time, self.position)


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model: its name in Python and on paper, its range, and what would determine it."""

    name: str
    title: str
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


MODULUS = Parameter("relaxed_modulus", "Young's modulus", "Pa", "logarithm", 1e-1, 1e13, "a deeper indentation")
ADHESION = Parameter(
    "work_of_adhesion", "work of adhesion", "J/m^2", "linear", 0.0, 1e3, "a retraction up to detachment"
)
CONTACT_POINT = Parameter(
    "contact_point", "contact point", "m", "linear", -math.inf, math.inf, "an approach from out of contact"
)
RETARDATION_TIME = Parameter(
    "retardation_time", "retardation time", "s", "logarithm", 1e-9, 1e9, "a hold or a ramp about as long as it"
)
MODULUS_RATIO = Parameter(
    *("modulus_ratio", "relaxed over instantaneous modulus", "", "logit", 0.01, 0.999),
    "a ramp shorter than the retardation time, and a hold longer",
)


@dataclass(frozen=True)
class Model:
    """A model of a force curve.

    Args:
        name: by which `fit` and `--model` know it.
        title: in words.
        source: of the formula.
        assumptions: under which it holds.
        parameters: all but the contact point, which every model has.
        tension: of the contact along a path, shape (n,), by values and path; that of DMT and JKR is the tension in
            contact, everywhere.
        difference: change of a transformed parameter, relative to its scale, over which derivatives are taken.
    """

    name: str
    title: str
    source: str
    assumptions: str
    parameters: tuple[Parameter, ...]
    tension: Callable[..., FloatArray]
    difference: float = 1e-4

    @property
    def costly(self) -> bool:
        """Whether derivatives are taken on one side only, because a tension takes long."""
        return self.name in ("ting", "contact")

    @property
    def spans(self) -> bool:
        """Whether the fit looks for where the contact begins and ends."""
        return self.name in ("dmt", "jkr")


def setup_of(values: Values, setup: Setup) -> Setup:
    """The setup with the fitted values, as far as it has them."""
    names = ("relaxed_modulus", "work_of_adhesion", "retardation_time", "modulus_ratio")
    return setup.replaced(**{name: values[name] for name in names if values.get(name, 0.0) > 0.0})


def reduced_modulus(values: Values, setup: Setup) -> float:
    """E* = E / (1 - nu^2), in Pa."""
    return values["relaxed_modulus"] / (1.0 - setup.poisson_ratio**2)


def deepest(values: Values, path: Path) -> float:
    """Depth, in m, to which a branch is needed; a spring that adhesion stretches lets the sphere ahead of the stage."""
    stretched = 2.0 * np.pi * path.setup.radius * values.get("work_of_adhesion", 0.0) * path.compliance
    return max(float(path.position.max()) - values["contact_point"], 0.0) + stretched + 1e-15


def along(depth: FloatArray, tension: FloatArray, values: Values, path: Path) -> FloatArray:
    """The tension at each point of a path, (n,), by a branch of depths and tensions, both (m,).

    A spring moves the end of the branch to where contact and spring lose stability together. Beyond its ends the branch
    is continued by its last value.
    """
    stage = depth - tension * path.compliance
    first = int(np.argmin(stage))
    return np.interp(path.position - values["contact_point"], stage[first:], tension[first:])

"""What a model of a force curve is: its parameters, and the tension along a measured path.

A model knows neither offset, tilt nor drag: those enter linearly and belong to the fit. Lengths in m, tensions in N,
positive in tension, moduli in Pa, times in s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from bem._support.validation import FloatArray
from bem.lab.models.path import Path
from bem.lab.setup import Setup

Values = Mapping[str, float]


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
    """

    name: str
    title: str
    parameters: tuple[Parameter, ...]

    difference: ClassVar[float] = 1e-4
    """Change of a transformed parameter, relative to its scale, over which derivatives are taken."""

    @property
    def adhesive(self) -> bool:
        """Whether the model gives the tension in contact alone, so that the fit looks for where the contact ends."""
        return False

    def tension(self, values: Values, path: Path) -> FloatArray:
        """Tension of the contact along a path, shape (n,); an adhesive model's is that in contact, everywhere."""
        raise NotImplementedError

    def setup_of(self, values: Values, setup: Setup) -> Setup:
        """The setup with the fitted values, as far as it has them."""
        names = {"relaxed_modulus", "work_of_adhesion"} | ({"retardation_time", "modulus_ratio"} & values.keys())
        changes: dict[str, Any] = {name: values[name] for name in names if values.get(name, 0.0) > 0.0}
        return setup.replaced(**changes)


def contact_modulus(values: Values, setup: Setup) -> float:
    """E* = E / (1 - nu^2), in Pa."""
    return values["relaxed_modulus"] / (1.0 - setup.poisson_ratio**2)

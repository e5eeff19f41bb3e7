"""The parameters of a fit: their units, how they are searched, and what would determine each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Scale = Literal["logarithm", "logit", "linear"]


@dataclass(frozen=True)
class Parameter:
    """One parameter of a fit."""

    name: str
    unit: str
    scale: Scale
    """How it is searched: positive quantities as logarithms, the modulus ratio, between 0 and 1, as a logit."""
    low: float
    high: float
    advice: str
    """What would determine it."""

    def inner(self, value: float) -> float:
        """The transformed value, in which the search works."""
        if self.scale == "logarithm":
            return math.log(value)
        return math.log(value / (1.0 - value)) if self.scale == "logit" else value

    def outer(self, inner: float) -> float:
        """The value that belongs to a transformed one."""
        if self.scale == "logarithm":
            return math.exp(inner) if inner < 700.0 else math.inf
        return 1.0 / (1.0 + math.exp(-max(min(inner, 700.0), -700.0))) if self.scale == "logit" else inner


PARAMETERS = {
    parameter.name: parameter
    for parameter in (
        Parameter("relaxed_modulus", "Pa", "logarithm", 1e0, 1e12, "a deeper indentation or a longer dwell"),
        Parameter("work_of_adhesion", "J/m^2", "logarithm", 1e-6, 1e3, "a retraction up to detachment"),
        Parameter("retardation_time", "s", "logarithm", 1e-9, 1e9, "a dwell or a ramp about as long as it"),
        Parameter(
            "modulus_ratio", "", "logit", 0.01, 0.999, "a ramp shorter than the retardation time, and a dwell longer"
        ),
        Parameter("contact_point", "m", "linear", -math.inf, math.inf, "an approach from out of contact"),
        Parameter("force_offset", "N", "linear", -math.inf, math.inf, "a baseline out of contact"),
    )
}

MEMORY = ("retardation_time", "modulus_ratio")
"""The parameters of relaxation."""

"""The shape of the indenter: profiles of revolution that rise with a power of the radius, f(r) = r^n / (n Q).

With n = 2 the profile is the paraboloid that stands for a sphere, and Q is its radius R; with n = 1 it is a cone that
rises by 1/Q. The scales of the sphere become

    beta = (Q^2 dgamma / E0*)^(1/(2n-1)),    mu = (Q dgamma^n / (E0*^n h0^(2n-1)))^(1/(2n-1)),

and pi Q beta^(2-n) dgamma for the force, which are those of the paper at n = 2. In these units f = mu r^n / n. As for
the sphere, mu is the depth beta^n / Q by which adhesion deforms the solid, over the range h0 of adhesion.

Source: Tabor, J. Colloid Interface Sci. 58 (1977) 2; for profiles of a power and their mu, Zheng and Yu, J. Colloid
Interface Sci. 310 (2007) 27; Grierson, Liu, Carpick and Turner, J. Mech. Phys. Solids 61 (2013) 597. Prefactors differ
between authors.
"""

import math
from dataclasses import dataclass

from bem._support.jit import kernel
from bem._support.validation import finite_number

CONE, PARABOLOID, FLATTEST = 1.0, 2.0, 8.0
"""Exponents; those from the first to the last are allowed."""


@dataclass(frozen=True)
class PowerLaw:
    """An indenter whose profile is a power of the radius: 1 for a cone, 2 for a paraboloid, more for flatter tips.

    Args:
        exponent: n, from 1 to 8.

    Raises:
        ValueError: naming what is allowed and what was received.
    """

    exponent: float

    def __post_init__(self) -> None:
        exponent = finite_number("exponent of the indenter", self.exponent, low=CONE, high=FLATTEST)
        object.__setattr__(self, "exponent", exponent)


def tension_without_deformation(tabor: float, exponent: float, gap: float = 1.0) -> float:
    """Attraction of an undeformed indenter at a gap of at least 1, by Lennard-Jones: 2 int sigma r^(2-n) dh."""
    power = 2.0 / exponent - 1.0
    near, far = (
        math.gamma(power + 1.0) * math.gamma(m - 1.0 - power) / math.gamma(m) * gap ** (power + 1.0 - m)
        for m in (3.0, 9.0)
    )
    return 16.0 / 3.0 * (exponent / tabor) ** power * (near - far)


@kernel
def depth_factor(exponent: float) -> float:
    """Indentation over mu a^n of a contact of radius a without adhesion (Galin, Sneddon); 1 for the paraboloid."""
    if exponent == PARABOLOID:
        return 1.0
    half = 0.5 * exponent
    return math.sqrt(math.pi) * math.gamma(half + 1.0) / (exponent * math.gamma(half + 0.5))

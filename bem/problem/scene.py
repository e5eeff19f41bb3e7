"""What is simulated: a sphere on a half-space, by its Tabor parameter, its material, its adhesion, and its spring.

The Tabor parameter mu = (R dgamma^2 / (E0*^2 h0^3))^(1/3) uses the relaxed modulus; see the paper, Methods. For an
indenter of another shape see `bem.problem.indenter`.
"""

import math
from dataclasses import dataclass, field

from bem._support.validation import finite_number, instance
from bem.problem.indenter import PARABOLOID, PowerLaw
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.tractions import ConstantStress, Exponential, HardContact, LennardJones, TractionLaw, law_of

SMALLEST_TABOR = 1e-6
LARGEST_TABOR = 1e7
SOFTEST_SPRING = 1e-12
STIFFEST_SPRING = 1e12


@dataclass(frozen=True)
class Scene:
    """One contact.

    Args:
        tabor: Tabor parameter mu, from 1e-6 (rigid) to 1e7; larger ones than about 1000 in elastic contacts, and 50 in
            viscoelastic ones, are answered by a sharp crack, for which the sphere must be a paraboloid.
        material: `Elastic()`, `StandardLinearSolid(...)` or `PronySeries(...)`.
        adhesion: the traction law, `LennardJones()`, `ConstantStress()`, `Exponential()` or a `TractionLaw` of your
            own; `HardContact()` is none.
        spring: stiffness of a spring between stage and sphere, a cantilever or the machine's own compliance, in
            pi R dgamma / h0, from 1e-12 to 1e12. An infinite one is none: the protocol then moves the sphere itself.
        indenter: `PowerLaw(...)`, a shape other than the paraboloid, which is `None`.

    Raises:
        ValueError: naming the quantity, what is allowed and what was received.
    """

    tabor: float
    material: Elastic | StandardLinearSolid | PronySeries = field(default_factory=Elastic)
    adhesion: LennardJones | HardContact | TractionLaw = field(default_factory=LennardJones)
    spring: float | None = None
    indenter: PowerLaw | None = None

    def __post_init__(self) -> None:
        tabor = finite_number("tabor", self.tabor, low=SMALLEST_TABOR, high=LARGEST_TABOR)
        object.__setattr__(self, "tabor", tabor)
        instance("material", self.material, (Elastic, StandardLinearSolid, PronySeries))
        instance("adhesion", self.adhesion, (LennardJones, ConstantStress, Exponential, HardContact, TractionLaw))
        law_of(self.adhesion)  # a law of your own is checked here
        spring = self.spring
        if spring is not None:
            endless = isinstance(spring, float) and spring == math.inf
            spring = None if endless else finite_number("spring", spring, low=SOFTEST_SPRING, high=STIFFEST_SPRING)
        object.__setattr__(self, "spring", spring)
        if self.indenter is not None:
            instance("indenter", self.indenter, (PowerLaw,))
            object.__setattr__(self, "indenter", None if self.indenter.exponent == PARABOLOID else self.indenter)

    @property
    def exponent(self) -> float:
        """Power of the radius with which the profile of the indenter rises."""
        return PARABOLOID if self.indenter is None else self.indenter.exponent

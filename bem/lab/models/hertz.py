"""Hertz: a sphere on an elastic half-space without adhesion, force (4/3) E* sqrt(R) depth^(3/2)."""

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import MODULUS, TABLE, Branch, Values, contact_modulus
from bem.lab.setup import Setup


def branch(values: Values, setup: Setup, deepest: float) -> tuple[FloatArray, FloatArray]:
    """Depths and tensions; see `Branch`."""
    depth = deepest * TABLE
    return depth, -4.0 / 3.0 * contact_modulus(values, setup) * np.sqrt(setup.radius) * depth**1.5


MODEL = Branch(
    name="hertz",
    title="Hertz: elastic sphere without adhesion",
    parameters=(MODULUS,),
    assumptions=("The solid is elastic.", "The surfaces do not attract each other.", "The depth is small beside R."),
    source="Johnson, Contact Mechanics (1985), section 4.2",
    branch=branch,
)

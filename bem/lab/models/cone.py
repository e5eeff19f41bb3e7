"""Sneddon: a rigid cone on an elastic half-space without adhesion, force (2/pi) E* tan(alpha) depth^2."""

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import MODULUS, TABLE, Branch, Values, contact_modulus
from bem.lab.setup import Setup


def branch(values: Values, setup: Setup, deepest: float) -> tuple[FloatArray, FloatArray]:
    """Depths and tensions; see `Branch`."""
    depth = deepest * TABLE
    return depth, -2.0 / np.pi * contact_modulus(values, setup) * setup.slope * depth**2


MODEL = Branch(
    name="cone",
    title="Sneddon: elastic cone without adhesion",
    parameters=(MODULUS,),
    assumptions=("The solid is elastic.", "The surfaces do not attract each other.", "The depth is large beside R."),
    source="Sneddon, Int. J. Eng. Sci. 3 (1965) 47",
    branch=branch,
)

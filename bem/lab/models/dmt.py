"""Derjaguin, Muller and Toporov: Hertz's contact, pulled by the long-ranged attraction 2 pi R w outside it."""

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models import hertz
from bem.lab.models.model import ADHESION, MODULUS, Branch, Values
from bem.lab.setup import Setup


def branch(values: Values, setup: Setup, deepest: float) -> tuple[FloatArray, FloatArray]:
    """Depths and tensions; see `Branch`."""
    depth, tension = hertz.branch(values, setup, deepest)
    return depth, tension + 2.0 * np.pi * setup.radius * values["work_of_adhesion"]


MODEL = Branch(
    name="dmt",
    title="DMT: elastic sphere with long-ranged adhesion",
    parameters=(MODULUS, ADHESION),
    assumptions=("The solid is elastic.", "The Tabor parameter is below 0.1.", "The depth is small beside R."),
    source="Maugis, Contact, Adhesion and Rupture of Elastic Solids (2000), section 4.3",
    adhesive=True,
    branch=branch,
)

"""Maugis and Dugdale: from DMT to JKR, with a constant attraction up to a range; see `bem.reference_solutions`."""

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import ADHESION, MODULUS, Branch, Parameter, Values, contact_modulus
from bem.lab.setup import Setup
from bem.reference_solutions import maugis_dugdale

TABOR = Parameter("tabor", "", "logarithm", 0.02, 20.0, "a noise far below the pull-off force")
_SMALLEST = 1e-9  # work of adhesion in J/m^2, that stands for none: the family is scaled by it
_ANGLES = np.concatenate([np.geomspace(1e-6, 0.1, 900), np.linspace(0.1, 0.5 * np.pi - 1e-4, 900)[1:]])[::-1]


def branch(values: Values, setup: Setup, _deepest: float) -> tuple[FloatArray, FloatArray]:
    """Depths and tensions from the fold on; see `Branch`."""
    work, tabor = max(values["work_of_adhesion"], _SMALLEST), values["tabor"]
    gap = np.cbrt(setup.radius * (work / contact_modulus(values, setup)) ** 2) / tabor
    _, depth, tension = maugis_dugdale.solution_at_angle(_ANGLES, tabor)
    first = int(np.argmin(depth))
    return depth[first:] * gap, tension[first:] * np.pi * setup.radius * work


MODEL = Branch(
    name="maugis",
    title="Maugis-Dugdale: elastic sphere between DMT and JKR",
    parameters=(MODULUS, ADHESION, TABOR),
    assumptions=("The solid is elastic.", "The attraction is constant up to a range.", "The depth is small beside R."),
    source="Maugis, J. Colloid Interface Sci. 150 (1992) 243",
    adhesive=True,
    branch=branch,
)

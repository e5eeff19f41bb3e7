"""Johnson, Kendall and Roberts: a sphere on an elastic half-space whose adhesion has a short range.

With a the contact radius, depth a^2/R - sqrt(2 pi w a / E*) and tension sqrt(8 pi w E* a^3) - (4/3) E* a^3 / R.
"""

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import ADHESION, MODULUS, TABLE, Branch, Values, contact_modulus
from bem.lab.setup import Setup


def branch(values: Values, setup: Setup, deepest: float) -> tuple[FloatArray, FloatArray]:
    """Depths and tensions from where contact and spring lose stability on; see `Branch`."""
    modulus, work, radius = contact_modulus(values, setup), values["work_of_adhesion"], setup.radius
    pull = 2.0 * np.pi * work / modulus
    fold = np.cbrt(radius**2 * pull / 16.0)
    # Above the largest radius: depth >= a^2/R - sqrt(pull a), and sqrt(pull a) <= a^2/(4 R) + (3/4) (pull^2 R)^(1/3).
    largest = np.sqrt(4.0 / 3.0 * radius * (deepest + 0.75 * np.cbrt(pull**2 * radius)))
    first = fold
    if setup.stiffness is not None and fold > 0.0:
        coarse = fold + (largest - fold) * TABLE[::15]
        depth, tension = _at(coarse, modulus, pull, radius)
        turn = int(np.argmin(depth - tension / setup.stiffness))
        first = coarse[max(turn - 1, 0)]
    return _at(first + (largest - first) * TABLE, modulus, pull, radius)


def _at(a: FloatArray, modulus: float, pull: float, radius: float) -> tuple[FloatArray, FloatArray]:
    return a**2 / radius - np.sqrt(pull * a), 2.0 * modulus * (np.sqrt(pull * a**3) - 2.0 / 3.0 * a**3 / radius)


MODEL = Branch(
    name="jkr",
    title="JKR: elastic sphere with short-ranged adhesion",
    parameters=(MODULUS, ADHESION),
    assumptions=("The solid is elastic.", "The Tabor parameter is above 5.", "The depth is small beside R."),
    source="Johnson, Kendall and Roberts, Proc. R. Soc. A 324 (1971) 301",
    adhesive=True,
    branch=branch,
)

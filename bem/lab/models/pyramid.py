"""A rigid pyramid of four faces on an elastic half-space without adhesion, force 0.7453 E* tan(alpha) depth^2."""

from bem._support.validation import FloatArray
from bem.lab.models.model import MODULUS, TABLE, Branch, Values, contact_modulus
from bem.lab.setup import Setup


def branch(values: Values, setup: Setup, deepest: float) -> tuple[FloatArray, FloatArray]:
    """Depths and tensions; see `Branch`. The angle is that of a face with the axis."""
    depth = deepest * TABLE
    return depth, -0.7453 * contact_modulus(values, setup) * setup.slope * depth**2


MODEL = Branch(
    name="pyramid",
    title="Bilodeau: elastic pyramid without adhesion",
    parameters=(MODULUS,),
    assumptions=("The solid is elastic.", "The surfaces do not attract each other.", "The depth is large beside R."),
    source="Bilodeau, J. Appl. Mech. 59 (1992) 519",
    branch=branch,
)

"""Sneddon's contact of a cone."""

from __future__ import annotations

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import MODULUS, TABLE, Model, Path, Values, along, deepest, reduced_modulus


def tension(values: Values, path: Path) -> FloatArray:
    """See `Model.tension`. Force (2/pi) E* tan(half angle) depth^2, at depths large beside the radius of the apex."""
    if path.setup.half_angle is None:
        raise ValueError("half_angle must be given for a cone; received None")
    depth, slope = deepest(values, path) * TABLE, float(np.tan(np.radians(path.setup.half_angle)))
    return along(depth, -2.0 / np.pi * reduced_modulus(values, path.setup) * slope * depth**2, values, path)


MODEL = Model(
    "cone",
    "Sneddon: elastic cone without adhesion",
    "Sneddon, Int. J. Eng. Sci. 3 (1965) 47",
    "no adhesion, no relaxation, a half-space, depth large beside the radius of the apex",
    (MODULUS,),
    tension,
)

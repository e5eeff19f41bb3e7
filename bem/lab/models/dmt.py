"""DMT: Hertz's contact, pulled by the long-ranged attraction 2 pi R w outside it."""

from __future__ import annotations

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.hertz import pressing
from bem.lab.models.model import ADHESION, MODULUS, Model, Path, Values, along, deepest, reduced_modulus


def tension(values: Values, path: Path) -> FloatArray:
    """See `Model.tension`."""
    depth, force = pressing(path.setup, deepest(values, path))
    pull = 2.0 * np.pi * path.setup.radius * values["work_of_adhesion"]
    return along(depth, pull - reduced_modulus(values, path.setup) * force, values, path)


MODEL = Model(
    "dmt",
    "DMT: elastic sphere with long-ranged adhesion",
    "Derjaguin, Muller and Toporov, J. Colloid Interface Sci. 53 (1975) 314",
    "no relaxation, a half-space or a bonded layer, depth at most the radius, Tabor parameter below 0.1",
    (MODULUS, ADHESION),
    tension,
)

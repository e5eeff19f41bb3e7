"""JKR: an elastic sphere with adhesion of short range, with the exact geometry of the sphere."""

from __future__ import annotations

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import ADHESION, MODULUS, TABLE, Model, Path, Values, along, deepest, reduced_modulus


def tension(values: Values, path: Path) -> FloatArray:
    """See `Model.tension`.

    With a = R tanh(s) the contact radius and Hertz's depth and force at it: depth is smaller by sqrt(2 pi w a / E*),
    the force by sqrt(8 pi w E* a^3); stable from where contact and spring lose stability on.
    """
    modulus, radius = reduced_modulus(values, path.setup), path.setup.radius
    pull, depth = 2.0 * np.pi * values["work_of_adhesion"] / modulus, deepest(values, path)

    def branch(s: FloatArray) -> tuple[FloatArray, FloatArray]:
        a = radius * np.tanh(s)
        pressed = radius**2 * ((1.0 + np.tanh(s) ** 2) * s - np.tanh(s))
        return s * a - np.sqrt(pull * a), modulus * (2.0 * np.sqrt(pull * a**3) - pressed)

    # s a - sqrt(pull a) >= depth at the largest: sqrt(pull a) <= s a / 4 + (3/4) (pull^2 R)^(1/3).
    ratio = 4.0 / 3.0 * (depth + 0.75 * np.cbrt(pull**2 * radius)) / radius
    largest = 0.5 * (ratio + np.sqrt(ratio**2 + 4.0 * ratio))
    coarse = largest * TABLE[::15]
    depths, force = branch(coarse)
    first = coarse[max(int(np.argmin(depths - force * path.compliance)) - 1, 0)]
    return along(*branch(first + (largest - first) * TABLE), values, path)


MODEL = Model(
    "jkr",
    "JKR: elastic sphere with short-ranged adhesion, exact geometry",
    "Johnson, Kendall and Roberts, Proc. R. Soc. A 324 (1971) 301; Maugis, Langmuir 11 (1995) 679",
    "no relaxation, a half-space, depth at most the radius, Tabor parameter above 5",
    (MODULUS, ADHESION),
    tension,
)

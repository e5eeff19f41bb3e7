"""Elastic contacts: Hertz and DMT on a half-space or a bonded layer, JKR, and Sneddon's cone.

The sphere has its exact geometry. With a = R tanh(s) the contact radius, its depth without adhesion is R s tanh(s) and
its force E* R^2 ((1 + tanh(s)^2) s - tanh(s)).
"""

from __future__ import annotations

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import ADHESION, MODULUS, TABLE, Model, Path, Values, along, deepest, reduced_modulus
from bem.lab.setup import Setup


def pressing(setup: Setup, depth: float) -> tuple[FloatArray, FloatArray]:
    """Depths (m,), in m, up to at least `depth`, and forces over the reduced modulus (m,), in m^2, without adhesion.

    On a layer the force is larger by Dimitriadis' series in sqrt(R depth) / thickness.
    """
    s = TABLE * _parameter(depth / setup.radius)
    depths, force = setup.radius * s * np.tanh(s), _force(s, setup.radius)
    return depths, force if setup.thickness is None else force * stiffening(depths, setup)


def _parameter(ratio: float) -> float:
    """A parameter s at which the depth is at least this share of the radius: s tanh(s) >= s^2 / (1 + s)."""
    return 0.5 * (ratio + np.sqrt(ratio**2 + 4.0 * ratio))


def _force(s: FloatArray, radius: float) -> FloatArray:
    return radius**2 * ((1.0 + np.tanh(s) ** 2) * s - np.tanh(s))


def stiffening(depth: FloatArray, setup: Setup) -> FloatArray:
    """Force on a layer bonded to a rigid ground over that on a half-space, (m,), at depths (m,).

    Source: Dimitriadis et al., Biophys. J. 82 (2002) 2798, equations 12 and 13.
    """
    nu = setup.poisson_ratio
    alpha = -(1.2876 - 1.4678 * nu + 1.3442 * nu**2) / (1.0 - nu) / np.pi
    beta = (0.6387 - 1.0277 * nu + 1.5164 * nu**2) / (1.0 - nu) / np.pi
    cubic, quartic = alpha**3 + 4.0 / 15.0 * beta, alpha * (alpha**3 + 0.6 * beta)
    chi = np.sqrt(setup.radius * depth) / setup.thickness
    return 1.0 - 2.0 * alpha * chi + 4.0 * alpha**2 * chi**2 - 8.0 * cubic * chi**3 + 16.0 * quartic * chi**4


def hertz(values: Values, path: Path, pull: float = 0.0) -> FloatArray:
    """Hertz, with a `pull` (N) everywhere; see `Model.tension`."""
    depth, force = pressing(path.setup, deepest(values, path))
    return along(depth, pull - reduced_modulus(values, path.setup) * force, values, path)


def dmt(values: Values, path: Path) -> FloatArray:
    """DMT: Hertz's contact, pulled by the long-ranged attraction 2 pi R w outside it; see `Model.tension`."""
    return hertz(values, path, 2.0 * np.pi * path.setup.radius * values["work_of_adhesion"])


def jkr(values: Values, path: Path) -> FloatArray:
    """JKR; see `Model.tension`.

    At a contact radius a, Hertz's depth is smaller by sqrt(2 pi w a / E*), and the force by sqrt(8 pi w E* a^3); stable
    from where contact and spring lose stability on.
    """
    modulus, radius = reduced_modulus(values, path.setup), path.setup.radius
    pull, depth = 2.0 * np.pi * values["work_of_adhesion"] / modulus, deepest(values, path)

    def branch(s: FloatArray) -> tuple[FloatArray, FloatArray]:
        a = radius * np.tanh(s)
        return s * a - np.sqrt(pull * a), modulus * (2.0 * np.sqrt(pull * a**3) - _force(s, radius))

    # s a - sqrt(pull a) >= depth at the largest: sqrt(pull a) <= s a / 4 + (3/4) (pull^2 R)^(1/3).
    largest = _parameter(4.0 / 3.0 * (depth + 0.75 * np.cbrt(pull**2 * radius)) / radius)
    coarse = largest * TABLE[::15]
    depths, force = branch(coarse)
    first = coarse[max(int(np.argmin(depths - force * path.compliance)) - 1, 0)]
    return along(*branch(first + (largest - first) * TABLE), values, path)


def cone(values: Values, path: Path) -> FloatArray:
    """Force (2/pi) E* tan(half angle) depth^2, at depths large beside the radius of the apex; see `Model.tension`."""
    if path.setup.half_angle is None:
        raise ValueError("half_angle must be given for a cone; received None")
    depth, slope = deepest(values, path) * TABLE, float(np.tan(np.radians(path.setup.half_angle)))
    return along(depth, -2.0 / np.pi * reduced_modulus(values, path.setup) * slope * depth**2, values, path)


HERTZ = Model(
    "hertz",
    "Hertz: elastic sphere without adhesion, exact geometry",
    "Sneddon, Int. J. Eng. Sci. 3 (1965) 47; on a layer Dimitriadis et al., Biophys. J. 82 (2002) 2798",
    "no adhesion, no relaxation, a half-space or a bonded layer of known thickness, depth at most the radius",
    (MODULUS,),
    hertz,
)
CONE = Model(
    "cone",
    "Sneddon: elastic cone without adhesion",
    "Sneddon, Int. J. Eng. Sci. 3 (1965) 47",
    "no adhesion, no relaxation, a half-space, depth large beside the radius of the apex",
    (MODULUS,),
    cone,
)
DMT = Model(
    "dmt",
    "DMT: elastic sphere with long-ranged adhesion",
    "Derjaguin, Muller and Toporov, J. Colloid Interface Sci. 53 (1975) 314",
    "no relaxation, a half-space or a bonded layer, depth at most the radius, Tabor parameter below 0.1",
    (MODULUS, ADHESION),
    dmt,
)
JKR = Model(
    "jkr",
    "JKR: elastic sphere with short-ranged adhesion, exact geometry",
    "Johnson, Kendall and Roberts, Proc. R. Soc. A 324 (1971) 301; Maugis, Langmuir 11 (1995) 679",
    "no relaxation, a half-space, depth at most the radius, Tabor parameter above 5",
    (MODULUS, ADHESION),
    jkr,
)

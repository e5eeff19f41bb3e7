"""Hertz's contact of a sphere, with the exact geometry of the sphere, on a half-space or on a bonded layer."""

from __future__ import annotations

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import MODULUS, TABLE, Model, Path, Values, along, deepest, reduced_modulus
from bem.lab.setup import Setup


def pressing(setup: Setup, depth: float) -> tuple[FloatArray, FloatArray]:
    """Depths (m,), in m, up to at least `depth`, and forces over the reduced modulus (m,), in m^2.

    With s = artanh(a/R), a the contact radius: depth R s tanh(s), force E* R^2 ((1 + tanh(s)^2) s - tanh(s)). On a
    layer the force is larger by Dimitriadis' series in sqrt(R depth) / thickness.
    """
    ratio = depth / setup.radius
    s = TABLE * 0.5 * (ratio + np.sqrt(ratio**2 + 4.0 * ratio))  # s tanh(s) >= s^2 / (1 + s)
    depths, force = setup.radius * s * np.tanh(s), setup.radius**2 * ((1.0 + np.tanh(s) ** 2) * s - np.tanh(s))
    return depths, force if setup.thickness is None else force * stiffening(depths, setup)


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


def tension(values: Values, path: Path) -> FloatArray:
    """See `Model.tension`."""
    depth, force = pressing(path.setup, deepest(values, path))
    return along(depth, -reduced_modulus(values, path.setup) * force, values, path)


MODEL = Model(
    "hertz",
    "Hertz: elastic sphere without adhesion, exact geometry",
    "Sneddon, Int. J. Eng. Sci. 3 (1965) 47; on a layer Dimitriadis et al., Biophys. J. 82 (2002) 2798",
    "no adhesion, no relaxation, a half-space or a bonded layer of known thickness, depth at most the radius",
    (MODULUS,),
    tension,
)

"""Elastic models, whose tension depends on the depth alone: Hertz, cone, DMT and JKR.

Spheres are parabolic: their contact is small beside the radius. JKR in full, with a the contact radius: depth a^2/R -
sqrt(2 pi w a / E*), tension sqrt(8 pi w E* a^3) - (4/3) E* a^3 / R. Its Tabor parameter is above 5, that of DMT below
0.1.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import ADHESION, MODULUS, Model, Parameter, Path, Values, contact_modulus
from bem.lab.setup import Setup

TABLE = np.linspace(0.0, 1.0, 1500) ** 2
"""Shares of the largest depth or radius at which a branch is tabulated, denser where the contact begins."""

Curve = tuple[FloatArray, FloatArray]
"""Depths (m), growing to at least the deepest, and tensions (N)."""


def tension(branch: Callable[[Values, Setup, float], Curve], values: Values, path: Path) -> FloatArray:
    """See `Model.tension`, by the branch, of values, setup and largest depth, that is stable at fixed indentation.

    A spring moves its end to where contact and spring lose stability together. Beyond its ends the branch is continued
    by its last value.
    """
    apart = path.place - values["contact_point"]
    stretched = 2.0 * np.pi * path.setup.radius * values.get("work_of_adhesion", 0.0) * path.compliance
    depth, force = branch(values, path.setup, max(float(apart.max()), 0.0) + stretched + 1e-15)
    stage = depth - force * path.compliance
    first = int(np.argmin(stage))
    return np.interp(apart, stage[first:], force[first:])


def hertz(values: Values, setup: Setup, deepest: float) -> Curve:
    """Force (4/3) E* sqrt(R) depth^(3/2): Johnson, Contact Mechanics (1985), section 4.2."""
    depth = deepest * TABLE
    return depth, -4.0 / 3.0 * contact_modulus(values, setup) * np.sqrt(setup.radius) * depth**1.5


def cone(values: Values, setup: Setup, deepest: float) -> Curve:
    """Force (2/pi) E* tan(alpha) depth^2, large beside the radius: Sneddon, Int. J. Eng. Sci. 3 (1965) 47."""
    if setup.half_angle is None:
        raise ValueError("half_angle must be given for a cone; received None")
    depth, slope = deepest * TABLE, float(np.tan(np.radians(setup.half_angle)))
    return depth, -2.0 / np.pi * contact_modulus(values, setup) * slope * depth**2


def dmt(values: Values, setup: Setup, deepest: float) -> Curve:
    """Hertz's contact, pulled by the long-ranged attraction 2 pi R w outside it; see `bem.methods.closed_forms.dmt`."""
    depth, force = hertz(values, setup, deepest)
    return depth, force + 2.0 * np.pi * setup.radius * values["work_of_adhesion"]


def jkr(values: Values, setup: Setup, deepest: float) -> Curve:
    """Short-ranged adhesion, from where contact and spring lose stability on; see `bem.methods.closed_forms.jkr`."""
    modulus, work, radius = contact_modulus(values, setup), values["work_of_adhesion"], setup.radius
    pull = 2.0 * np.pi * work / modulus

    def at(a: FloatArray) -> Curve:
        return a**2 / radius - np.sqrt(pull * a), 2.0 * modulus * (np.sqrt(pull * a**3) - 2.0 / 3.0 * a**3 / radius)

    fold = np.cbrt(radius**2 * pull / 16.0)
    # Above the largest radius: depth >= a^2/R - sqrt(pull a), and sqrt(pull a) <= a^2/(4 R) + (3/4) (pull^2 R)^(1/3).
    largest = np.sqrt(4.0 / 3.0 * radius * (deepest + 0.75 * np.cbrt(pull**2 * radius)))
    first = fold
    if setup.stiffness is not None and fold > 0.0:
        coarse = fold + (largest - fold) * TABLE[::15]
        depth, force = at(coarse)
        first = coarse[max(int(np.argmin(depth - force / setup.stiffness)) - 1, 0)]
    return at(first + (largest - first) * TABLE)


def _model(name: str, title: str, branch: Callable[[Values, Setup, float], Curve], *further: Parameter) -> Model:
    return Model(name, title, (MODULUS, *further), partial(tension, branch), adhesive=ADHESION in further)


MODELS = (
    _model("hertz", "Hertz: elastic sphere without adhesion", hertz),
    _model("cone", "Sneddon: elastic cone without adhesion", cone),
    _model("dmt", "DMT: elastic sphere with long-ranged adhesion", dmt, ADHESION),
    _model("jkr", "JKR: elastic sphere with short-ranged adhesion", jkr, ADHESION),
)

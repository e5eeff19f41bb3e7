"""Johnson, Kendall and Roberts: the limit of short-range adhesion, mu -> infinity.

With radius a in beta: indentation mu (a^2 - sqrt(2 pi a)) and force sqrt(8/pi) a^(3/2) - (4 / (3 pi)) a^3. Under load
control the contact is lost at force 3/2, under displacement control at the fold, force 5/6 and indentation
-(3/4) pi^(2/3) mu, where a^3 = pi/8. For an indenter whose profile is another power n of the radius, the terms of Hertz
are those of `bem.methods.closed_forms.hertz`; the others, of a flat punch that releases the work of adhesion at its
rim, are the same for all. Units: see `bem.methods.closed_forms` and `bem.problem.indenter`. Source: Johnson, Kendall
and Roberts, Proc. R. Soc. A 324 (1971) 301; Johnson, Contact Mechanics (1985), section 5.5; Maugis, Contact, Adhesion
and Rupture of Elastic Solids (2000), chapter 4; Maugis and Barquins, J. Phys. D 16 (1983) 1843, and Zhou, Gao and He,
J. Mech. Phys. Solids 59 (2011) 145, for other profiles.
"""

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import uncompiled
from bem._support.validation import FloatArray
from bem.methods.closed_forms import hertz
from bem.problem.indenter import PARABOLOID, depth_factor

PULL_OFF_FORCE = 1.5
FOLD_FORCE = 5.0 / 6.0
FOLD_RADIUS = (np.pi / 8.0) ** (1.0 / 3.0)


def fold_indentation(tabor: ArrayLike) -> FloatArray:
    """Smallest indentation at which a contact exists."""
    return -0.75 * np.pi ** (2.0 / 3.0) * np.asarray(tabor, dtype=np.float64)


def indentation_from_contact_radius(radius: ArrayLike, tabor: ArrayLike, exponent: float = PARABOLOID) -> FloatArray:
    """Indentation at a contact radius."""
    a = np.asarray(radius, dtype=np.float64)
    pressed = uncompiled(depth_factor)(exponent) * a**exponent
    return np.asarray(tabor, dtype=np.float64) * (pressed - np.sqrt(2.0 * np.pi * a))


def force_from_contact_radius(radius: ArrayLike, exponent: float = PARABOLOID) -> FloatArray:
    """Force at a contact radius; independent of the Tabor parameter."""
    a = np.asarray(radius, dtype=np.float64)
    return np.sqrt(8.0 / np.pi) * a**1.5 + hertz.force_from_contact_radius(a, exponent)


def pull_off_force(exponent: float = PARABOLOID) -> float:
    """Largest force, at which the contact is lost under load control; 3/2 for the paraboloid."""
    ratio = 1.5 * np.sqrt(8.0 / np.pi) / (hertz.load_factor(exponent) * (exponent + 1.0))
    return float(force_from_contact_radius(ratio ** (1.0 / (exponent - 0.5)), exponent))


def contact_radius_from_indentation(indentation: ArrayLike, tabor: ArrayLike) -> FloatArray:
    """Contact radius at an indentation, on the branch that is stable at fixed indentation.

    Newton's method on y^4 - sqrt(2 pi) y = indentation/mu with y = sqrt(a): the quartic is convex, so it converges
    monotonically from an upper bound.

    Returns:
        radius of the broadcast shape; NaN below the fold.
    """
    depth = np.asarray(indentation, dtype=np.float64) / np.asarray(tabor, dtype=np.float64)
    fold = float(fold_indentation(1.0))
    target = np.maximum(depth, fold)
    root = np.maximum(target, 0.0) ** 0.25 + (2.0 * np.pi) ** (1.0 / 6.0)
    for _ in range(80):
        slope = 4.0 * root**3 - np.sqrt(2.0 * np.pi)
        excess = root**4 - np.sqrt(2.0 * np.pi) * root - target
        root = root - np.divide(excess, slope, out=np.zeros_like(root), where=(slope != 0.0) & (excess > 0.0))
    # The fold itself must not be lost to the rounding of indentation/tabor.
    return np.where(depth >= fold * (1.0 + 4.0 * np.finfo(float).eps), root**2, np.nan)


def force_from_indentation(indentation: ArrayLike, tabor: ArrayLike) -> FloatArray:
    """Force at an indentation; NaN below the fold. See `contact_radius_from_indentation`."""
    return force_from_contact_radius(contact_radius_from_indentation(indentation, tabor))

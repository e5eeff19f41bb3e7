"""Hertz: a sphere on an elastic half-space without adhesion; Galin and Sneddon: any power-law indenter.

With radius a in beta: indentation s mu a^n and force -(2 s n / (pi (n + 1))) a^(n+1), where s is the `depth_factor` of
the exponent n. For the paraboloid, the default everywhere, these are mu a^2 and -(4 / (3 pi)) a^3. Units: see
`bem.methods.closed_forms` and `bem.problem.indenter`.
Source: Johnson, Contact Mechanics (1985), Eqs. (4.22) to (4.24), section 5.2; Sneddon, Int. J. Eng. Sci. 3 (1965) 47.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import uncompiled
from bem._support.validation import FloatArray
from bem.problem.indenter import PARABOLOID, depth_factor


def load_factor(exponent: float = PARABOLOID) -> float:
    """Compression over a^(n+1)."""
    return 2.0 * uncompiled(depth_factor)(exponent) * exponent / (math.pi * (exponent + 1.0))


def contact_radius_from_indentation(
    indentation: ArrayLike, tabor: ArrayLike, exponent: float = PARABOLOID
) -> FloatArray:
    """Contact radius, zero where the indentation is negative; shapes broadcast."""
    ratio = np.maximum(indentation, 0.0) / np.asarray(tabor, dtype=np.float64)
    if exponent == PARABOLOID:
        return np.sqrt(ratio)
    return (ratio / uncompiled(depth_factor)(exponent)) ** (1.0 / exponent)


def force_from_contact_radius(radius: ArrayLike, exponent: float = PARABOLOID) -> FloatArray:
    """Force at a contact radius; never positive."""
    return -load_factor(exponent) * np.asarray(radius, dtype=np.float64) ** (exponent + 1.0)


def force_from_indentation(indentation: ArrayLike, tabor: ArrayLike, exponent: float = PARABOLOID) -> FloatArray:
    """Force at an indentation, zero where it is negative; shapes broadcast."""
    return force_from_contact_radius(contact_radius_from_indentation(indentation, tabor, exponent), exponent)


def indentation_from_force(force: float, tabor: float, exponent: float = PARABOLOID) -> float:
    """Indentation at a compressive `force`, counted positive here."""
    factor = uncompiled(depth_factor)(exponent)
    cubed = (0.5 + 0.5 * exponent) / exponent * math.pi / factor * force  # a^(n+1)
    return float(tabor * factor * cubed ** (exponent / (exponent + 1.0)))

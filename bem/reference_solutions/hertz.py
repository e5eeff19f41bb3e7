"""Hertz: a sphere on an elastic half-space without adhesion.

With radius a in beta: indentation mu a^2 and force -(4 / (3 pi)) a^3. Units: see `bem.reference_solutions`.
Source: Johnson, Contact Mechanics (1985), Eqs. (4.22) to (4.24).
"""

import numpy as np
from numpy.typing import ArrayLike

from bem._support.validation import FloatArray


def contact_radius_from_indentation(indentation: ArrayLike, tabor: ArrayLike) -> FloatArray:
    """Contact radius, zero where the indentation is negative; shapes broadcast."""
    return np.sqrt(np.maximum(indentation, 0.0) / np.asarray(tabor, dtype=np.float64))


def force_from_contact_radius(radius: ArrayLike) -> FloatArray:
    """Force at a contact radius; never positive."""
    return -4.0 / (3.0 * np.pi) * np.asarray(radius, dtype=np.float64) ** 3


def force_from_indentation(indentation: ArrayLike, tabor: ArrayLike) -> FloatArray:
    """Force at an indentation, zero where it is negative; shapes broadcast."""
    return force_from_contact_radius(contact_radius_from_indentation(indentation, tabor))

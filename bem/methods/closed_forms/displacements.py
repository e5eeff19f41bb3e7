"""Displacement of an elastic half-space under three axisymmetric pressures on a disc of radius 1, the largest being 1.

Units: E* = 1 (divide by E* otherwise); displacement in pressure times length, positive into the half-space under a
positive pressure. In the project's units the same numbers times mu hold for tractions in dgamma/(mu h0), radii in beta
and displacements in h0. Source: Johnson, Contact Mechanics (1985), Eqs. (3.29) and
(3.42); the cone is a superposition of uniform discs.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.special import ellipe, ellipkm1

from bem._support.validation import FloatArray


def hertz_pressure(radius: ArrayLike) -> FloatArray:
    """Displacement at `radius` under the pressure sqrt(1 - r^2)."""
    r = np.abs(np.asarray(radius, dtype=np.float64))
    far = np.maximum(r, 1.0)
    outside = (2.0 - far**2) * np.arcsin(1.0 / far) + np.sqrt((far - 1.0) * (far + 1.0))
    inside = 0.5 * np.pi * (2.0 - r**2)
    return 0.5 * np.where(r <= 1.0, inside, outside)


def uniform_disc(radius: ArrayLike, *, disc_radius: float = 1.0) -> FloatArray:
    """Displacement at `radius` under a pressure of 1 on a disc of radius a: 2 a at the centre, 4 a/pi at the rim."""
    r, a = np.abs(np.asarray(radius, dtype=np.float64)), disc_radius
    inside = a * ellipe(np.minimum(r / a, 1.0) ** 2)
    far = np.maximum(r, a)
    complement = (1.0 - a / far) * (1.0 + a / far)
    # At the rim the integral K diverges, but its factor vanishes faster.
    first_kind = ellipkm1(np.where(complement > 0.0, complement, 1.0))
    outside = far * (ellipe(1.0 - complement) - complement * first_kind)
    return 4.0 / np.pi * np.where(r <= a, inside, outside)


def cone_pressure(radius: ArrayLike) -> FloatArray:
    """Displacement at `radius` under the pressure 1 - r, by quadrature to about 1e-12; at the rim it is 0.37180785."""

    def one(r: float) -> float:
        pieces = pairwise(sorted({0.0, min(r, 1.0), 1.0}))
        options = {"epsabs": 1e-13, "epsrel": 1e-12}
        return sum(quad(lambda c: float(uniform_disc(r, disc_radius=c)), *piece, **options)[0] for piece in pieces)

    radii = np.abs(np.asarray(radius, dtype=np.float64))
    return np.array([one(float(r)) for r in radii.ravel()]).reshape(radii.shape)

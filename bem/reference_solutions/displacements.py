"""Displacement of an elastic half-space under three axisymmetric pressures on a disc of radius a.

Units: E* = 1 (divide by E* otherwise), any length for radii; displacement in pressure times length, positive into the
half-space under a positive pressure. In the project's units the same numbers times mu hold for tractions in
dgamma/(mu h0), radii in beta and displacements in h0. Source: Johnson, Contact Mechanics (1985), Eqs. (3.29) and
(3.42); the cone is a superposition of uniform discs.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.special import ellipe, ellipkm1

from bem._support.validation import FloatArray


def hertz_pressure(radius: ArrayLike, *, disc_radius: float = 1.0, peak: float = 1.0) -> FloatArray:
    """Displacement at `radius` under the pressure peak sqrt(1 - (r/a)^2)."""
    r, a = np.abs(np.asarray(radius, dtype=np.float64)), disc_radius
    far = np.maximum(r, a)
    outside = (2.0 * a**2 - far**2) * np.arcsin(a / far) + a * np.sqrt((far - a) * (far + a))
    inside = 0.5 * np.pi * (2.0 * a**2 - r**2)
    return peak / (2.0 * a) * np.where(r <= a, inside, outside)


def uniform_disc(radius: ArrayLike, *, disc_radius: float = 1.0, pressure: float = 1.0) -> FloatArray:
    """Displacement at `radius` under a uniform pressure: 2 p a at the centre, 4 p a/pi at the rim."""
    r, a = np.abs(np.asarray(radius, dtype=np.float64)), disc_radius
    inside = a * ellipe(np.minimum(r / a, 1.0) ** 2)
    far = np.maximum(r, a)
    complement = (1.0 - a / far) * (1.0 + a / far)
    # At the rim the integral K diverges, but its factor vanishes faster.
    first_kind = ellipkm1(np.where(complement > 0.0, complement, 1.0))
    outside = far * (ellipe(1.0 - complement) - complement * first_kind)
    return 4.0 * pressure / np.pi * np.where(r <= a, inside, outside)


def cone_pressure(radius: ArrayLike, *, disc_radius: float = 1.0, peak: float = 1.0) -> FloatArray:
    """Displacement at `radius` under the pressure peak (1 - r/a), by quadrature to about 1e-12 of the peak value.

    It is p0 a at the centre and 0.37180785 p0 a at the rim.
    """
    a = disc_radius

    def one(r: float) -> float:
        pieces = sorted({0.0, min(r, a), a})
        total = sum(
            quad(lambda c: float(uniform_disc(r, disc_radius=c)), begin, end, epsabs=1e-13 * a**2, epsrel=1e-12)[0]
            for begin, end in pairwise(pieces)
        )
        return peak * total / a

    radii = np.abs(np.asarray(radius, dtype=np.float64))
    return np.array([one(float(r)) for r in radii.ravel()]).reshape(radii.shape)

"""Maugis: JKR to DMT with a constant cohesive traction sigma_0 up to a gap dgamma/sigma_0.

The family is traced by the angle theta, sec(theta) = c/a being the outer over the inner radius of the cohesive zone. In
Maugis' variables, with K = (4/3) E*, w = dgamma and lambda = 2 sigma_0 (R / (pi w K^2))^(1/3),

    1 = (lambda A^2 / 2) [sqrt(m^2 - 1) + (m^2 - 2) arcsec m]
        + (4/3) lambda^2 A [sqrt(m^2 - 1) arcsec m - m + 1],

which is quadratic in the contact radius A at given m. Conversions: A = (4 / (3 pi))^(1/3) a, indentation
D = (16 / (9 pi^2))^(1/3) delta / mu, lambda = 2 (9 / (16 pi))^(1/3) (sigma_0 h0/dgamma) mu. Units: see
`bem.methods.closed_forms`. Source: Maugis, J. Colloid Interface Sci. 150 (1992) 243; Maugis, Contact, Adhesion and
Rupture of Elastic Solids (2000), chapter 4; Johnson and Greenwood, J. Colloid Interface Sci. 192 (1997) 326.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from bem._support.validation import FloatArray, finite_number
from bem.problem.tractions import PEAK_TRACTION

SMALLEST_ANGLE = 1e-6
LARGEST_ANGLE = 0.5 * np.pi - 1e-6
RADIUS_UNIT = (4.0 / (3.0 * np.pi)) ** (1.0 / 3.0)
INDENTATION_UNIT = (16.0 / (9.0 * np.pi**2)) ** (1.0 / 3.0)


def maugis_parameter(tabor: ArrayLike) -> FloatArray:
    """Maugis' lambda, 1.157 mu, as the cohesive traction is the largest of the Lennard-Jones law (1.03)."""
    return 2.0 * (9.0 / (16.0 * np.pi)) ** (1.0 / 3.0) * PEAK_TRACTION * np.asarray(tabor, dtype=np.float64)


def solution_at_angle(angle: ArrayLike, tabor: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Contact radius, indentation and force at theta in (0, pi/2), theta = arccos(a/c); shapes broadcast."""
    theta = np.asarray(angle, dtype=np.float64)
    lam = maugis_parameter(tabor)
    tangent, secant = np.tan(theta), 1.0 / np.cos(theta)
    # The leading terms cancel at small angles, where the series is exact to rounding.
    series = theta**3 * (4.0 / 3.0 + theta**2 * (4.0 / 5.0 + theta**2 * (136.0 / 315.0)))
    bracket = np.where(theta < 0.02, series, tangent + (tangent**2 - 1.0) * theta)
    square = 0.5 * lam * bracket
    linear = 4.0 / 3.0 * lam**2 * (tangent * theta - 2.0 * np.sin(0.5 * theta) ** 2 * secant)
    radius = 2.0 / (linear + np.sqrt(linear**2 + 4.0 * square))
    indentation = radius**2 - 4.0 / 3.0 * lam * radius * tangent
    force = lam * radius**2 * (tangent + secant**2 * theta) - radius**3
    return radius / RADIUS_UNIT, indentation * np.asarray(tabor) / INDENTATION_UNIT, force


def _smallest(function: Callable[[ArrayLike], FloatArray]) -> tuple[float, float]:
    """Angle at which a function of it is smallest, and the smallest value."""
    angles = np.geomspace(SMALLEST_ANGLE, LARGEST_ANGLE, 2000)
    values = function(angles)
    near = min(max(int(np.argmin(values)), 1), len(angles) - 2)
    minimum = minimize_scalar(
        lambda theta: float(function(theta)),
        bounds=(angles[near - 1], angles[near + 1]),
        method="bounded",
        options={"xatol": 1e-12},
    )
    return (LARGEST_ANGLE, float(values[-1])) if values[-1] <= minimum.fun else (float(minimum.x), float(minimum.fun))


def force_from_indentation(indentation: ArrayLike, tabor: float) -> FloatArray:
    """Force on the branch stable at fixed indentation; NaN where it holds no contact. Shape of `indentation`."""
    mu = finite_number("tabor", tabor, above=0.0)
    # The fold ends the branch that is stable at fixed indentation.
    last, _ = _smallest(lambda theta: solution_at_angle(theta, mu)[1])
    first = SMALLEST_ANGLE

    def misfit(theta: float, depth: float) -> float:
        return float(solution_at_angle(theta, mu)[1]) - depth

    def force_at(depth: float) -> float:
        if not misfit(last, depth) <= 0.0 <= misfit(first, depth):
            return np.nan
        theta = brentq(misfit, first, last, args=(depth,), xtol=1e-15)
        return float(solution_at_angle(theta, mu)[2])

    depths = np.asarray(indentation, dtype=np.float64)
    return np.array([force_at(float(depth)) for depth in depths.ravel()]).reshape(depths.shape)


def pull_off_force(tabor: float) -> float:
    """Largest force on the way to separation, between 1.5 (JKR) and 2 (DMT)."""
    mu = finite_number("tabor", tabor, above=0.0)
    return -_smallest(lambda theta: -solution_at_angle(theta, mu)[2])[1]

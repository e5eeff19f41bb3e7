"""Integrals of the axisymmetric kernel (see `bem.discretisation.influence`) over loaded discs.

The indefinite integrals over the ratio x = s / r are A_n(x) = (4/pi) * integral over (0, x) of t^(n+1) G(1, t) pi/4 dt.
A_0 is closed in K and E; A_1 needs the integral of K and is evaluated from Chebyshev series, split as
`smooth + smooth * log|1 - x|` around the logarithmic singularity at x = 1, accurate to rounding everywhere.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.polynomial import Chebyshev, chebyshev

from bem.discretisation.elliptic_integrals import elliptic_integrals, elliptic_series

_SPLIT = 0.7  # the logarithm is split off where x or 1/x lies between this and 1
_SERIES_DEGREE = 24


def ring_moments(ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of the kernel over discs: uniform and linear traction of unit size inside `ratio`, seen from radius 1.

    Args:
        ratio: array of any shape, x = s / r >= 0, the outer radius of the loaded disc over the radius of observation.

    Returns:
        A_0(x) and A_1(x), same shape: displacement at radius 1 under the tractions 1 and s on 0 < s < x.
    """
    x = np.asarray(ratio, dtype=np.float64)
    uniform, linear = np.empty_like(x), np.empty_like(x)
    inside = x <= 1.0
    xi, yo = x[inside], 1.0 / x[~inside]
    uniform[inside] = _uniform_moment_inside(xi)
    uniform[~inside] = elliptic_integrals((1.0 - yo) * (1.0 + yo))[1] / yo
    linear[inside] = _linear_moment_inside(xi)
    linear[~inside] = _linear_moment_outside(yo)
    return (4.0 / np.pi) * uniform, (4.0 / np.pi) * linear


def _uniform_moment_inside(x: np.ndarray) -> np.ndarray:
    """Integral over (0, x) of K(t) t dt = E(x) - (1 - x^2) K(x) for 0 <= x <= 1; by series where that cancels."""
    near_one = x > _SPLIT
    out = np.empty_like(x)
    small, big = x[~near_one], x[near_one]
    out[~near_one] = small**2 * _tables()["inside_uniform"](small * small)
    complement = (1.0 - big) * (1.0 + big)
    first, second = elliptic_integrals(complement)
    out[near_one] = second - complement * first
    return out


def _linear_moment_inside(x: np.ndarray) -> np.ndarray:
    """Integral over (0, x) of K(t) t^2 dt for 0 <= x <= 1."""
    near_one = x > _SPLIT
    out = np.empty_like(x)
    tables = _tables()
    small = x[~near_one]
    out[~near_one] = small**3 * tables["inside"](small * small)
    big = x[near_one]
    out[near_one] = tables["inside_smooth"](big) + tables["inside_log"](big) * _safe_log1m(big)
    return out


def _linear_moment_outside(y: np.ndarray) -> np.ndarray:
    """Integral over (0, 1/y) of t^2 G(1, t) pi/4 dt for 0 < y <= 1: the disc reaches beyond the observer."""
    near_one = y > _SPLIT
    out = np.empty_like(y)
    tables = _tables()
    small = y[~near_one]
    out[~near_one] = np.pi / 4.0 / small**2 - np.pi / 8.0 * np.log(small) + tables["outside"](small * small)
    big = y[near_one]
    out[near_one] = tables["outside_smooth"](big) + tables["outside_log"](big) * _safe_log1m(big)
    return out


def _safe_log1m(x: np.ndarray) -> np.ndarray:
    # The factor of the logarithm vanishes at x = 1, where the logarithm itself would be -inf.
    return np.log(np.maximum(1.0 - x, 1e-300))


@functools.cache
def _tables() -> dict[str, Chebyshev]:
    """Chebyshev series of the smooth parts, built once from Gauss quadrature (a few milliseconds)."""
    up_to_one = functools.partial(_integral_to_one, lambda below: elliptic_integrals(below * (2.0 - below))[0])
    # K of the complementary modulus is (up to 1/pi) what multiplies log(1 - t) in K(t)
    log_factor = functools.partial(_integral_to_one, lambda below: elliptic_integrals((1.0 - below) ** 2)[0])
    total = _moment_from_series(np.array([0.5]), 2)[0] + up_to_one(np.array([0.5]), 2)[0]

    def inside_log(x: np.ndarray) -> np.ndarray:
        return log_factor(x, 2) / np.pi

    def outside_log(y: np.ndarray) -> np.ndarray:
        return -log_factor(y, -3) / np.pi

    def inside_smooth(x: np.ndarray) -> np.ndarray:
        return total - up_to_one(x, 2) - inside_log(x) * np.log1p(-x)

    def outside(y: np.ndarray) -> np.ndarray:
        return total + up_to_one(y, -3)

    near = (_SPLIT, 1.0)
    far = (0.0, _SPLIT**2)
    return {
        "inside_uniform": _interpolate(lambda z: _moment_from_series(np.sqrt(z), 1) / z, far),
        "inside": _interpolate(lambda z: _moment_from_series(np.sqrt(z), 2) / np.sqrt(z) ** 3, far),
        "inside_smooth": _interpolate(inside_smooth, near),
        "inside_log": _interpolate(inside_log, near),
        "outside": _interpolate(lambda z: _outside_remainder(np.sqrt(z), outside), far),
        "outside_smooth": _interpolate(lambda y: outside(y) - outside_log(y) * np.log1p(-y), near),
        "outside_log": _interpolate(outside_log, near),
    }


def _interpolate(function: Callable, domain: tuple[float, float]) -> Chebyshev:
    middle, half = 0.5 * (domain[0] + domain[1]), 0.5 * (domain[1] - domain[0])
    return Chebyshev(chebyshev.chebinterpolate(lambda t: function(middle + half * t), _SERIES_DEGREE), domain=domain)


def _integral_to_one(kernel: Callable, lower: np.ndarray, power: int) -> np.ndarray:
    """Integral over (lower, 1) of kernel(1 - t) t^power dt; 1 - t = width z^6 flattens a logarithm at t = 1."""
    nodes, weights = _gauss_points()
    z = 0.5 * (nodes + 1.0)
    width = 1.0 - np.asarray(lower)[:, None]
    below = width * z**6
    return np.sum(0.5 * weights * 6.0 * width * z**5 * kernel(below) * (1.0 - below) ** power, axis=1)


@functools.cache
def _gauss_points() -> tuple[np.ndarray, np.ndarray]:
    return np.polynomial.legendre.leggauss(80)


def _moment_from_series(x: np.ndarray, power: int) -> np.ndarray:
    """Integral over (0, x) of K(t) t^power dt by its power series, for x <= _SPLIT."""
    exponent = 2 * np.arange(120) + power + 1
    return np.pi / 2.0 * np.sum(elliptic_series() * x[:, None] ** exponent / exponent, axis=1)


def _outside_remainder(y: np.ndarray, outside: Callable) -> np.ndarray:
    """What is left of the outside moment after its terms in y^-2 and log y: the even power series plus a constant."""
    n = np.arange(2, 120)
    coefficients = elliptic_series()[2:]
    constant_at = np.array([_SPLIT])

    def series(points: np.ndarray) -> np.ndarray:
        return -np.pi / 2.0 * np.sum(coefficients * points[:, None] ** (2 * n - 2) / (2 * n - 2), axis=1)

    constant = (
        outside(constant_at) - np.pi / 4.0 / constant_at**2 + np.pi / 8.0 * np.log(constant_at) - series(constant_at)
    )
    return constant + series(y)

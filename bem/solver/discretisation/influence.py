"""Influence of a ring-shaped traction on the surface of an elastic half-space (overlapping triangles).

A traction that is linear between neighbouring nodes is a sum of hat functions: ring-shaped triangles that overlap
(Johnson, Contact Mechanics, 1985, section 5.9). This module integrates each hat exactly against the axisymmetric kernel
(paper, Eq. 'kernel')::

    G(r, s) = 4 / (pi max(r, s)) K(min / max),        u(r) = integral of G(r, s) sigma(s) s ds

with K the complete elliptic integral of the first kind (modulus, not parameter, as argument).

Units: radii in beta; `influence_matrix(radii) @ traction` is the displacement that the dimensionless gap equation
multiplies by mu. The kernel is homogeneous, G(c r, c s) = G(r, s) / c, so a scaled mesh has the scaled matrix,
`influence_matrix(c r) = c influence_matrix(r)`: one normalised mesh serves every scene.

The indefinite integrals over the ratio x = s / r are A_n(x) = (4/pi) * integral over (0, x) of t^(n+1) G(1, t) pi/4 dt.
A_0 is closed in K and E; A_1 needs the integral of K and is evaluated from Chebyshev series, split as
`smooth + smooth * log|1 - x|` around the logarithmic singularity at x = 1, accurate to rounding everywhere.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.polynomial import Chebyshev, chebyshev

_SPLIT = 0.7  # the logarithm is split off where x or 1/x lies between this and 1
_SERIES_DEGREE = 24
_NEAR = 14  # spacings from a logarithm within which a hat is integrated exactly
# Central differences of second, fourth, ... order in the integral over a hat, each with the rows left beside it.
_HAT_SERIES = ((3, 1.0 / 12.0), (2, -1.0 / 240.0), (1, 31.0 / 60480.0), (0, -289.0 / 3628800.0))
_ROWS_AT_ONCE = 64


def require_mesh(radii: np.ndarray) -> np.ndarray:
    """Return the radii as float64 if they are a mesh: at least 3 finite values from 0 strictly upwards.

    Raises:
        ValueError: if they are not.
    """
    mesh = np.ascontiguousarray(radii, dtype=np.float64)
    if mesh.ndim != 1 or mesh.size < 3 or not np.all(np.isfinite(mesh)):
        raise ValueError(f"mesh must be a 1D array of at least 3 finite radii (in beta); received shape {mesh.shape}")
    if mesh[0] != 0.0 or np.any(np.diff(mesh) <= 0.0):
        raise ValueError(f"mesh must start at 0 and increase strictly; received {mesh[:3]} ... {mesh[-1]}")
    return mesh


def elliptic_integrals(complement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Complete elliptic integrals K and E by the arithmetic-geometric mean.

    Written here because importing SciPy's special functions takes longer than a simulation; they agree to rounding.

    Args:
        complement: 1 - k^2 with k the modulus, of any shape, from 0 (where K is taken at 1e-300) to 1.

    Returns:
        K and E, same shape. Source: Abramowitz and Stegun, section 17.6.
    """
    mean = np.ones_like(complement)
    root = np.sqrt(np.maximum(complement, 1e-300))
    share, power = 0.5 * (1.0 - np.asarray(complement)), 0.5
    while np.any(mean - root > 1e-9 * mean):
        half_difference = 0.5 * (mean - root)
        mean, root = 0.5 * (mean + root), np.sqrt(mean * root)
        power *= 2.0
        share = share + power * half_difference**2
    first = np.pi / (mean + root)  # the two differ by rounding now, and their next mean by its square
    return first, first * (1.0 - share)


def unit_influence(size: int) -> np.ndarray:
    """Displacement at radii 0, 1, 2, ... under unit hats of traction there.

    The integral over a hat around s is f + f^(2)/12 + f^(4)/360 + ..., with f = s G(r, s) an odd function of s that is
    smooth away from s = r and s = -r. There the derivatives follow from f at whole radii by central differences, which
    leaves errors of 1e-10; close to these two points the hats are integrated exactly.

    Args:
        size: number of radii N.

    Returns:
        (N, N) float64: a row for each hat, a column for each observer (the transpose of `influence_matrix`). The last
        hat is whole, it ends at radius N.
    """
    matrix = np.empty((size, size))
    observers = np.arange(size, dtype=np.float64)
    for first in range(0, size, _ROWS_AT_ONCE):
        hats = np.arange(first, min(first + _ROWS_AT_ONCE, size), dtype=np.float64)
        radii = np.arange(hats[0] - 4.0, hats[-1] + 5.0)[:, None]
        larger = np.maximum(np.maximum(np.abs(radii), observers), 1.0)
        smaller = np.minimum(np.abs(radii), observers)
        complement = np.maximum((larger - smaller) * (larger + smaller) / larger**2, 1e-3)
        difference = 4.0 / np.pi * radii / larger * elliptic_integrals(complement)[0]
        rows = difference[4:-4].copy()
        for margin, factor in _HAT_SERIES:
            difference = difference[2:] - 2.0 * difference[1:-1] + difference[:-2]
            rows += factor * (difference[margin:-margin] if margin else difference)
        near = (np.abs(hats[:, None] - observers) < _NEAR) | (hats[:, None] + observers < _NEAR)
        near |= hats[:, None] == 0.0  # half a hat
        hat, observer = np.nonzero(near)
        rows[hat, observer] = _exact_hats(hats[hat], observers[observer])
        matrix[first : first + hats.size] = rows
    return matrix


def _exact_hats(hats: np.ndarray, observers: np.ndarray) -> np.ndarray:
    """Displacement at radii `observers` under unit hats of half-width 1 around radii `hats`, both (n,) and whole."""
    edges = np.stack([np.maximum(hats - 1.0, 0.0), hats, hats + 1.0])
    from_axis = observers == 0.0
    seen_from = np.where(from_axis, 1.0, observers)
    uniform, linear = ring_moments(edges / seen_from)
    # On the axis G(0, s) = 2 / s, so the discs are 2 s and s^2.
    disc = np.where(from_axis, 2.0 * edges, uniform * seen_from)
    cone = np.where(from_axis, edges**2, linear * seen_from**2)
    rising = (cone[1] - cone[0]) - edges[0] * (disc[1] - disc[0])
    falling = edges[2] * (disc[2] - disc[1]) - (cone[2] - cone[1])
    return rising + falling


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


def influence_matrix(radii: np.ndarray) -> np.ndarray:
    """Displacement at every node under a unit hat of traction at every node.

    Args:
        radii: (N,) strictly increasing, radii[0] = 0, in beta.

    Returns:
        (N, N) float64: `G @ traction` is the displacement u / mu of the gap equation. The last hat ends at the last
        node.

    Raises:
        ValueError: if the radii are not a mesh.
    """
    radii = require_mesh(radii)
    count = radii.size
    spacing = np.diff(radii)
    observer = radii[1:, None]
    uniform, linear = ring_moments(radii[None, :] / observer)
    # Integrals over (0, s_j) of the kernel against 1 and s. On the axis G(0, s) = 2 / s, so they are 2 s and s^2.
    disc = np.vstack([2.0 * radii, uniform * observer])
    cone = np.vstack([radii**2, linear * observer**2])
    ring, moment = np.diff(disc, axis=1), np.diff(cone, axis=1)
    matrix = np.zeros((count, count))
    matrix[:, 1:] += (moment - radii[:-1] * ring) / spacing  # rising flank of the hat at the panel's right end
    matrix[:, :-1] += (radii[1:] * ring - moment) / spacing  # falling flank of the hat at its left end
    return matrix


def force_weights(radii: np.ndarray) -> np.ndarray:
    """Weights of P = 2 * integral of sigma r dr for a traction linear between the nodes, exact.

    Args:
        radii: (N,) strictly increasing, in beta.

    Returns:
        (N,) float64: `weights @ traction` is the force in pi R dgamma.
    """
    left, right = radii[:-1], radii[1:]
    weights = np.zeros(radii.size)
    weights[:-1] += (right - left) * (2.0 * left + right) / 3.0
    weights[1:] += (right - left) * (left + 2.0 * right) / 3.0
    return weights


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


def _elliptic_series(count: int = 120) -> np.ndarray:
    """Coefficients c_n of K(t) = (pi/2) sum c_n t^(2n), c_n = ((2n-1)!! / (2n)!!)^2."""
    n = np.arange(1, count)
    return np.concatenate([[1.0], np.cumprod((2.0 * n - 1.0) / (2.0 * n))]) ** 2


def _moment_from_series(x: np.ndarray, power: int) -> np.ndarray:
    """Integral over (0, x) of K(t) t^power dt by its power series, for x <= _SPLIT."""
    exponent = 2 * np.arange(120) + power + 1
    return np.pi / 2.0 * np.sum(_elliptic_series() * x[:, None] ** exponent / exponent, axis=1)


def _outside_remainder(y: np.ndarray, outside: Callable) -> np.ndarray:
    """What is left of the outside moment after its terms in y^-2 and log y: the even power series plus a constant."""
    n = np.arange(2, 120)
    coefficients = _elliptic_series()[2:]
    constant_at = np.array([_SPLIT])

    def series(points: np.ndarray) -> np.ndarray:
        return -np.pi / 2.0 * np.sum(coefficients * points[:, None] ** (2 * n - 2) / (2 * n - 2), axis=1)

    constant = (
        outside(constant_at) - np.pi / 4.0 / constant_at**2 + np.pi / 8.0 * np.log(constant_at) - series(constant_at)
    )
    return constant + series(y)

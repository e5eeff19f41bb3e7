"""Influence of hats on any nodes, fast enough to be evaluated inside a simulation.

The displacement at radius r under a hat of traction is a divided difference of one function, the second integral of
the kernel (`bem.methods.boundary_elements.influence.triangles`) from r outwards:

    Psi(r, s) = integral over (r, s) of (s - t) t G(r, t) dt = r^2 psi(s / r).

Near x = s / r = 1 it is rho^2 (p(rho) + q(rho) log rho^2) (1 + x)^2 with rho = (x - 1) / (x + 1) and smooth p and q,
because 1 - k^2 of the kernel is a function of rho^2 (Landen's transformation). Far inside it is odd powers of x, far
outside powers of 1/x and a logarithm. The coefficients are fitted once, by least squares, to Gauss quadrature. They
also give the integrals of the kernel over loaded discs, A_n(x) = integral over (0, x) of t^(n+1) G(1, t) dt.
Units: radii in spacings of a lattice.
"""

import functools

import numpy as np

from bem._support.jit import kernel

_FAR = 4.0  # x or 1/x beyond which the kernel is a short power series
_NEAR_TERMS, _FAR_TERMS = 22, 9
_SAMPLES, _POINTS = 160, 64


def elliptic_integrals(complement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Complete elliptic integrals K and E by the arithmetic-geometric mean.

    Importing SciPy's special functions would take longer than a simulation; these agree with them to rounding.

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


def second_integral(x: np.ndarray) -> np.ndarray:
    """psi(x) for x > 0, shape (n,), by quadrature: exact to rounding, slow."""
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    z = 0.5 * (nodes + 1.0)
    # t = 1 + (x - 1) z^5 flattens the logarithm at t = 1
    distance = (x - 1.0)[:, None] * z**5
    t = 1.0 + distance
    larger = np.maximum(t, 1.0)
    complement = np.abs(distance) * (1.0 + t) / larger**2
    kernel_values = 4.0 / np.pi * t / larger * elliptic_integrals(complement)[0]
    return np.sum(0.5 * weights * 5.0 * z**4 * (1.0 - z**5) * kernel_values, axis=1) * (x - 1.0) ** 2


@functools.cache
def kernel_series() -> np.ndarray:
    """Coefficients of psi (4, _NEAR_TERMS), constant terms first, found once in a few milliseconds.

    The rows: p and q, by powers of rho; inside, by 1, x, x^3, x^5, ...; outside, by 1, x, x^-2, x^-4, ... beside
    x^2 - log(x) / 2.
    """
    limit = (_FAR - 1.0) / (_FAR + 1.0)
    spread = np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES) * limit
    rho = spread[np.abs(spread) > 1e-3 * limit]
    x = (1.0 + rho) / (1.0 - rho)
    powers = (rho / limit)[:, None] ** np.arange(_NEAR_TERMS)
    basis = np.hstack([powers, powers * np.log(rho**2)[:, None]])
    near = np.linalg.lstsq(basis, second_integral(x) / (rho * (1.0 + x)) ** 2, rcond=1e-15)[0]
    scale = limit ** -np.arange(_NEAR_TERMS, dtype=float)
    small = (np.arange(_SAMPLES) + 0.5) / _SAMPLES / _FAR
    inside_basis = small[:, None] ** np.concatenate([[0, 1], 3 + 2 * np.arange(_FAR_TERMS)])
    inside = _fitted(inside_basis, second_integral(small))
    outside_basis = small[:, None] ** np.concatenate([[0, -1], 2 + 2 * np.arange(_FAR_TERMS)])
    remainder = second_integral(1.0 / small) - small**-2.0 - 0.5 * np.log(small)
    # by relative errors, as the rest grows with the square of the radius
    outside = _fitted(small[:, None] ** 2 * outside_basis, small**2 * remainder)
    series = np.zeros((4, _NEAR_TERMS))
    series[0], series[1] = near[:_NEAR_TERMS] * scale, near[_NEAR_TERMS:] * scale
    series[2, : inside.size], series[3, : outside.size] = inside, outside
    return series


def _fitted(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    size = np.abs(basis).max(axis=0)
    return np.linalg.lstsq(basis / size, values, rcond=1e-15)[0] / size


@kernel
def _second_integral(radius: float, places: np.ndarray, series: np.ndarray, out: np.ndarray) -> None:
    """Psi(radius, s) for every s of `places` (N,) float64, into `out` (N,); on the axis up to terms linear in s."""
    smooth, log, inside, outside = series[0], series[1], series[2], series[3]
    for j in range(places.size):
        s = places[j]
        difference, total = s - radius, s + radius
        if radius == 0.0:
            value = s * s
        elif s > _FAR * radius:
            y = (radius / s) ** 2
            value = 0.0
            for k in range(_FAR_TERMS + 1, 1, -1):
                value = (value + outside[k]) * y
            value += outside[0] + 0.5 * np.log(radius / s)
            value = s * s + radius * (outside[1] * s + radius * value)
        elif s * _FAR < radius:
            x = s / radius
            value = 0.0
            for k in range(_FAR_TERMS + 1, 1, -1):
                value = value * x * x + inside[k]
            value = radius * radius * (inside[0] + x * (inside[1] + x * x * value))
        elif difference == 0.0:
            value = 0.0
        else:
            rho = difference / total
            p, q = smooth[_NEAR_TERMS - 1], log[_NEAR_TERMS - 1]
            for k in range(_NEAR_TERMS - 2, -1, -1):
                p, q = p * rho + smooth[k], q * rho + log[k]
            value = difference * difference * (p + q * np.log(rho * rho))
        out[j] = value


@kernel
def hat_influence(places: np.ndarray, series: np.ndarray) -> np.ndarray:
    """Displacement at every place under a unit hat of traction at every place.

    Args:
        places: (N,) int64 from 0 upwards, in spacings of the lattice.
        series: of `kernel_series`.

    Returns:
        (N, N) float64: a row for each hat, a column for each observer, as `unit_influence`. The last hat is whole, its
        outer flank is one lattice spacing wide.
    """
    size = places.size
    ends = np.empty(size + 1)
    for j in range(size):
        ends[j] = places[j]
    ends[size] = ends[size - 1] + 1.0
    matrix, psi = np.empty((size, size)), np.empty(size + 1)
    for i in range(size):
        _second_integral(float(places[i]), ends, series, psi)
        rise = places[i] * series[2, 1]  # slope of Psi in s on the axis, where the first hat is half a one
        for j in range(size):
            slope = (psi[j + 1] - psi[j]) / (ends[j + 1] - ends[j])
            matrix[j, i] = slope - rise
            rise = slope
    return matrix


def ring_moments(ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of the kernel over discs: uniform and linear traction of unit size inside `ratio`, seen from radius 1.

    Args:
        ratio: array of any shape, x = s / r >= 0, the outer radius of the loaded disc over the radius of observation.

    Returns:
        displacement at radius 1 under the tractions 1 and s on 0 < s < x, same shape.
    """
    x, series = np.asarray(ratio, dtype=np.float64), kernel_series()
    uniform, linear, small = np.empty_like(x), np.empty_like(x), x * _FAR < 1.0
    n = np.arange(1, 16)
    powers = np.append(1.0, np.cumprod((2.0 * n - 1.0) / (2.0 * n)) ** 2)  # of K, over pi/2
    inner, numbers = x[small], np.arange(powers.size)
    for out, order in ((uniform, 2), (linear, 3)):
        out[small] = 2.0 * inner**order * np.polynomial.polynomial.polyval(inner**2, powers / (2 * numbers + order))
    outer = np.ascontiguousarray(x[~small])
    larger, smaller, psi = np.maximum(outer, 1.0), np.minimum(outer, 1.0), np.empty_like(outer)
    complement = (larger - smaller) * (larger + smaller) / larger**2
    first, second = elliptic_integrals(complement)
    uniform[~small] = 4.0 / np.pi * np.where(outer > 1.0, outer * second, second - complement * first)
    _second_integral(1.0, outer, series, psi)
    # Psi = x (A_0(x) - A_0(1)) - (A_1(x) - A_1(1)), and A_1(1) is Psi on the axis
    linear[~small] = series[2, 0] + outer * (uniform[~small] - 4.0 / np.pi) - psi
    return uniform, linear

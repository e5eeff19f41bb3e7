"""Influence of a ring-shaped traction on the surface of an elastic half-space (overlapping triangles).

A traction that is linear between neighbouring nodes is a sum of hat functions: ring-shaped triangles that overlap
(Johnson, Contact Mechanics, 1985, section 5.9). This module integrates each hat exactly against the axisymmetric kernel
(paper, Eq. 'kernel')::

    G(r, s) = 4 / (pi max(r, s)) K(min / max),        u(r) = integral of G(r, s) sigma(s) s ds

with K the complete elliptic integral of the first kind (modulus, not parameter, as argument).

Units: radii in beta; `influence_matrix(radii) @ traction` is the displacement that the dimensionless gap equation
multiplies by mu. The kernel is homogeneous, G(c r, c s) = G(r, s) / c, so a scaled mesh has the scaled matrix,
`influence_matrix(c r) = c influence_matrix(r)`: one normalised mesh serves every scene.
"""

from __future__ import annotations

import numpy as np

from bem.methods.boundary_elements.influence.on_any_nodes import elliptic_integrals, ring_moments

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

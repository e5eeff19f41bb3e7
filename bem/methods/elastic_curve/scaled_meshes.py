"""Meshes that scale with the contact radius, whose influence serves every contact.

The half-space kernel is homogeneous: on nodes r = a x the influence is a times that on the nodes x. What a mesh must
resolve, the width of the edge over the radius, is rounded down to powers of 2/3, the levels, so that some twenty meshes
serve every Tabor parameter and radius. A node lies at the edge x = 1 always.

Between the nodes the traction is a cubic, outside the edge one of the traction times a power of the distance, as the
traction falls as such a power. Influence and weights follow from those of lines on the mesh and on one of half the
spacing by Richardson's extrapolation; they hold nearly to the fourth order.

Units: radii over the contact radius. Source of the extrapolation: K. Atkinson, An Introduction to Numerical Analysis,
1989, section 5.4.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.boundary_elements.influence.on_any_nodes import hat_influence, kernel_series
from bem.methods.boundary_elements.influence.triangles import force_weights
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width
from bem.problem.accuracy import BranchControls

_RATIO = 1.5  # of the widths of two levels
_SUBDIVISION = 16  # places of the lattice in the smallest spacing; even, as each spacing is halved
_AHEAD, _BEHIND = 1.0, 0.5  # extent of equal spacing outside and inside the edge, in widths
_MOST_SPACINGS = 2**27  # in a contact radius
_FALL = 5.0  # power of the distance with which the traction is smoothed

Ring = tuple[float, float]
NO_RING: Ring = math.inf, 0.0
"""Widest spacing and extent of a ring of fine nodes, over the radius of the smallest contact: here none."""


class ScaledMeshes(NamedTuple):
    """The meshes of the levels 0, 1, 2, ... (L, N), of which `size` nodes are in use; inside the edge by lattice."""

    radii: np.ndarray  # (L, N)
    size: np.ndarray  # (L,) int64
    edge_node: np.ndarray  # (L,) int64, the node at 1
    weights: np.ndarray  # (L, N): of the force, over the square of the contact radius
    influence: np.ndarray  # (L, N, N): a row for each node's traction, a column for each observer


def scaled_meshes(controls: BranchControls, levels: int, reach: float, ring: Ring = NO_RING) -> ScaledMeshes:
    """The meshes of at least so many levels, each to the radius `reach` or beyond.

    `ring` is that of the controls over the radius of the smallest contact, where a law needs it.

    Raises:
        MemoryError: where rounding of the influence would be felt, with the number of equal spacings it would take.
    """
    spacings = round(_RATIO**levels / controls.edge_spacing)
    if spacings > _MOST_SPACINGS:
        raise MemoryError(f"the contact edge needs {spacings} grid nodes, more than {_MOST_SPACINGS}")
    grading = controls.edge_spacing, controls.growth, controls.widest
    beyond = 4.0 ** math.ceil(math.log(reach, 4.0))
    return _together(*grading, beyond, ring, 4 * math.ceil(levels / 4))


@functools.lru_cache(maxsize=16)
def _together(spacing: float, growth: float, widest: float, reach: float, ring: Ring, levels: int) -> ScaledMeshes:
    meshes = [_mesh(spacing, growth, widest, reach, ring, level) for level in range(levels)]
    shape = levels, max(radii.size for radii, _, _ in meshes)
    table = ScaledMeshes(
        np.zeros(shape), np.zeros(levels, int), np.zeros(levels, int), np.zeros(shape), np.zeros((*shape, shape[1]))
    )
    for level, (radii, weights, influence) in enumerate(meshes):
        n = radii.size
        table.size[level], table.edge_node[level] = n, np.searchsorted(radii, 1.0)
        table.radii[level, :n], table.weights[level, :n], table.influence[level, :n, :n] = radii, weights, influence
    return table


@functools.lru_cache(maxsize=64)
def _mesh(
    spacing: float, growth: float, widest: float, reach: float, ring: Ring, level: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radii, force weights and influence of one level."""
    width = _RATIO**-level
    edge = 2 * round(0.5 * _SUBDIVISION / (spacing * width))  # its place on the lattice
    narrow, extent = max(ring[0] * width * edge, _SUBDIVISION), (ring[1] * width - 1.0) * edge
    outside = edge + _offsets(_AHEAD * width * edge, growth, narrow, (reach - 1.0) * edge, max(extent, 0.0))
    within = min(widest * edge, narrow) if level == 0 else widest * edge
    inside = edge - _offsets(_BEHIND * width * edge, growth, within, edge)[:-1]
    # The innermost spacing, between the axis and the first node, is no shorter than half of the next.
    inside = inside[inside > (0.5 * (inside[-2] - inside[-1]) if inside.size > 1 else 0)]
    places = np.unique(np.concatenate([[0], inside, outside]))
    halved = np.empty(2 * places.size - 1, dtype=np.int64)
    halved[::2], halved[1::2] = places, (places[1:] + places[:-1]) // 2
    radii, fine = places / edge, halved / edge
    shares = _cubic_shares(radii) * _rise(radii, width) / _rise(fine, width)[:, None]
    series = kernel_series()
    by_lines, by_halves = hat_influence(places, series) / edge, hat_influence(halved, series)[:, ::2] / edge
    influence = (4.0 * shares.T @ by_halves - by_lines) / 3.0
    weights = (4.0 * shares.T @ force_weights(fine) - force_weights(radii)) / 3.0
    return radii, weights, influence


def _offsets(equal: float, growth: float, widest: float, reach: float, until: float = math.inf) -> np.ndarray:
    """Distances of nodes from the edge up to `reach`, even; equally spaced up to `equal`, then ever wider.

    The spacings are at most `widest` up to the distance `until`, and grow on from there.
    """
    offsets = [0]
    while offsets[-1] < reach:
        wide = _SUBDIVISION + max(offsets[-1] - equal, 0.0) * (growth - 1.0)
        narrow = widest + max(offsets[-1] - until, 0.0) * (growth - 1.0)
        offsets.append(offsets[-1] + 2 * round(0.5 * min(wide, narrow)))
    return np.array(offsets)


def _rise(radii: np.ndarray, width: float) -> np.ndarray:
    """What is multiplied with the traction before it is interpolated; smooth at the edge."""
    return 1.0 + (np.maximum(radii - 1.0, 0.0) / width) ** _FALL


def _cubic_shares(radii: np.ndarray) -> np.ndarray:
    """(2 n - 1, n): values at the nodes and half-way between them, by cubics that are even at the axis."""
    n = radii.size
    shares, mirrored = np.zeros((2 * n - 1, n)), np.concatenate([[-radii[1]], radii])
    shares[::2] = np.eye(n)
    nodes = np.minimum(np.arange(n - 1), n - 3)[:, None] + np.arange(4)  # of `mirrored`
    at, middle = mirrored[nodes], 0.5 * (radii[1:] + radii[:-1])
    for a in range(4):
        weight = np.ones(n - 1)
        for b in range(4):
            if a != b:
                weight *= (middle - at[:, b]) / (at[:, a] - at[:, b])
        np.add.at(shares, (2 * np.arange(n - 1) + 1, np.abs(nodes[:, a] - 1)), weight)
    return shares


@kernel
def smallest_scale(tabor: float, exponent: float) -> float:
    """Contact radius that is as large as the width of its edge; smaller contacts share its mesh."""
    radius = edge_width(0.0, tabor, exponent)
    for _ in range(60):
        radius = 0.5 * (radius + edge_width(radius, tabor, exponent))
    return radius


@kernel
def level_of(radius: float, tabor: float, exponent: float) -> int:
    """Level of the mesh that resolves the edge of a contact of this radius."""
    width = edge_width(radius, tabor, exponent)
    return int(max(np.ceil(np.log(radius / width) / np.log(_RATIO) - 1e-9), 0.0))


@kernel
def nodes_within(meshes: ScaledMeshes, level: int, radius: float) -> int:
    """Nodes up to the first beyond `radius`, at least four."""
    n = 4
    while n < meshes.size[level] and meshes.radii[level, n - 1] < radius:
        n += 1
    return n


@kernel
def weight_of_last(radii: np.ndarray, n: int) -> float:
    """Force weight of the node n - 1 where the traction ends there."""
    inner, outer = radii[n - 2], radii[n - 1]
    return (outer - inner) * (inner + 2.0 * outer) / 3.0

"""The mesh: a selection of nodes of the master grid that follows the contact edge.

The cohesive zone at the contact edge must be resolved, and the edge travels. A mesh that is fine wherever it may go has
several hundred nodes; one that is fine where it is has less than a hundred, but must follow. Both are used here: memory
is on the master grid (`bem.methods.boundary_elements.meshes.master_grid`), the unknowns on a selection of its nodes.
The traction at the master nodes is interpolated from the selected ones
(`bem.methods.boundary_elements.meshes.smooth_traction`), so the influence matrix of any selection is condensed from
rows of one matrix, without an elliptic integral, and a new selection loses no memory. Nodes are dense around the edge,
where the traction is curved, and where the memory is; spacing grows geometrically between.

Units: radii in beta. A user's own radii (`uniform_mesh`, the paper's equal spacing, or any other) make a mesh that
stays.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import copy_into
from bem._support.wording import shown
from bem.methods.boundary_elements.influence.triangles import force_weights, influence_matrix
from bem.methods.boundary_elements.meshes.master_grid import AHEAD, BEHIND, Grid
from bem.methods.boundary_elements.meshes.smooth_traction import interpolation, ring_area
from bem.problem.accuracy import Controls

_TRAVEL = 0.5  # how far the edge may move before nodes are chosen anew, in widths
_TOLERATED = 2.0  # a mesh in use may be this much coarser than a new one would be
_LEAD = 1.8  # more room in the direction of motion


class Mesh(NamedTuple):
    """The nodes in use: n of them, chosen from a master grid of N."""

    nodes: np.ndarray  # (n,) int64, indices in the master grid
    radii: np.ndarray  # (n,)
    influence: np.ndarray  # (n, n): tabor * displacement at every node, a row for a unit traction at each
    master_rows: np.ndarray  # (N, n): the same for nodes of the master grid; (0, n) where nothing is remembered
    force_weights: np.ndarray  # (n,): P = force_weights @ traction
    first: np.ndarray  # (N,) int64: the traction at each master node is interpolated from the nodes first, ...
    shares: np.ndarray  # (N, 4): ... first + 1, first + 2 and first + 3 with these weights
    window: np.ndarray  # (2,): the edge may travel between these radii
    grid: Grid  # from which the nodes are chosen


def uniform_mesh(radius: float, count: int) -> np.ndarray:
    """The paper's mesh: `count` equally spaced radii from 0 to `radius` (in beta)."""
    if not (math.isfinite(radius) and radius > 0.0) or count < 3:
        raise ValueError(
            f"uniform_mesh needs a radius > 0 and a count of at least 3; received {shown(radius)} and {shown(count)}"
        )
    return np.linspace(0.0, radius, count)


def fixed_mesh(tabor: float, radii: np.ndarray, remembers: bool) -> Mesh:
    """A mesh of all of these radii (n,), in use from beginning to end; empty where there are none."""
    influence = tabor * np.ascontiguousarray(influence_matrix(radii).T) if radii.size else np.empty((0, 0))
    nodes, shares = np.arange(radii.size), np.zeros((radii.size, 4))
    shares[:, 0] = 1.0
    rows = influence if remembers else np.empty((0, radii.size))
    window = np.array([-1.0, math.inf])
    grid = Grid(radii.size, 0.0, nodes, np.empty((0, 0)), False, -math.inf, math.inf)
    return Mesh(nodes, radii, influence, rows, force_weights(radii), nodes, shares, window, grid)


@functools.cache
def no_mesh() -> Mesh:
    """A `fixed_mesh` without nodes."""
    return fixed_mesh(1.0, np.empty(0), False)


@kernel
def edge_window(edge: float, direction: float, width: float) -> np.ndarray:
    """Radii (2,) between which the edge may travel; there is more room in its `direction`, outwards if positive."""
    margin = _TRAVEL * width
    window = np.array(
        [edge - margin * (_LEAD if direction < 0.0 else 1.0), edge + margin * (_LEAD if direction > 0.0 else 1.0)]
    )
    if edge < width:
        window[0] = -1.0
    return window


@kernel
def spacing_at_edge(grid: Grid, controls: Controls, edge: float, width: float, window: np.ndarray) -> np.ndarray:
    """Spacing (N,) wanted at each master node for an edge that travels in `window`, in master spacings, at least 1.

    Args:
        grid: the master grid.
        controls: spacing at the edge and widest spacing elsewhere.
        edge: contact edge; 0 where there is no contact.
        width: of the cohesive zone there.
        window: (2,) as of `edge_window`.
    """
    size, spacing, places = grid.size, grid.spacing, grid.places
    spacings = np.empty(size)
    for f in range(size):
        inside = places[f] * spacing <= edge
        spacings[f] = max(controls.widest * edge / spacing if inside else 2.0 * controls.widest * places[f], 1.0)
    inner, outer = edge - width * BEHIND, edge + width * AHEAD
    if edge < width:
        inner = 0.0
    inner, outer = min(inner, window[0] - width * BEHIND), max(outer, window[1] + width * AHEAD)
    edge_spacing = max(controls.edge_spacing * width / spacing, 1.0)
    first, last = max(0, int(inner / spacing)), int(outer / spacing) + 1
    for f in range(size):
        if first <= places[f] <= last:
            spacings[f] = min(spacings[f], edge_spacing)
    return spacings


@kernel
def refine_for_memory(
    spacings: np.ndarray, places: np.ndarray, remembered: np.ndarray, last: int, allowed: float, response: float
) -> None:
    """Reduce the `spacings` (N,) up to the place `last` to where the `remembered` traction (N,) is nearly linear.

    Args:
        spacings: spacing in lattice spacings, overwritten.
        places: (N,) of the nodes, in lattice spacings.
        remembered: (N,), or (0,) where nothing is remembered.
        last: place beyond which the gap is wide.
        allowed: second difference of the traction allowed in one spacing.
        response: factor of the new traction, which must balance features of the remembered one.
    """
    sharpest = max(response, 0.05)
    for f in range(1, min(spacings.size, remembered.size) - 1):
        if places[f] > last:
            break
        inner, outer = places[f] - places[f - 1], places[f + 1] - places[f]
        rise = (remembered[f + 1] - remembered[f]) / outer - (remembered[f] - remembered[f - 1]) / inner
        bend = 2.0 * abs(rise) / (inner + outer) / sharpest
        if bend > 0.0:
            spacings[f] = min(spacings[f], max(math.sqrt(allowed / bend), 1.0))


@kernel
def refine_for_traction(
    spacings: np.ndarray, places: np.ndarray, points: np.ndarray, traction: np.ndarray, tabor: float, allowed: float
) -> None:
    """Reduce the `spacings` (N,) at `places` (N,) to where the last `traction` (n,) is nearly linear.

    Args:
        spacings: spacing in lattice spacings, overwritten.
        places: (N,) of the nodes.
        points: (n,) places of the traction.
        traction: (n,) there.
        tabor: Tabor parameter.
        allowed: second difference in one spacing allowed, as a fraction of the traction's scale.
    """
    first = 0
    for j in range(1, points.size - 1):
        a, b, c = points[j - 1], points[j], points[j + 1]
        rising, falling = (traction[j] - traction[j - 1]) / (b - a), (traction[j + 1] - traction[j]) / (c - b)
        bend = 2.0 * abs(falling - rising) / (c - a)
        if bend > 0.0:
            step = max(math.sqrt(allowed * (tabor + 0.05 * abs(traction[j])) / bend), 1.0)
            while places[first] < (a + b) // 2:
                first += 1
            f = first
            while f < places.size and places[f] <= (b + c) // 2:
                spacings[f] = min(spacings[f], step)
                f += 1


@kernel
def pick_nodes(spacings: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The fewest master nodes, from first to last, whose spacing is nowhere above the `spacings`; (n,) int64."""
    last = spacings.size - 1
    nodes = np.empty(last + 1, dtype=np.int64)
    count, f = 0, 0
    while f < last:
        nodes[count] = f
        count += 1
        g = f + 1
        while g < last and places[g + 1] - places[f] <= spacings[f]:
            g += 1
        while g > f + 1 and spacings[g] < places[g] - places[f]:
            g -= 1
        f = g
    nodes[count] = last
    return nodes[: count + 1].copy()


@kernel
def resolves(nodes: np.ndarray, places: np.ndarray, spacings: np.ndarray) -> bool:
    """Whether a selection in use is nowhere much coarser than the `spacings`."""
    for j in range(nodes.size - 1):
        if nodes[j + 1] - nodes[j] == 1:
            continue
        panel = places[nodes[j + 1]] - places[nodes[j]]
        for f in range(nodes[j], nodes[j + 1] + 1):
            if panel > _TOLERATED * spacings[f]:
                return False
    return True


@kernel
def condense(grid: Grid, tabor: float, nodes: np.ndarray, window: np.ndarray, remembers: bool) -> Mesh:
    """Influence matrix of a selection of master nodes, from the rows of all of them.

    Args:
        grid: the master grid.
        tabor: Tabor parameter.
        nodes: (n,) the selection, from the axis outwards.
        window: (2,) as of `edge_window`.
        remembers: whether there is a memory, which needs the influence of the master grid too.
    """
    n = nodes.size
    first, shares = interpolation(nodes, grid.places, grid.smooth)
    last = nodes[n - 1]
    influence, weights = np.zeros((n, n)), np.zeros(n)
    rows = np.empty((grid.size if remembers else 0, n))
    scale, scaled = tabor * grid.spacing, np.empty(n)
    for f in range(grid.size if remembers else last + 1):
        unit = grid.unit_influence[f]
        for i in range(n):
            scaled[i] = scale * unit[nodes[i]]
        if remembers:
            copy_into(rows[f], scaled)
        if f <= last:
            ring = ring_area(grid.places, f, last, grid.smooth)
            for k in range(4):
                share = shares[f, k]
                if share != 0.0:
                    column = influence[first[f] + k]
                    for i in range(n):
                        column[i] += share * scaled[i]
                    weights[first[f] + k] += share * ring * grid.spacing * grid.spacing
    radii = grid.spacing * grid.places[nodes]
    return Mesh(nodes, radii, influence, rows, weights, first, shares, window, grid)


@kernel
def prolong(mesh: Mesh, traction: np.ndarray, out: np.ndarray) -> None:
    """The traction (n,), interpolated at the nodes of the master grid, into `out` (N,); zero beyond the mesh."""
    last = mesh.nodes[mesh.nodes.size - 1]
    for f in range(out.size):
        total = 0.0
        if f <= last:
            for k in range(4):
                share = mesh.shares[f, k]
                if share != 0.0:
                    total += share * traction[mesh.first[f] + k]
        out[f] = total

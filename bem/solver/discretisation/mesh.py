"""The mesh: a fine uniform master grid, and a selection of its nodes that follows the contact edge.

The cohesive zone at the contact edge must be resolved, and the edge travels. A mesh that is fine wherever it may go has
several hundred nodes; one that is fine where it is has less than a hundred, but must follow. Both are used here: memory
is on the fine master grid, the unknowns on a selection of its nodes. The traction at the master nodes is interpolated
from the selected ones (`bem.solver.discretisation.smooth_traction`), so the influence matrix of any selection is
condensed from rows of one normalised matrix (the kernel is homogeneous, see `bem.solver.discretisation.influence`),
without an elliptic integral, and a new selection loses no memory. Nodes are dense around the edge, where the traction
is curved, and where the memory is; spacing grows geometrically between.

Units: radii in beta. A user's own radii (`uniform_mesh`, the paper's equal spacing, or any other) make a mesh that
stays.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import in_python, kernel
from bem._support.linear_algebra import copy_into
from bem._support.wording import shown
from bem.accuracy import Controls
from bem.solver.discretisation.cohesive_zone import edge_width, largest_contact_radius
from bem.solver.discretisation.influence import force_weights, influence_matrix, unit_influence
from bem.solver.discretisation.smooth_traction import interpolation, ring_area, smooth_influence

LARGEST_GRID = 4096  # 134 MB of influence matrix
_BEHIND, _AHEAD = 0.5, 1.0  # extent of the cohesive zone inside and outside the edge, in widths
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


class Grid(NamedTuple):
    """The master grid: equally spaced radii `spacing * arange(size)`, and the influence of each at unit spacing."""

    size: int
    spacing: float
    unit_influence: np.ndarray


def master_grid(tabor: float, peak_indentation: float, nonadhesive: bool, controls: Controls) -> Grid:
    """Grid that resolves the contact edge wherever an indentation up to the peak can bring it.

    Raises:
        MemoryError: with the number of nodes it would take, when that exceeds `LARGEST_GRID`.
    """
    radius = largest_contact_radius(peak_indentation, tabor, nonadhesive)
    spacing = controls.edge_spacing * in_python(edge_width)(radius, tabor, nonadhesive)
    reach = 1.15 * radius if nonadhesive else math.sqrt(radius**2 + 2.0 * controls.far_gap / tabor)
    size = math.ceil(reach / spacing) + 2
    if size > LARGEST_GRID:
        raise MemoryError(f"the contact edge needs {size} grid nodes, more than {LARGEST_GRID}")
    return Grid(size, spacing, _MATRICES[not nonadhesive].of_size(256 * math.ceil(size / 256)))


class _LargestMatrix:
    """Unit influence of any size: the largest matrix requested so far is kept, and smaller ones are its blocks."""

    def __init__(self, smooth: bool) -> None:
        self._smooth = smooth
        self._matrix = np.empty((0, 0))

    def of_size(self, size: int) -> np.ndarray:
        """Influence of radii 0, 1, 2, ..., a row for each node; of at least this many."""
        matrix = self._matrix
        if len(matrix) < size:
            matrix = unit_influence(size)
            self._matrix = matrix = smooth_influence(matrix) if self._smooth else matrix
        return matrix


_MATRICES = _LargestMatrix(smooth=False), _LargestMatrix(smooth=True)


def uniform_mesh(radius: float, count: int) -> np.ndarray:
    """The paper's mesh: `count` equally spaced radii from 0 to `radius` (in beta)."""
    if not (math.isfinite(radius) and radius > 0.0) or count < 3:
        raise ValueError(
            f"uniform_mesh needs a radius > 0 and a count of at least 3; received {shown(radius)} and {shown(count)}"
        )
    return np.linspace(0.0, radius, count)


def fixed_mesh(tabor: float, radii: np.ndarray, remembers: bool) -> Mesh:
    """A mesh of all of these radii, in use from beginning to end; empty where there are none."""
    nodes = np.arange(radii.size)
    shares = np.zeros((radii.size, 4))
    shares[:, 0] = 1.0
    influence = tabor * np.ascontiguousarray(influence_matrix(radii).T) if radii.size else np.empty((0, 0))
    rows = influence if remembers else np.empty((0, radii.size))
    weights = force_weights(radii) if radii.size else np.empty(0)
    window = np.array([-1.0, math.inf])
    return Mesh(nodes, radii, influence, rows, weights, nodes, shares, window)


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
    last, spacing = grid.size - 1, grid.spacing
    wanted = np.empty(last + 1)
    for f in range(last + 1):
        inside = f * spacing <= edge
        wanted[f] = max(controls.widest * edge / spacing if inside else 2.0 * controls.widest * f, 1.0)
    inner, outer = edge - width * _BEHIND, edge + width * _AHEAD
    if edge < width:
        inner = 0.0
    inner, outer = min(inner, window[0] - width * _BEHIND), max(outer, window[1] + width * _AHEAD)
    edge_spacing = max(controls.edge_spacing * width / spacing, 1.0)
    for f in range(max(0, int(inner / spacing)), min(last, int(outer / spacing) + 1) + 1):
        wanted[f] = min(wanted[f], edge_spacing)
    return wanted


@kernel
def refine_for_memory(wanted: np.ndarray, remembered: np.ndarray, last: int, allowed: float, response: float) -> None:
    """Reduce the spacing `wanted` (N,) up to node `last` to where the `remembered` traction (N,) is nearly linear.

    Args:
        wanted: spacing in master spacings, overwritten.
        remembered: (N,), or (0,) where nothing is remembered.
        last: node beyond which the gap is wide.
        allowed: second difference of the traction allowed in one spacing.
        response: factor of the new traction, which must balance features of the remembered one.
    """
    sharpest = max(response, 0.05)
    for f in range(1, min(last + 1, min(wanted.size, remembered.size) - 1)):
        bend = abs(remembered[f + 1] - 2.0 * remembered[f] + remembered[f - 1]) / sharpest
        if bend > 0.0:
            wanted[f] = min(wanted[f], max(math.sqrt(allowed / bend), 1.0))


@kernel
def refine_for_traction(
    wanted: np.ndarray, nodes: np.ndarray, traction: np.ndarray, tabor: float, allowed: float
) -> None:
    """Reduce the spacing `wanted` (N,) to where the last `traction` (n,) at `nodes` (n,) is nearly linear.

    `allowed` is the second difference in one spacing as a fraction of the traction's scale.
    """
    for j in range(1, nodes.size - 1):
        a, b, c = nodes[j - 1], nodes[j], nodes[j + 1]
        rising, falling = (traction[j] - traction[j - 1]) / (b - a), (traction[j + 1] - traction[j]) / (c - b)
        bend = 2.0 * abs(falling - rising) / (c - a)
        if bend > 0.0:
            step = max(math.sqrt(allowed * (tabor + 0.05 * abs(traction[j])) / bend), 1.0)
            for f in range((a + b) // 2, min((b + c) // 2, wanted.size - 1) + 1):
                wanted[f] = min(wanted[f], step)


@kernel
def grade(wanted: np.ndarray, growth: float) -> None:
    """Reduce the spacing `wanted` (N,) until neighbouring panels differ by no more than the ratio `growth`."""
    slope = growth - 1.0
    for f in range(1, wanted.size):
        wanted[f] = min(wanted[f], wanted[f - 1] + slope)
    for f in range(wanted.size - 2, -1, -1):
        wanted[f] = min(wanted[f], wanted[f + 1] + slope)


@kernel
def pick_nodes(wanted: np.ndarray) -> np.ndarray:
    """The fewest master nodes, from first to last, whose spacing is nowhere above the `wanted` one; (n,) int64."""
    last = wanted.size - 1
    nodes = np.empty(last + 1, dtype=np.int64)
    count, f = 0, 0
    while f < last:
        nodes[count] = f
        count += 1
        step = max(1, int(wanted[f]))
        while step > 1 and (f + step > last or wanted[f + step] < step):
            step -= 1
        f += step
    nodes[count] = last
    return nodes[: count + 1].copy()


@kernel
def resolves(nodes: np.ndarray, wanted: np.ndarray) -> bool:
    """Whether a selection in use is nowhere much coarser than `wanted`."""
    for j in range(nodes.size - 1):
        panel = nodes[j + 1] - nodes[j]
        if panel == 1:
            continue
        for f in range(nodes[j], nodes[j + 1] + 1):
            if panel > _TOLERATED * wanted[f]:
                return False
    return True


@kernel
def condense(
    grid: Grid, tabor: float, nodes: np.ndarray, window: np.ndarray, remembers: bool, smooth: bool = False
) -> Mesh:
    """Influence matrix of a selection of master nodes, from the rows of all of them.

    Args:
        grid: the master grid.
        tabor: Tabor parameter.
        nodes: (n,) the selection, from the axis outwards.
        window: (2,) as of `edge_window`.
        remembers: whether there is a memory, which needs the influence of the master grid too.
        smooth: whether the traction between the nodes is a cubic, else a line.
    """
    n = nodes.size
    first, shares = interpolation(nodes, grid.size, smooth)
    last = nodes[n - 1]
    influence, weights = np.zeros((n, n)), np.zeros(n)
    rows = np.empty((grid.size if remembers else 0, n))
    scale, scaled = tabor * grid.spacing, np.empty(n)
    for f in range(grid.size if remembers else last + 1):
        hat = grid.unit_influence[f]
        for i in range(n):
            scaled[i] = scale * hat[nodes[i]]
        if remembers:
            copy_into(rows[f], scaled)
        if f <= last:
            ring = ring_area(f, last, smooth)
            for k in range(4):
                share = shares[f, k]
                if share != 0.0:
                    column = influence[first[f] + k]
                    for i in range(n):
                        column[i] += share * scaled[i]
                    weights[first[f] + k] += share * ring * grid.spacing * grid.spacing
    return Mesh(nodes, grid.spacing * nodes, influence, rows, weights, first, shares, window)


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

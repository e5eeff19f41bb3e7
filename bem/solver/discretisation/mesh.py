"""Where the nodes are: a fine uniform master grid, and the few of its nodes that a moment of the history needs.

The cohesive zone at the contact edge must be resolved, and the edge travels. A mesh that is fine wherever it may go has
several hundred nodes; one that is fine where it is has less than a hundred, but must follow. Both are had here: memory
lives on the fine master grid, the unknowns on a selection of its nodes. A hat of the selection is a sum of hats of the
master grid, so the influence matrix of any selection is condensed from rows of one normalised matrix (the kernel is
homogeneous, see `bem.solver.discretisation.influence`), without an elliptic integral, and a new selection loses no
memory. Nodes are dense around the edge, where the traction is curved, and where the memory is; spacing grows
geometrically between.

Units: radii in beta. A user's own radii (`uniform_mesh`, the paper's equal spacing, or any other) make a mesh that
stays.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import in_python, kernel
from bem._support.wording import shown
from bem.accuracy import Controls
from bem.solver.discretisation.cohesive_zone import edge_width, largest_contact_radius
from bem.solver.discretisation.influence import force_weights, influence_matrix, unit_influence

LARGEST_GRID = 4096  # 134 MB of influence matrix
_BEHIND, _AHEAD = 0.5, 1.0  # extent of the cohesive zone inside and outside the edge, in widths
_TRAVEL = 0.5  # how far the edge may move before nodes are chosen anew, in widths
_TOLERATED = 2.0  # a mesh in use may be this much coarser than a new one would be
_LEAD = 1.8  # more room in the direction of motion


class Mesh(NamedTuple):
    """The nodes in use: n of them, chosen from a master grid of N."""

    nodes: np.ndarray  # (n,) int64, indices in the master grid
    radii: np.ndarray  # (n,)
    influence: np.ndarray  # (n, n): tabor * displacement at every node, a row for the unit hat of traction at each
    master_rows: np.ndarray  # (N, n): the same for hats of the master grid; (0, n) where nothing is remembered
    force_weights: np.ndarray  # (n,): P = force_weights @ traction
    panel: np.ndarray  # (N,) int64: each master node lies between nodes panel and panel + 1 ...
    fraction: np.ndarray  # (N,): ... this far
    window: np.ndarray  # (2,): the edge may travel between these radii


class Grid(NamedTuple):
    """The master grid: equally spaced radii `spacing * arange(size)` and the influence at unit spacing, by hats."""

    size: int
    spacing: float
    unit_influence: np.ndarray


def master_grid(tabor: float, peak_indentation: float, hard: bool, controls: Controls) -> Grid:
    """Grid that resolves the contact edge wherever an indentation up to the peak can bring it.

    Raises:
        MemoryError: with the number of nodes it would take, when that exceeds `LARGEST_GRID`.
    """
    radius = largest_contact_radius(peak_indentation, tabor, hard)
    spacing = controls.edge_spacing * in_python(edge_width)(radius, tabor, hard)
    reach = 1.15 * radius if hard else math.sqrt(radius**2 + 2.0 * controls.far_gap / tabor)
    size = math.ceil(reach / spacing) + 2
    if size > LARGEST_GRID:
        raise MemoryError(f"the contact edge needs {size} grid nodes, more than {LARGEST_GRID}")
    return Grid(size, spacing, _unit_influence(256 * math.ceil(size / 256)))


def _unit_influence(size: int) -> np.ndarray:
    """Influence of radii 0, 1, 2, ..., a row for each hat; one matrix is kept, the largest asked for so far."""
    matrix = _largest[0]
    if len(matrix) < size:
        matrix = _largest[0] = unit_influence(size)
    return matrix


_largest = [np.empty((0, 0))]


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
    panel = np.minimum(nodes, max(radii.size - 2, 0))
    influence = tabor * np.ascontiguousarray(influence_matrix(radii).T) if radii.size else np.empty((0, 0))
    rows = influence if remembers else np.empty((0, radii.size))
    weights = force_weights(radii) if radii.size else np.empty(0)
    window = np.array([-1.0, math.inf])
    return Mesh(nodes, radii, influence, rows, weights, panel, (nodes - panel).astype(float), window)


@kernel
def wanted_spacing(
    grid: Grid,
    tabor: float,
    hard: bool,
    edge: float,
    direction: float,
    old_nodes: np.ndarray,
    old_traction: np.ndarray,
    remembered: np.ndarray,
    response: float,
    active_radius: float,
    controls: Controls,
) -> tuple[np.ndarray, np.ndarray]:
    """Spacing wanted at each master node for an edge moving outwards (`direction` > 0) or inwards.

    Args:
        grid: the master grid.
        tabor, hard: Tabor parameter, and whether there is no adhesion.
        edge: contact edge; 0 where there is no contact.
        old_nodes, old_traction: (n,) last solution, whose curvature is resolved.
        remembered: (N,) or (0,) the remembered traction, resolved up to `active_radius`, beyond which the gap is wide.
        response: factor of the new traction, which must balance features of the remembered one.

    Returns:
        spacing (N,) in master spacings, at least 1, and window (2,).
    """
    width = edge_width(edge, tabor, hard)
    last, spacing = grid.size - 1, grid.spacing
    wanted = np.empty(last + 1)  # spacing wanted at each master node, in master spacings
    for f in range(last + 1):
        inside = f * spacing <= edge
        wanted[f] = max(controls.widest * edge / spacing if inside else 2.0 * controls.widest * f, 1.0)
    inner, outer = edge - width * _BEHIND, edge + width * _AHEAD
    margin = _TRAVEL * width
    window = np.array(
        [edge - margin * (_LEAD if direction < 0.0 else 1.0), edge + margin * (_LEAD if direction > 0.0 else 1.0)]
    )
    if edge < width:
        inner = 0.0
        window[0] = -1.0
    inner, outer = min(inner, window[0] - width * _BEHIND), max(outer, window[1] + width * _AHEAD)
    edge_spacing = max(controls.edge_spacing * width / spacing, 1.0)
    for f in range(max(0, int(inner / spacing)), min(last, int(outer / spacing) + 1) + 1):
        wanted[f] = min(wanted[f], edge_spacing)

    allowed = 8.0 * controls.curvature
    sharpest = max(response, 0.05)
    for f in range(1, min(last, remembered.size - 1)):
        if f * spacing > active_radius:
            break
        bend = abs(remembered[f + 1] - 2.0 * remembered[f] + remembered[f - 1]) / sharpest
        if bend > 0.0:
            wanted[f] = min(wanted[f], max(math.sqrt(allowed * tabor / bend), 1.0))
    for j in range(1, old_nodes.size - 1):
        a, b, c = old_nodes[j - 1], old_nodes[j], old_nodes[j + 1]
        rising, falling = (
            (old_traction[j] - old_traction[j - 1]) / (b - a),
            (old_traction[j + 1] - old_traction[j]) / (c - b),
        )
        bend = 2.0 * abs(falling - rising) / (c - a)
        if bend > 0.0:
            step = max(math.sqrt(allowed * (tabor + 0.05 * abs(old_traction[j])) / bend), 1.0)
            for f in range((a + b) // 2, min((b + c) // 2, last) + 1):
                wanted[f] = min(wanted[f], step)

    # neighbouring spacings differ by no more than the growth ratio
    slope = controls.growth - 1.0
    for f in range(1, last + 1):
        wanted[f] = min(wanted[f], wanted[f - 1] + slope)
    for f in range(last - 1, -1, -1):
        wanted[f] = min(wanted[f], wanted[f + 1] + slope)
    return wanted, window


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
def condense(grid: Grid, tabor: float, nodes: np.ndarray, window: np.ndarray, remembers: bool) -> Mesh:
    """Influence matrix of a selection of master nodes: its hats are sums of hats of the master grid."""
    n = nodes.size
    panel, fraction = np.empty(grid.size, dtype=np.int64), np.empty(grid.size)
    j = 0
    last = nodes[n - 1]
    for f in range(grid.size):
        while j < n - 2 and nodes[j + 1] <= f:
            j += 1
        panel[f] = j
        fraction[f] = (f - nodes[j]) / (nodes[j + 1] - nodes[j])
    influence = np.zeros((n, n))
    rows = np.empty((grid.size if remembers else 0, n))
    scale = tabor * grid.spacing
    for f in range(grid.size if remembers else last + 1):
        hat = grid.unit_influence[f]
        if remembers:
            for i in range(n):
                rows[f, i] = scale * hat[nodes[i]]
        if f <= last:
            inner, outer = influence[panel[f]], influence[panel[f] + 1]
            to_outer = scale * fraction[f]
            to_inner = scale - to_outer
            for i in range(n):
                value = hat[nodes[i]]
                inner[i] += to_inner * value
                outer[i] += to_outer * value
    radii = grid.spacing * nodes
    weights = np.zeros(n)
    for i in range(n - 1):
        a, b = radii[i], radii[i + 1]
        weights[i] += (b - a) * (2.0 * a + b) / 3.0
        weights[i + 1] += (b - a) * (a + 2.0 * b) / 3.0
    return Mesh(nodes, radii, influence, rows, weights, panel, fraction, window)


@kernel
def prolong(mesh: Mesh, traction: np.ndarray, out: np.ndarray) -> None:
    """The piecewise linear traction (n,) at the nodes of the master grid, into `out` (N,); zero beyond the mesh."""
    last = mesh.nodes[mesh.nodes.size - 1]
    for f in range(out.size):
        p = mesh.panel[f]
        out[f] = traction[p] + mesh.fraction[f] * (traction[p + 1] - traction[p]) if f <= last else 0.0

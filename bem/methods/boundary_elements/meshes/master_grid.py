"""The master grid, from which meshes are selected and on which the memory lives: equally spaced, or moving.

The cohesive zone must be resolved wherever the contact edge is. Its width falls as 1 / mu^2. Up to `LARGEST_GRID` nodes
the grid is equally spaced and fine everywhere; it then stays for the whole trajectory. Larger Tabor parameters get a
grid of a few hundred nodes that is fine in a block around the edge only, and where the memory is curved. When the edge
comes to the end of the block, a new grid is made around it (`grid_around`), and the memory is carried over
(`bem.methods.boundary_elements.meshes.regrid`). All nodes of all grids lie on one lattice, and spacings are powers of
two of its own, so that most nodes of one grid are also nodes of the next.

Units: radii in beta; places in spacings of the lattice.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem.methods.boundary_elements.influence.on_any_nodes import hat_influence, kernel_series
from bem.methods.boundary_elements.influence.triangles import unit_influence
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width, far_radius, largest_contact_radius
from bem.methods.boundary_elements.meshes.smooth_traction import smooth_influence, smooth_influence_of
from bem.problem.accuracy import Controls
from bem.problem.indenter import PARABOLOID

LARGEST_GRID = 1024  # nodes of an equally spaced grid; beyond, one that moves costs less
LARGEST_LATTICE = 2**24  # places of a moving grid; beyond, rounding of the influence is felt
LARGEST_REMEMBERED = 2**17  # the same where there is a memory; the steps grow with the places that the edge passes
AHEAD, BEHIND = 1.0, 0.5  # extent of the cohesive zone outside and inside the edge, in widths
_TRAVEL, _RETURN = 14.0, 3.0  # room for the edge in a block, in its direction and against it, in widths
_FINER = 0.6  # spacing and growth outside the block, of those of a mesh, so that meshes can be selected
_WIDEST_LEVEL = 2**12


class Grid(NamedTuple):
    """N radii `spacing * places`, and the influence of a unit traction at each, at a lattice spacing of 1."""

    size: int
    spacing: float
    places: np.ndarray  # (N,) int64
    unit_influence: np.ndarray  # (N or more, N or more)
    smooth: bool  # whether the traction between the nodes is a cubic, else a line
    # The grid resolves edges whose zone lies between these places, which are infinite where it stays.
    low: float
    high: float


def master_grid(
    tabor: float,
    peak_indentation: float,
    controls: Controls,
    remembers: bool = True,
    exponent: float = PARABOLOID,
) -> Grid:
    """Grid that resolves the contact edge wherever an indentation up to the peak can bring it.

    Args:
        tabor: Tabor parameter.
        peak_indentation: in h0.
        controls: spacing at the edge and extent.
        remembers: whether the material has a memory.
        exponent: of the indenter.

    Raises:
        MemoryError: with the number of equal spacings it would take, when that exceeds `LARGEST_REMEMBERED`, or
            `LARGEST_LATTICE` without a memory.
    """
    radius = largest_contact_radius(peak_indentation, tabor, exponent)
    spacing = controls.edge_spacing * uncompiled(edge_width)(radius, tabor, exponent)
    reach = far_radius(radius, controls.far_gap, tabor, exponent)
    size, most = math.ceil(reach / spacing) + 2, LARGEST_REMEMBERED if remembers else LARGEST_LATTICE
    if size > most:
        raise MemoryError(f"the contact edge needs {size} grid nodes, more than {most}")
    if size <= LARGEST_GRID:
        matrix = _matrix_of(math.ceil(size / 256))
        return Grid(size, spacing, np.arange(size), matrix, True, -math.inf, math.inf)
    step = 2 ** max(0, int(math.log2(controls.widest * 0.5 * radius / spacing)))
    last = step * math.ceil(size / step)
    ends = Grid(2, spacing, np.array([0, last]), np.empty((0, 0)), False, 0.0, 0.0)
    width = uncompiled(edge_width)(0.0, tabor, exponent)
    return grid_around(ends, kernel_series(), controls, 0.0, width, 1.0, np.full(2, np.inf))


def widened(grid: Grid) -> tuple[Grid, Grid]:
    """An equally spaced grid, with one node more if it must, and one of twice the spacing that ends where it does."""
    size = grid.size // 2 + 1
    matrix = _matrix_of(math.ceil(2 * size / 256))
    grids = [grid._replace(size=n, places=np.arange(n), unit_influence=matrix) for n in (2 * size - 1, size)]
    return grids[0], grids[1]._replace(spacing=2.0 * grid.spacing)


@functools.cache
def _matrix_of(blocks: int) -> np.ndarray:
    """Influence of radii 0, 1, 2, ..., a row for each node, of so many blocks of 256."""
    return smooth_influence(unit_influence(256 * blocks))


@kernel
def moves(grid: Grid) -> bool:
    """Whether the grid is made anew as the edge moves."""
    return grid.high < math.inf


@kernel
def holds(grid: Grid, window: np.ndarray, width: float) -> bool:
    """Whether the grid resolves an edge anywhere in `window` (2,), radii."""
    low, high = (window[0] - BEHIND * width) / grid.spacing, (window[1] + AHEAD * width) / grid.spacing
    last = float(grid.places[grid.size - 1])
    return (low >= grid.low or grid.low <= 0.0) and (high <= grid.high or grid.high >= last)


@kernel
def grade(spacings: np.ndarray, places: np.ndarray, slope: float) -> None:
    """Reduce the `spacings` (N,) at `places` (N,) until they change by `slope` times a distance at most."""
    for f in range(1, spacings.size):
        spacings[f] = min(spacings[f], spacings[f - 1] + slope * (places[f] - places[f - 1]))
    for f in range(spacings.size - 2, -1, -1):
        spacings[f] = min(spacings[f], spacings[f + 1] + slope * (places[f + 1] - places[f]))


@kernel
def grid_around(
    old: Grid,
    series: np.ndarray,
    controls: Controls,
    edge: float,
    width: float,
    direction: float,
    spacings: np.ndarray,
) -> Grid:
    """A grid of the same lattice that is fine around an edge, and where the memory needs it.

    Args:
        old: a moving grid.
        series: of `kernel_series`.
        controls: spacing at the edge, growth and widest spacing.
        edge: contact edge, in beta.
        width: of the cohesive zone there.
        direction: positive where the edge moves outwards.
        spacings: (N,) spacing that the memory on `old` wants at its places, in lattice spacings.
    """
    spacing, last = old.spacing, old.places[old.size - 1]
    inner = edge - width * (BEHIND + (_RETURN if direction > 0.0 else _TRAVEL))
    outer = edge + width * (AHEAD + (_TRAVEL if direction > 0.0 else _RETURN))
    low, high = max(inner / spacing, 0.0), min(outer / spacing, float(last))
    finest = max(controls.edge_spacing * width / spacing, 1.0)
    slope = _FINER * (controls.growth - 1.0)
    inside = max(_FINER * controls.widest * edge / spacing, 1.0)
    near = spacings.copy()  # graded, so that no interval needs to look further than its own nodes
    grade(near, old.places, slope)
    places = np.empty(256, dtype=np.int64)
    count, x, f = 1, 0, 0
    places[0] = 0
    step = 1
    while x < last:
        while old.places[f + 1] <= x:
            f += 1
        # the largest aligned step that is nowhere longer than allowed; neighbours differ by a few powers of two at most
        step = min(step * 4, _WIDEST_LEVEL)
        while step > 1:
            end = x + step
            if x % step == 0 and end <= last:
                away = max(max(low - end, x - high), 0.0)
                allowed = finest + slope * away
                allowed = min(allowed, inside if x * spacing <= edge else 2.0 * _FINER * controls.widest * x)
                g = f
                while allowed >= step and old.places[g] < end:
                    allowed = min(allowed, near[g])
                    g += 1
                if min(allowed, near[g] if g < old.size else np.inf) >= step:
                    break
            step //= 2
        x += step
        if count == places.size:
            longer = np.empty(2 * count, dtype=np.int64)
            longer[:count] = places
            places = longer
        places[count] = x
        count += 1
    chosen = places[:count].copy()
    influence = smooth_influence_of(chosen, hat_influence(chosen, series))
    return Grid(count, spacing, chosen, influence, True, low, high)

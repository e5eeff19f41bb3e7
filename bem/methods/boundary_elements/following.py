"""Grid and mesh that follow the contact edge: those that resolve a state."""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width
from bem.methods.boundary_elements.meshes.master_grid import Grid, grade, grid_around, holds, moves
from bem.methods.boundary_elements.meshes.mesh import (
    Mesh,
    condense,
    edge_window,
    pick_nodes,
    refine_for_memory,
    refine_for_traction,
    resolves,
    spacing_at_edge,
)
from bem.methods.boundary_elements.meshes.regrid import Remembered, carried, same_grid
from bem.methods.boundary_elements.state import State, edge_left_window
from bem.problem.accuracy import Controls
from bem.problem.tractions import Interface

_WIDE_GAP = 4.0  # in h0; beyond it the remembered traction need not be resolved


class Discretisation(NamedTuple):
    """The nodes of one scene."""

    grid: Grid  # the first, if it moves
    wide: Grid  # of twice the spacing, which resolves the first segments of the protocol
    wide_segments: int  # so many
    series: np.ndarray  # of the kernel, for the next; (0, 0) where the grid stays
    remembers: bool  # whether the material has a memory
    own_mesh: Mesh  # of the user, in use from beginning to end; empty where nodes follow the edge
    fixed: bool  # whether there is one


@kernel
def same_nodes(first: Mesh, second: Mesh) -> bool:
    """Whether two meshes select the same nodes of the same master grid."""
    return np.array_equal(first.nodes, second.nodes) and same_grid(first.grid, second.grid)


@kernel
def first_mesh(interface: Interface, controls: Controls, scheme: Discretisation) -> Mesh:
    """The mesh to start from, before anything touches."""
    if scheme.fixed:
        return scheme.own_mesh
    grid, tabor = scheme.wide if scheme.wide_segments > 0 else scheme.grid, interface.tabor
    width = edge_width(0.0, tabor, interface.exponent)
    window = edge_window(0.0, 1.0, width)
    spacings = spacing_at_edge(grid, controls, 0.0, width, window)
    grade(spacings, grid.places, controls.growth - 1.0)
    return condense(grid, tabor, pick_nodes(spacings, grid.places), window, scheme.remembers)


@kernel
def _refine_for_tractions(
    tabor: float,
    curvature: float,
    state: State,
    places: np.ndarray,
    remembered: Remembered,
    last: int,
    spacings: np.ndarray,
) -> None:
    """Reduce the `spacings` (N,) at `places` (N,) to where the tractions are nearly linear."""
    mesh, allowed = state.mesh, 8.0 * curvature
    refine_for_memory(spacings, places, remembered.traction, last, allowed * tabor, remembered.response)
    refine_for_traction(spacings, places, mesh.grid.places[mesh.nodes], state.traction, tabor, allowed)


@kernel
def select_mesh(
    interface: Interface,
    controls: Controls,
    scheme: Discretisation,
    state: State,
    direction: float,
    remembered: Remembered,
) -> Mesh:
    """A mesh for a state whose edge moves outwards (`direction` > 0) or inwards; its own when that still resolves it.

    Old nodes are kept where possible: in a stiff, slowly relaxing contact every new selection perturbs the tractions.
    """
    tabor, curvature, old, grid = interface.tabor, controls.curvature, state.mesh, state.mesh.grid
    last = old.nodes[0]  # the axis
    for j in range(state.gap.size):
        if state.gap[j] < _WIDE_GAP:
            last = old.nodes[min(j + 1, state.gap.size - 1)]
    width = edge_width(state.edge, tabor, interface.exponent)
    window = edge_window(state.edge, direction, width)
    if moves(grid) and not holds(grid, window, width):
        spacings = np.full(grid.size, np.inf)
        _refine_for_tractions(tabor, curvature, state, grid.places, remembered, grid.places[grid.size - 1], spacings)
        grid = grid_around(grid, scheme.series, controls, state.edge, width, direction, spacings)
    on_grid = carried(remembered, old.grid, grid)
    spacings = spacing_at_edge(grid, controls, state.edge, width, window)
    _refine_for_tractions(tabor, curvature, state, grid.places, on_grid, old.grid.places[last], spacings)
    grade(spacings, grid.places, controls.growth - 1.0)
    if same_grid(grid, old.grid) and not edge_left_window(state) and resolves(old.nodes, grid.places, spacings):
        return old
    return condense(grid, tabor, pick_nodes(spacings, grid.places), window, scheme.remembers)

"""Grid and mesh that follow the contact edge: those that resolve a state."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bem._numerics.jit import kernel, kernel_part
from bem.solver.discretisation.cohesive_zone import edge_width
from bem.solver.discretisation.master_grid import Grid, grid_around, holds, moves
from bem.solver.discretisation.mesh import (
    Mesh,
    condense,
    edge_window,
    grade,
    pick_nodes,
    refine_for_memory,
    refine_for_traction,
    resolves,
    spacing_at_edge,
)
from bem.solver.discretisation.regrid import regrid, same_places

if TYPE_CHECKING:
    from bem.solver.problem import Problem
    from bem.solver.stepping.state import State

_WIDE_GAP = 4.0  # in h0; beyond it the remembered traction need not be resolved


@kernel_part
def edge_left_window(state: State) -> bool:
    """Whether the mesh must follow."""
    window = state.mesh.window
    return state.edge < window[0] or state.edge > window[1]


@kernel
def same_nodes(one: Mesh, other: Mesh) -> bool:
    """Whether two meshes select the same nodes of the same master grid."""
    return same_places(one.nodes, other.nodes) and same_grid(one.grid, other.grid)


@kernel
def same_grid(one: Grid, other: Grid) -> bool:
    """Whether two grids of one scene have the same nodes."""
    return not moves(one) or same_places(one.places, other.places)


@kernel_part
def first_mesh(problem: Problem) -> Mesh:
    """The mesh to start from, before anything touches."""
    controls, grid, tabor = problem.controls, problem.grid, problem.tabor
    width = edge_width(0.0, tabor, problem.nonadhesive)
    window = edge_window(0.0, 1.0, width)
    wanted = spacing_at_edge(grid, controls, 0.0, width, window)
    grade(wanted, grid.places, controls.growth)
    return condense(grid, tabor, pick_nodes(wanted, grid.places), window, problem.strengths.size > 0)


@kernel
def _refine_for_tractions(
    problem: Problem,
    state: State,
    places: np.ndarray,
    remembered: np.ndarray,
    last: int,
    response: float,
    wanted: np.ndarray,
) -> None:
    """Reduce the spacing `wanted` (N,) at `places` (N,) to where the tractions are nearly linear."""
    mesh, tabor = state.mesh, problem.tabor
    allowed = 8.0 * problem.controls.curvature
    refine_for_memory(wanted, places, remembered, last, allowed * tabor, response)
    refine_for_traction(wanted, places, mesh.grid.places[mesh.nodes], state.traction, tabor, allowed)


@kernel
def _following_grid(
    problem: Problem, state: State, window: np.ndarray, direction: float, remembered: np.ndarray, response: float
) -> Grid:
    """The grid of a state, or a new one where it moves and does not resolve the edge in all of `window`."""
    grid = state.mesh.grid
    width = edge_width(state.edge, problem.tabor, problem.nonadhesive)
    if not moves(grid) or holds(grid, window, width):
        return grid
    wanted = np.full(grid.size, np.inf)
    _refine_for_tractions(problem, state, grid.places, remembered, grid.places[grid.size - 1], response, wanted)
    return grid_around(grid, problem.series, problem.controls, state.edge, width, direction, wanted)


@kernel
def select_mesh(problem: Problem, state: State, direction: float, remembered: np.ndarray, response: float) -> Mesh:
    """A mesh for a state whose edge moves outwards (`direction` > 0) or inwards; its own when that still resolves it.

    Old nodes are kept where possible: in a stiff, slowly relaxing contact every new selection perturbs the tractions.
    """
    controls, tabor, old = problem.controls, problem.tabor, state.mesh
    last = old.nodes[0]  # the axis
    for j in range(state.gap.size):
        if state.gap[j] < _WIDE_GAP:
            last = old.nodes[min(j + 1, state.gap.size - 1)]
    width = edge_width(state.edge, tabor, problem.nonadhesive)
    window = edge_window(state.edge, direction, width)
    grid = _following_grid(problem, state, window, direction, remembered, response)
    if not same_grid(grid, old.grid):
        remembered = carried(remembered, old.grid, grid)
    wanted = spacing_at_edge(grid, controls, state.edge, width, window)
    _refine_for_tractions(problem, state, grid.places, remembered, old.grid.places[last], response, wanted)
    grade(wanted, grid.places, controls.growth)
    if same_grid(grid, old.grid) and not edge_left_window(state) and resolves(old.nodes, grid.places, wanted):
        return old
    return condense(grid, tabor, pick_nodes(wanted, grid.places), window, problem.strengths.size > 0)


@kernel
def carried(values: np.ndarray, old: Grid, new: Grid) -> np.ndarray:
    """Values (N,) of the memory, or (0,), on another grid."""
    if values.size == 0:
        return values
    moved = np.empty(new.size)
    regrid(old.places, values, new.places, moved)
    return moved

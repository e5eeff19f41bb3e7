"""Small discretised contacts on which the solver's kernels are tried one by one."""

import numpy as np

from bem.accuracy import resolve_accuracy
from bem.solver.discretisation.cohesive_zone import edge_width
from bem.solver.discretisation.mesh import (
    Grid,
    Mesh,
    condense,
    edge_window,
    grade,
    master_grid,
    pick_nodes,
    spacing_at_edge,
)

CONTROLS = resolve_accuracy("standard").controls()


def spacing_for(
    grid: Grid, tabor: float, *, edge: float, nonadhesive: bool = False, direction: float = 1.0, controls=CONTROLS
):
    """Spacing wanted for an edge, without an earlier solution, and the window in which the edge may travel."""
    width = edge_width(edge, tabor, nonadhesive)
    window = edge_window(edge, direction, width)
    wanted = spacing_at_edge(grid, controls, edge, width, window)
    grade(wanted, controls.growth)
    return wanted, window


def mesh_for(
    tabor: float, *, edge: float, peak: float, nonadhesive: bool = False, remembers: bool = False
) -> tuple[Grid, Mesh]:
    """A master grid and the selection of its nodes for a contact edge."""
    grid = master_grid(tabor, peak, nonadhesive, CONTROLS)
    wanted, window = spacing_for(grid, tabor, edge=edge, nonadhesive=nonadhesive)
    nodes = pick_nodes(wanted)
    return grid, condense(grid, tabor, nodes, window, remembers, not nonadhesive)


def right_side(mesh: Mesh, tabor: float, indentation: float) -> np.ndarray:
    """Gap of the undeformed sphere, counted from h0."""
    return 1.0 - indentation + 0.5 * tabor * mesh.radii**2

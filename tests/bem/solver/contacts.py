"""Small discretised contacts on which the solver's kernels are tried one by one."""

import numpy as np

from bem.accuracy import resolve_accuracy
from bem.solver.discretisation.mesh import Grid, Mesh, condense, master_grid, pick_nodes, wanted_spacing

CONTROLS = resolve_accuracy("standard").controls()
NOTHING = np.zeros(0)


def spacing_for(
    grid: Grid, tabor: float, *, edge: float, hard: bool = False, direction: float = 1.0, controls=CONTROLS
):
    """Spacing wanted for an edge, without an earlier solution, and the window in which the edge may travel."""
    nodes = np.zeros(0, np.int64)
    return wanted_spacing(grid, tabor, hard, edge, direction, nodes, NOTHING, NOTHING, 1.0, 0.0, controls)


def mesh_for(
    tabor: float, *, edge: float, peak: float, hard: bool = False, remembers: bool = False
) -> tuple[Grid, Mesh]:
    """A master grid and the selection of its nodes for a contact edge."""
    grid = master_grid(tabor, peak, hard, CONTROLS)
    wanted, window = spacing_for(grid, tabor, edge=edge, hard=hard)
    nodes = pick_nodes(wanted)
    return grid, condense(grid, tabor, nodes, window, remembers)


def right_side(mesh: Mesh, tabor: float, indentation: float) -> np.ndarray:
    """Gap of the undeformed sphere, counted from h0."""
    return 1.0 - indentation + 0.5 * tabor * mesh.radii**2

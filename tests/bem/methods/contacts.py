"""Small discretised contacts on which the solver's kernels are tried one by one."""

import numpy as np

from bem.methods.boundary_elements.influence.triangles import unit_influence
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width
from bem.methods.boundary_elements.meshes.master_grid import Grid, grade, master_grid
from bem.methods.boundary_elements.meshes.mesh import Mesh, condense, edge_window, pick_nodes, spacing_at_edge
from bem.problem.accuracy import resolve_accuracy
from bem.problem.tractions import LENNARD_JONES, Interface, traction

CONTROLS = resolve_accuracy("standard").controls()


def lennard_jones(tabor: float, nonadhesive: bool = False) -> Interface:
    """The interface of a scene with the default law."""
    return Interface(tabor, LENNARD_JONES, nonadhesive)


def stress(tabor: float, gap: np.ndarray) -> np.ndarray:
    """Lennard-Jones traction at gaps (n,)."""
    return tabor * np.array([traction(h) for h in gap])


def spacing_for(grid: Grid, tabor: float, *, edge: float, direction: float = 1.0, controls=CONTROLS):
    """Spacing wanted for an edge, without an earlier solution, and the window in which the edge may travel."""
    width = edge_width(edge, tabor)
    window = edge_window(edge, direction, width)
    spacings = spacing_at_edge(grid, controls, edge, width, window)
    grade(spacings, grid.places, controls.growth - 1.0)
    return spacings, window


def mesh_for(
    tabor: float, *, edge: float, peak: float, lines: bool = False, remembers: bool = False
) -> tuple[Grid, Mesh]:
    """A master grid and the selection of its nodes for a contact edge; `lines` interpolate the traction, or cubics."""
    grid = master_grid(tabor, peak, CONTROLS)
    if lines:
        grid = grid._replace(unit_influence=unit_influence(grid.size), smooth=False)
    spacings, window = spacing_for(grid, tabor, edge=edge)
    nodes = pick_nodes(spacings, grid.places)
    return grid, condense(grid, tabor, nodes, window, remembers)


def right_side(mesh: Mesh, tabor: float, indentation: float) -> np.ndarray:
    """Gap of the undeformed sphere, counted from h0."""
    return 1.0 - indentation + 0.5 * tabor * mesh.radii**2

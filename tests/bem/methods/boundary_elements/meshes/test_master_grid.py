import numpy as np
import pytest

from bem.methods.boundary_elements.influence.on_any_nodes import kernel_series
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width
from bem.methods.boundary_elements.meshes.master_grid import (
    LARGEST_GRID,
    LARGEST_LATTICE,
    LARGEST_REMEMBERED,
    grade,
    grid_around,
    holds,
    master_grid,
    moves,
)
from bem.methods.boundary_elements.meshes.mesh import condense, edge_window, pick_nodes, spacing_at_edge
from bem.problem.accuracy import resolve_accuracy

CONTROLS = resolve_accuracy("standard").line_controls()
TABOR, EDGE = 30.0, 1.5


@pytest.fixture(scope="module")
def first():
    return master_grid(TABOR, 30.0, CONTROLS)


def around(first, edge=EDGE, direction=1.0, spacings=None):
    spacings = np.full(first.size, np.inf) if spacings is None else spacings
    return grid_around(first, kernel_series(), CONTROLS, edge, edge_width(edge, TABOR), direction, spacings)


def test_grid_is_equally_spaced_if_it_fits():
    grid = master_grid(3.0, 10.0, CONTROLS)
    assert not moves(grid)
    assert grid.size <= LARGEST_GRID
    np.testing.assert_array_equal(grid.places, np.arange(grid.size))
    assert holds(grid, np.array([0.1, 0.2]), 0.01)


def test_moving_grid_is_fine_at_the_edge(first):
    grid, width = around(first), edge_width(EDGE, TABOR)
    assert moves(grid)
    assert grid.size < 400 < grid.places[-1] / 10
    assert grid.places[0] == 0
    assert grid.places[-1] == first.places[-1]
    radii, steps = grid.spacing * grid.places[:-1], np.diff(grid.places)
    assert np.all(steps >= 1)
    assert np.all(steps[(radii > EDGE - width) & (radii < EDGE + 2.0 * width)] == 1)
    assert steps[radii < 0.5 * EDGE].max() > 16 < steps[-1]
    np.testing.assert_array_equal(np.log2(steps) % 1.0, 0.0)
    np.testing.assert_array_equal(grid.places[:-1] % steps, 0)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_block_leaves_room_for_the_edge(first, direction):
    grid, width = around(first, direction=direction), edge_width(EDGE, TABOR)
    ahead = np.array([-0.5, 0.5]) * width + EDGE + direction * 10.0 * width
    assert holds(grid, ahead, width)
    assert not holds(grid, ahead - direction * 16.0 * width, width)
    assert not holds(grid, ahead + direction * 10.0 * width, width)


def test_nodes_stay_where_memory_is_curved(first):
    spacings = np.full(first.size, np.inf)
    feature = int(np.argmin(np.abs(first.spacing * first.places - 0.8)))
    spacings[feature] = 4.0
    plain, grid = around(first), around(first, spacings=spacings)

    def step(places):
        return np.diff(places)[np.searchsorted(places, first.places[feature], side="right") - 1]

    assert step(plain.places) > 8
    assert step(grid.places) <= 4
    assert grid.size < plain.size + 200


def test_selected_mesh_has_mesh_spacing(first):
    grid, width = around(first), edge_width(EDGE, TABOR)
    window = edge_window(EDGE, 1.0, width)
    spacings = spacing_at_edge(grid, CONTROLS, EDGE, width, window)
    grade(spacings, grid.places, CONTROLS.growth - 1.0)
    nodes = pick_nodes(spacings, grid.places)
    mesh = condense(grid, TABOR, nodes, window, True)
    assert np.all(np.diff(grid.places[nodes]) <= np.maximum(spacings[nodes[:-1]], np.diff(grid.places)[nodes[:-1]]))
    assert mesh.radii.size < 0.8 * grid.size
    np.testing.assert_allclose(np.sum(mesh.influence, axis=0)[0], 2.0 * TABOR * mesh.radii[-1], rtol=2e-3)
    ones = np.ones(grid.size)
    np.testing.assert_allclose(ones @ mesh.master_rows, np.ones(mesh.radii.size) @ mesh.influence, rtol=1e-9)


@pytest.mark.parametrize(
    ("remembers", "most", "tabor"), [(True, LARGEST_REMEMBERED, 200.0), (False, LARGEST_LATTICE, 5e3)]
)
def test_too_large_lattice_is_refused(remembers, most, tabor):
    with pytest.raises(MemoryError, match=rf"needs \d+ grid nodes, more than {most}"):
        master_grid(tabor, 100.0, CONTROLS, remembers)

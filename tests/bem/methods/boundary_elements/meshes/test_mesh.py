from itertools import pairwise

import numpy as np
import pytest

from bem.methods.boundary_elements.influence.triangles import force_weights, influence_matrix, unit_influence
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width
from bem.methods.boundary_elements.meshes.master_grid import Grid, master_grid
from bem.methods.boundary_elements.meshes.mesh import (
    condense,
    pick_nodes,
    prolong,
    refine_for_memory,
    refine_for_traction,
    resolves,
    uniform_mesh,
)
from bem.methods.boundary_elements.meshes.smooth_traction import smooth_influence, smooth_influence_of
from tests.bem.methods.contacts import CONTROLS, mesh_for, spacing_for


def prolonged(mesh, traction):
    out = np.empty(mesh.first.size)
    prolong(mesh, traction, out)
    return out


CASES = [(0.2, 1.0), (1.0, 2.0), (3.2, 1.5)]


@pytest.mark.parametrize(("tabor", "edge"), CASES)
def test_condensed_influence_of_lines(tabor, edge):
    _, mesh = mesh_for(tabor, edge=edge, peak=10.0, lines=True)
    direct = tabor * influence_matrix(mesh.radii).T
    assert mesh.radii[0] == 0.0
    # The last hat of a selection keeps its outer flank, one master spacing wide, where the traction has died away.
    np.testing.assert_allclose(mesh.influence[:-1], direct[:-1], rtol=3e-10)
    assert np.all(mesh.influence[-1] > direct[-1])
    np.testing.assert_allclose(mesh.force_weights, force_weights(mesh.radii), rtol=1e-12)


def _smooth_field(grid, nodes, traction):
    """Displacement and force of a traction at selected nodes of a smooth mesh."""
    mesh = condense(grid, 1.0, nodes, np.zeros(2), False)
    values = traction(mesh.radii)
    return mesh.radii, values @ mesh.influence, values @ mesh.force_weights


def test_smooth_traction_has_fourth_order():
    # Hertz's pressure raised to a smooth end: sigma = (1 - r^2)^3 below 1
    def traction(radii):
        return np.maximum(1.0 - radii**2, 0.0) ** 3

    fine = np.linspace(0.0, 1.5, 3001)
    exact, exact_force = influence_matrix(fine[::2]) @ traction(fine[::2]), 0.25
    errors = []
    for count in (15, 30):
        hats = unit_influence(2 * count)
        grid = Grid(count + 1, 1.5 / count, np.arange(count + 1), smooth_influence(hats), True, -np.inf, np.inf)
        radii, displacement, force = _smooth_field(grid, np.arange(count + 1), traction)
        errors.append(np.max(np.abs(displacement - np.interp(radii, fine[::2], exact))))
        assert force == pytest.approx(exact_force, abs=2.0 / count**4)
        lines = traction(radii) @ (grid.spacing * hats[: count + 1, : count + 1])
        assert errors[-1] < 0.1 * np.max(np.abs(lines - np.interp(radii, fine[::2], exact)))
    assert errors[0] / errors[1] > 7.0


def test_left_out_nodes_follow_even_cubics():
    grid = master_grid(1.0, 5.0, CONTROLS)
    nodes = np.array([0, 2, 5, 9, 15])
    mesh = condense(grid, 1.0, nodes, np.zeros(2), True)
    parabola = prolonged(mesh, 3.0 - 0.5 * nodes.astype(float) ** 2)
    places = np.arange(nodes[-1] + 1)
    np.testing.assert_allclose(parabola[: places.size], 3.0 - 0.5 * places**2, atol=1e-12)
    assert not np.any(parabola[places.size :])


def test_equal_places_give_the_smooth_influence():
    hats = np.random.default_rng(3).standard_normal((40, 40))
    np.testing.assert_allclose(smooth_influence_of(np.arange(40), hats)[:-2], smooth_influence(hats)[:-2], atol=1e-13)


@pytest.mark.parametrize(("tabor", "edge"), CASES)
@pytest.mark.parametrize("lines", [True, False])
def test_master_rows_agree_with_selection(tabor, edge, lines):
    _, mesh = mesh_for(tabor, edge=edge, peak=10.0, remembers=True, lines=lines)
    traction = np.random.default_rng(3).standard_normal(mesh.radii.size)
    np.testing.assert_allclose(prolonged(mesh, traction) @ mesh.master_rows, traction @ mesh.influence, rtol=1e-9)


def test_prolongation_ends_with_the_mesh():
    grid, _ = mesh_for(1.0, edge=1.0, peak=5.0, lines=True)
    nodes = np.array([0, 1, 4, 9, 20])
    mesh = condense(grid, 1.0, nodes, np.zeros(2), True)
    values = np.array([1.0, -2.0, 5.0, 0.5, 3.0])
    expected = np.interp(np.arange(grid.size), nodes, values)
    expected[21:] = 0.0
    np.testing.assert_allclose(prolonged(mesh, values), expected, atol=1e-14)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("tabor", "edge"), [*CASES, (3.2, 0.0), (0.02, 0.0)])
def test_nodes_resolve_the_spacing(tabor, edge, direction):
    grid = master_grid(tabor, 10.0, CONTROLS)
    spacings, window = spacing_for(grid, tabor, edge=edge, direction=direction)
    nodes = pick_nodes(spacings, grid.places)
    assert nodes[0] == 0
    assert nodes[-1] == grid.size - 1
    for left, right in pairwise(nodes):
        assert right - left == 1 or right - left <= min(spacings[left], spacings[right])
    assert resolves(nodes, grid.places, spacings)
    assert not resolves(nodes[::3], grid.places, spacings)
    width = edge_width(edge, tabor)
    at_edge = np.abs(nodes * grid.spacing - edge) < 0.4 * width
    assert np.max(np.diff(nodes[at_edge])) * grid.spacing <= CONTROLS.edge_spacing * width * (1.0 + 1e-12)
    assert np.max(np.abs(np.diff(spacings))) <= CONTROLS.growth - 1.0 + 1e-12
    assert window[0] < edge < window[1]


def test_more_room_ahead_of_a_moving_edge():
    grid = master_grid(3.0, 10.0, CONTROLS)
    (_, inwards), (_, outwards) = (spacing_for(grid, 3.0, edge=1.5, direction=sign) for sign in (-1.0, 1.0))
    assert outwards[1] > inwards[1]
    assert inwards[0] < outwards[0]


def test_selection_is_much_smaller():
    grid, mesh = mesh_for(3.2, edge=3.0, peak=100.0)
    assert mesh.radii.size < 0.25 * grid.size


def test_the_papers_mesh_is_equally_spaced():
    np.testing.assert_allclose(uniform_mesh(3.0, 7), [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0])


@pytest.mark.parametrize(("response", "factor"), [(1.0, 1.0), (0.2, 0.2), (0.01, 0.05)])
def test_spacing_follows_remembered_traction(response, factor):
    spacings, curvature, allowed = np.full(50, 20.0), 0.02, 2.0
    refine_for_memory(spacings, np.arange(50), 0.5 * curvature * np.arange(50.0) ** 2, 30, allowed, response)
    np.testing.assert_allclose(spacings[1:31], max(np.sqrt(allowed * factor / curvature), 1.0), rtol=1e-9)
    np.testing.assert_array_equal(spacings[[0, *range(31, 50)]], 20.0)


def test_nothing_remembered_asks_for_nothing():
    spacings = np.full(5, 20.0)
    refine_for_memory(spacings, np.arange(5), np.zeros(0), 3, 2.0, 1.0)
    np.testing.assert_array_equal(spacings, 20.0)


def test_spacing_follows_last_traction():
    spacings, curvature, allowed, tabor = np.full(50, 20.0), 0.02, 0.8, 1.5
    nodes = np.array([0, 10, 20, 40])
    traction = 0.5 * curvature * nodes.astype(float) ** 2
    refine_for_traction(spacings, np.arange(50), nodes, traction, tabor, allowed)
    first, second = (np.sqrt(allowed * (tabor + 0.05 * traction[j]) / curvature) for j in (1, 2))
    np.testing.assert_allclose(spacings[5:16], first, rtol=1e-9)
    np.testing.assert_allclose(spacings[16:31], second, rtol=1e-9)
    np.testing.assert_array_equal(spacings[[*range(5), *range(31, 50)]], 20.0)

import numpy as np
import pytest

from bem.methods.boundary_elements.influence.triangles import force_weights, influence_matrix
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_width
from bem.methods.elastic_curve.scaled_meshes import (
    level_of,
    nodes_within,
    scaled_meshes,
    smallest_scale,
    weight_of_last,
)
from bem.problem.accuracy import resolve_accuracy

LEVELS = 9


@pytest.fixture(scope="module")
def meshes():
    return scaled_meshes(resolve_accuracy("standard").branch_controls(1.0), LEVELS, 15.0)


def traction(radii, level):
    """Smooth, even at the axis, and falling outside the edge with a power of the distance."""
    distance = (radii**2 - 1.0) / (2.0 * 1.5**-level)
    return (1.0 + 0.5 * (np.sqrt(1.0 + distance**2) + distance)) ** -3.0


@pytest.mark.parametrize("level", [0, 4, 8])
def test_few_nodes_match_many(meshes, level):
    n = meshes.size[level]
    radii = meshes.radii[level, :n]
    parts = np.arange(8) / 8
    fine = np.append((radii[:-1, None] + parts * np.diff(radii)[:, None]).ravel(), radii[-1])
    displacement = traction(radii, level) @ meshes.influence[level, :n, :n]
    exact = (influence_matrix(fine) @ traction(fine, level))[::8]
    assert displacement == pytest.approx(exact, abs=4e-4 * exact.max())
    by_lines = influence_matrix(radii) @ traction(radii, level)
    assert np.abs(by_lines - exact).max() > 4.0 * np.abs(displacement - exact).max()
    force = meshes.weights[level, :n] @ traction(radii, level)
    assert force == pytest.approx(force_weights(fine) @ traction(fine, level), rel=6e-4)


def test_edge_node_and_halving_levels(meshes):
    for level in range(LEVELS):
        node = meshes.edge_node[level]
        assert meshes.radii[level, node] == 1.0
        spacing = np.diff(meshes.radii[level, node - 1 : node + 3])
        assert spacing == pytest.approx(0.11 * 1.5**-level, rel=0.08)
        assert meshes.radii[level, 0] == 0.0
        assert meshes.radii[level, meshes.size[level] - 1] >= 15.0


@pytest.mark.parametrize("tabor", [0.02, 1.0, 8.0, 100.0])
def test_level_resolves_the_edge(tabor):
    scale = smallest_scale(tabor, 2.0)
    assert edge_width(scale, tabor) == pytest.approx(scale)
    assert level_of(scale, tabor, 2.0) == 0
    for radius in scale * np.array([1.3, 4.0, 20.0]):
        ratio = edge_width(radius, tabor) / radius
        assert ratio / 1.5 <= 1.5 ** -level_of(radius, tabor, 2.0) <= ratio * (1.0 + 1e-6)


def test_cut_mesh_ends_beyond_the_radius(meshes):
    n = nodes_within(meshes, 3, 5.0)
    radii = meshes.radii[3]
    assert radii[n - 2] < 5.0 <= radii[n - 1]
    assert weight_of_last(radii, n) == pytest.approx(force_weights(radii[:n])[-1])

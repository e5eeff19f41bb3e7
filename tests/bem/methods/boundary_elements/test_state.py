import numpy as np
import pytest

from bem.methods.boundary_elements.meshes.mesh import condense
from bem.methods.boundary_elements.state import transfer
from bem.problem.tractions.pressed import pressed_gap
from tests.bem.methods.contacts import lennard_jones, mesh_for
from tests.bem.methods.contacts import stress as stress_at

TABOR = 2.0


def law(gap):
    return stress_at(TABOR, gap)


def moved(old, gap, stress, new):
    new_gap, new_stress = np.empty(new.radii.size), np.empty(new.radii.size)
    transfer(lennard_jones(TABOR), old, gap, stress, new, new_gap, new_stress)
    return new_gap, new_stress


def selection(grid, nodes):
    return condense(grid, TABOR, np.array(nodes), np.zeros(2), False)


@pytest.fixture(scope="module")
def grid():
    return mesh_for(TABOR, edge=1.0, peak=5.0)[0]


def smooth_contact(mesh):
    """Pressure that falls to zero at radius 1, an opening crack outside it."""
    pressed = np.array([pressed_gap(-4.0 * max(1.0 - r * r, 0.0) / TABOR, 0.9) for r in mesh.radii])
    gap = np.where(mesh.radii < 1.0, pressed, 1.0 + np.maximum(mesh.radii - 1.0, 0.0) ** 2)
    return gap, law(gap)


def test_the_same_nodes_keep_the_solution(grid):
    mesh = selection(grid, range(0, grid.size, 2))
    gap, stress = smooth_contact(mesh)
    new_gap, new_stress = moved(mesh, gap, stress, mesh)
    np.testing.assert_allclose(new_gap, gap, rtol=1e-7)
    np.testing.assert_allclose(new_stress, stress, atol=1e-5)


def test_smooth_solution_survives_remeshing(grid):
    old, new = selection(grid, range(0, grid.size, 3)), selection(grid, range(0, grid.size - 2, 2))
    gap, stress = smooth_contact(old)
    new_gap, new_stress = moved(old, gap, stress, new)
    exact_gap, exact_stress = smooth_contact(new)
    away = np.abs(new.radii - 1.0) > 4.0 * 3.0 * grid.spacing
    np.testing.assert_allclose(new_gap[away], exact_gap[away], rtol=2e-4)
    np.testing.assert_allclose(new_stress[away], exact_stress[away], atol=2e-3)
    assert np.all(np.abs(new_gap / exact_gap - 1.0) < 0.02)


def test_sphere_is_undeformed_beyond_mesh(grid):
    old, new = selection(grid, range(20)), selection(grid, range(0, grid.size, 4))
    gap = 3.0 + 0.5 * TABOR * old.radii**2
    new_gap, new_stress = moved(old, gap, law(gap), new)
    np.testing.assert_allclose(new_gap, 3.0 + 0.5 * TABOR * new.radii**2, rtol=1e-9)
    np.testing.assert_allclose(new_stress, law(new_gap), rtol=1e-12)

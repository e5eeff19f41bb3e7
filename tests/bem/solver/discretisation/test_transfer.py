import numpy as np
import pytest

from bem.solver.discretisation.mesh import condense
from bem.solver.discretisation.transfer import transfer
from bem.solver.pressed import pressed_gap
from bem.tractions import LENNARD_JONES, traction
from tests.bem.solver.contacts import mesh_for

TABOR = 2.0


def law(gap):
    return TABOR * np.array([traction(h) for h in gap])


def moved(old, gap, stress, new, nonadhesive=False):
    new_gap, new_stress = np.empty(new.radii.size), np.empty(new.radii.size)
    transfer(old, gap, stress, new, TABOR, LENNARD_JONES, nonadhesive, new_gap, new_stress)
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


def test_a_smooth_solution_survives_between_nodes(grid):
    old, new = selection(grid, range(0, grid.size, 3)), selection(grid, range(0, grid.size - 2, 2))
    gap, stress = smooth_contact(old)
    new_gap, new_stress = moved(old, gap, stress, new)
    exact_gap, exact_stress = smooth_contact(new)
    away = np.abs(new.radii - 1.0) > 4.0 * 3.0 * grid.spacing
    np.testing.assert_allclose(new_gap[away], exact_gap[away], rtol=2e-4)
    np.testing.assert_allclose(new_stress[away], exact_stress[away], atol=2e-3)
    assert np.all(np.abs(new_gap / exact_gap - 1.0) < 0.02)


def test_beyond_the_old_mesh_the_sphere_is_undeformed(grid):
    old, new = selection(grid, range(20)), selection(grid, range(0, grid.size, 4))
    gap = 3.0 + 0.5 * TABOR * old.radii**2
    new_gap, new_stress = moved(old, gap, law(gap), new)
    np.testing.assert_allclose(new_gap, 3.0 + 0.5 * TABOR * new.radii**2, rtol=1e-9)
    np.testing.assert_allclose(new_stress, law(new_gap), rtol=1e-12)


def test_hard_contact_is_interpolated_linearly_and_ends_without_traction(grid):
    old, new = selection(grid, range(0, 21, 5)), selection(grid, range(0, grid.size, 2))
    gap, stress = 1.0 + old.radii, -np.arange(5.0)[::-1]
    new_gap, new_stress = moved(old, gap, stress, new, nonadhesive=True)
    inside = new.radii <= old.radii[-1]
    np.testing.assert_allclose(new_gap[inside], 1.0 + new.radii[inside])
    np.testing.assert_allclose(new_stress, np.interp(new.radii, old.radii, stress, right=0.0), atol=1e-14)

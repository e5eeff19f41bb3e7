import numpy as np
import pytest

from bem.methods.boundary_elements.equilibrium import solve_nonadhesive
from bem.methods.boundary_elements.meshes.cohesive_zone import nonadhesive_edge
from bem.methods.boundary_elements.meshes.mesh import fixed_mesh, uniform_mesh
from bem.methods.records import new_work
from tests.bem.methods.contacts import right_side


def solved(indentation, *, tabor=1.0, response=1.0, closed_before=False):
    mesh = fixed_mesh(tabor, uniform_mesh(1.15 * np.sqrt(max(indentation, 1.0) / tabor), 100), False)
    rhs = right_side(mesh, tabor, indentation)
    gap = np.ones(mesh.radii.size)
    tractions = np.full(mesh.radii.size, -1.0 if closed_before else 0.0)
    converged = solve_nonadhesive(mesh.influence, rhs, response, gap, tractions, new_work())
    return mesh, rhs, gap, tractions, converged


@pytest.mark.parametrize("closed_before", [False, True])
@pytest.mark.parametrize("indentation", [0.1, 1.0, 30.0])
def test_gap_is_closed_or_traction_free(indentation, closed_before):
    mesh, rhs, gap, tractions, converged = solved(indentation, closed_before=closed_before)
    assert converged
    assert np.all(tractions <= 0.0)
    assert np.all(gap >= 1.0 - 1e-9)
    assert np.max(np.abs((gap - 1.0) * tractions)) < 1e-9 * max(indentation, 1.0)
    np.testing.assert_allclose(gap + mesh.influence.T @ tractions, rhs, atol=1e-9 * max(indentation, 1.0))


def test_a_stiffer_response_carries_more():
    relaxed, glassy = solved(5.0)[3], solved(5.0, response=0.1)[3]
    np.testing.assert_allclose(glassy, 10.0 * relaxed, rtol=1e-9)


def test_without_contact_there_is_no_force():
    mesh, rhs, gap, tractions, converged = solved(-1.0, closed_before=True)
    assert converged
    assert not np.any(tractions)
    np.testing.assert_array_equal(gap, rhs)
    assert nonadhesive_edge(mesh.radii, tractions) == 0.0


@pytest.mark.parametrize("missing", [1, 3])
def test_interpenetrating_nodes_are_closed(missing):
    """The contact is found from a prediction with too few closed nodes."""
    mesh = fixed_mesh(1.0, uniform_mesh(2.5, 100), False)
    rhs = right_side(mesh, 1.0, 4.0)
    gap, tractions = np.zeros(rhs.size), np.zeros(rhs.size)
    assert solve_nonadhesive(mesh.influence, rhs, 1.0, gap, tractions, new_work())
    last = np.flatnonzero(tractions)[-missing]
    other_gap, other_tractions = gap.copy(), np.where(np.arange(rhs.size) < last, tractions, 0.0)
    assert solve_nonadhesive(mesh.influence, rhs, 1.0, other_gap, other_tractions, new_work())
    np.testing.assert_allclose(other_tractions, tractions, atol=1e-9)
    np.testing.assert_allclose(other_gap, gap, atol=1e-9)

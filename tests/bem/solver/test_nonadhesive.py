import numpy as np
import pytest

from bem.reference_solutions import hertz
from bem.solver.nonadhesive import nonadhesive_edge, solve_nonadhesive
from bem.solver.work import new_work
from tests.bem.solver.contacts import mesh_for, right_side


def solved(indentation, *, tabor=1.0, response=1.0, closed_before=False):
    radius = np.sqrt(max(indentation, 0.0) / tabor)
    _, mesh = mesh_for(tabor, edge=radius, peak=max(indentation, 1.0), nonadhesive=True)
    rhs = right_side(mesh, tabor, indentation)
    gap = np.ones(mesh.radii.size)
    tractions = np.full(mesh.radii.size, -1.0 if closed_before else 0.0)
    found = solve_nonadhesive(mesh.influence, rhs, response, gap, tractions, new_work())
    return mesh, rhs, gap, tractions, found


@pytest.mark.parametrize("closed_before", [False, True])
@pytest.mark.parametrize("indentation", [0.1, 1.0, 30.0])
def test_either_the_gap_is_closed_or_there_is_no_traction(indentation, closed_before):
    mesh, rhs, gap, tractions, found = solved(indentation, closed_before=closed_before)
    assert found
    assert np.all(tractions <= 0.0)
    assert np.all(gap >= 1.0 - 1e-9)
    assert np.max(np.abs((gap - 1.0) * tractions)) < 1e-9 * max(indentation, 1.0)
    np.testing.assert_allclose(gap + mesh.influence.T @ tractions, rhs, atol=1e-9 * max(indentation, 1.0))


@pytest.mark.parametrize("tabor", [0.3, 4.0])
def test_the_force_and_radius_are_hertz(tabor):
    mesh, _, _, tractions, _ = solved(5.0, tabor=tabor)
    assert mesh.force_weights @ tractions == pytest.approx(float(hertz.force_from_indentation(5.0, tabor)), rel=5e-3)
    assert nonadhesive_edge(mesh.radii, tractions) == pytest.approx(np.sqrt(5.0 / tabor), rel=0.02)


def test_a_stiffer_response_carries_more():
    relaxed, glassy = solved(5.0)[3], solved(5.0, response=0.1)[3]
    np.testing.assert_allclose(glassy, 10.0 * relaxed, rtol=1e-9)


def test_without_contact_there_is_no_force():
    mesh, rhs, gap, tractions, found = solved(-1.0, closed_before=True)
    assert found
    assert not np.any(tractions)
    np.testing.assert_array_equal(gap, rhs)
    assert nonadhesive_edge(mesh.radii, tractions) == 0.0

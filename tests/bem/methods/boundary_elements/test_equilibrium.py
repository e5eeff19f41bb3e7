import numpy as np
import pytest

from bem.methods.boundary_elements.equilibrium import anderson_share, new_factor, solve_adhesive
from bem.methods.boundary_elements.meshes.cohesive_zone import contact_edge
from bem.methods.records import FACTORISATIONS, ITERATIONS, UNKNOWNS, new_work
from bem.problem.tractions import GAP_AT_PEAK, force_of, slope
from tests.bem.methods.contacts import lennard_jones, mesh_for, right_side, stress


def solved(tabor, indentation, response=1.0, tolerance=1e-7, force_error=np.inf):
    _, mesh = mesh_for(tabor, edge=1.0 if indentation > 0.0 else 0.0, peak=max(indentation, 1.0))
    rhs = right_side(mesh, tabor, indentation)
    gap, tractions = np.maximum(rhs, 0.95), np.zeros(mesh.radii.size)
    work = new_work()
    factor = new_factor(gap.size)
    for depth in np.linspace(rhs[0], 1.0 - indentation, 6):  # a few warm starts
        now = rhs - rhs[0] + depth
        controls = (response, tolerance, force_error)
        matrices = (mesh.influence, mesh.force_weights)
        accepted = solve_adhesive(lennard_jones(tabor), *matrices, now, *controls, factor, gap, tractions, work)
    return mesh, rhs, gap, tractions, work, factor, accepted


@pytest.mark.parametrize("response", [1.0, 0.1])
@pytest.mark.parametrize(("tabor", "indentation"), [(0.02, -1.0), (0.2, 0.5), (1.0, 1.0), (0.6, 3.0)])
def test_accepted_state_solves_gap_equation(tabor, indentation, response):
    mesh, rhs, gap, tractions, work, _, accepted = solved(tabor, indentation, response)
    assert accepted
    np.testing.assert_allclose(tractions, stress(tabor, gap), rtol=1e-12)
    residual = gap + response * mesh.influence.T @ tractions - rhs
    assert np.max(np.abs(residual)) < 1e-7
    assert np.all(gap > 0.0)
    assert work[ITERATIONS] > 0


def test_factors_are_kept_without_far_field():
    mesh, _, gap, _, work, factor, _ = solved(1.0, 1.0)
    assert 1 <= work[FACTORISATIONS] < work[ITERATIONS]
    assert 3 <= factor.order[0] < gap.size
    assert work[UNKNOWNS] < work[ITERATIONS] * mesh.radii.size


def test_unreachable_residual_is_refused():
    *_, accepted = solved(1.0, 1.0, tolerance=0.0)
    assert not accepted


def test_edge_is_where_tension_peaks():
    radii = np.array([0.0, 1.0, 2.0, 3.0])
    gap = np.array([0.9, 1.0, GAP_AT_PEAK + 1.0, 5.0])
    expected = 1.0 + (GAP_AT_PEAK - 1.0) / GAP_AT_PEAK
    assert contact_edge(radii, gap, GAP_AT_PEAK) == pytest.approx(expected)
    assert contact_edge(radii, gap + 2.0, GAP_AT_PEAK) == 0.0


@pytest.mark.parametrize("response", [1.0, 1e-3])
def test_force_is_exact_however_stiff(response):
    allowed = 1e-4
    mesh, rhs, gap, tractions, _, factor, accepted = solved(0.2, 0.5, response, tolerance=1e-2, force_error=allowed)
    *_, exact_gap, exact, _, _, _ = solved(0.2, 0.5, response, tolerance=1e-9)
    assert accepted
    interface, weights = lennard_jones(0.2), mesh.force_weights
    truth = force_of(interface, weights, exact_gap, exact)
    assert abs(force_of(interface, weights, gap, tractions) - truth) < 2.0 * allowed
    moved, lifted, lift = gap.copy(), tractions.copy(), 1e-3
    controls = (response, 1e-8, np.inf)
    assert solve_adhesive(interface, mesh.influence, weights, rhs + lift, *controls, factor, moved, lifted, new_work())
    difference = abs(force_of(interface, weights, moved, lifted) - truth)
    assert factor.stiffness[0] == pytest.approx(difference / lift, rel=0.1)


@pytest.mark.parametrize(("stiffness", "stable"), [(0.5, True), (2.0, False)])
def test_negative_eigenvalue_is_refused(stiffness, stable):
    gap = np.array([1.5, 3.0, 3.0, 3.0])  # of nodes that do not feel each other
    tractions = stress(1.0, gap)
    rhs = gap + stiffness * tractions
    assert (1.0 + stiffness * slope(1.5) > 0.0) == stable
    influence, weights = stiffness * np.eye(4), np.ones(4)
    start = gap.copy()
    controls = (1.0, 1e-9, np.inf)
    accepted = solve_adhesive(
        lennard_jones(1.0), influence, weights, rhs, *controls, new_factor(4), start, tractions, new_work()
    )
    assert accepted == stable
    np.testing.assert_allclose(start, gap, rtol=1e-9)


@pytest.mark.parametrize(("shrinks_by", "share"), [(0.5, -1.0), (0.3, -3.0 / 7.0), (-0.5, 1.0 / 3.0)])
def test_geometric_errors_are_summed(shrinks_by, share):
    residual = np.array([0.3, -0.2, 0.1])
    anderson = anderson_share(shrinks_by * residual, residual)
    assert anderson == pytest.approx(share)
    # Taken back from the change, it leaves the sum of the geometric series.
    assert 1.0 - anderson == pytest.approx(1.0 / (1.0 - shrinks_by))


def test_extrapolation_stays_in_reach():
    residual = np.array([0.3, -0.2, 0.1])
    assert [anderson_share(factor * residual, residual) for factor in (0.9, 1.0, 1.5)] == [-2.0, 0.0, 0.4]

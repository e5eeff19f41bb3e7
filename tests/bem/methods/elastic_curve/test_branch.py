import numpy as np
import pytest

from bem.methods.boundary_elements.discrete_problem import LoadingDevice
from bem.methods.boundary_elements.influence.triangles import influence_matrix
from bem.methods.closed_forms import jkr
from bem.methods.elastic_curve.branch import Branch, branch_of
from bem.methods.records import work_by_name
from bem.problem.accuracy import resolve_accuracy
from bem.problem.tractions import GAP_AT_PEAK, Exponential, LennardJones, interface_of, law_of
from tests.bem.methods.contacts import stress

TABOR = 30.0
STANDARD = resolve_accuracy("standard")
RIGID = LoadingDevice(0.0, False, 1.0, 1.0)


def new_branch(tabor, adhesion=None, accuracy="standard"):
    adhesion = adhesion or LennardJones()
    fineness = getattr(adhesion, "fineness", 1.0)
    return Branch(interface_of(tabor, adhesion), resolve_accuracy(accuracy).branch_controls(tabor, fineness))


@pytest.fixture(scope="module")
def branch():
    curve = new_branch(TABOR)
    curve.reaching(10.0, np.inf)
    return curve


@pytest.fixture(scope="module")
def points(branch):
    return branch.reaching(10.0, np.inf)[0]


def test_points_are_equilibria_on_nodes(branch, points):
    for k in range(45, points.size, 7):  # before, surfaces are so far apart that they do not deform
        point, level, n = points[k], points["level"][k], points["nodes"][k]
        scaled, gap = branch._meshes.radii[level, :n], branch._gaps[k, :n]
        radii = point["scale"] * scaled
        lift = TABOR * influence_matrix(radii) @ stress(TABOR, gap)  # by lines: a coarser answer
        missing = gap + lift - (1.0 - point["indentation"] + 0.5 * TABOR * radii**2)
        assert np.abs(missing).max() < 0.03 * np.abs(lift).max() + 1e-3
        if point["contact_radius"] > 0.0:
            assert gap[np.argmin(np.abs(radii - point["contact_radius"]))] == GAP_AT_PEAK


def test_curve_spans_far_to_deepest(points):
    depth, force = points["indentation"], points["force"]
    assert depth[0] < -1e6
    far = depth < -60.0
    assert force[far] == pytest.approx(8.0 / 3.0 / (1.0 - depth[far]) ** 2, rel=0.02)  # of rigid surfaces
    assert depth[-1] >= 10.0
    assert np.all(np.diff(points["contact_radius"]) >= 0.0)


def test_contact_is_jkr_where_unstable_too(points):
    contact = points[points["contact_radius"] > 0.3]
    edges = contact["contact_radius"]
    assert edges[0] < jkr.FOLD_RADIUS
    assert np.abs(contact["force"] - jkr.force_from_contact_radius(edges)).max() < 0.008
    assert np.abs(contact["indentation"] - jkr.indentation_from_contact_radius(edges, TABOR)).max() < 0.01 * TABOR


@pytest.mark.parametrize("adhesion", [LennardJones(), Exponential()])
def test_the_rates_are_those_of_the_points(adhesion):
    coarse, fine = (new_branch(1.5, adhesion, accuracy).reaching(5.0, np.inf)[0] for accuracy in ("standard", 5e-4))
    contact = coarse[np.flatnonzero(coarse["contact_radius"] == coarse["scale"])[1] :]
    dense = fine[np.flatnonzero(fine["contact_radius"] == fine["scale"])[1] :]
    for name, tolerance in (("indentation", 4e-3), ("force", 8e-3)):
        slopes = np.gradient(dense[name], dense["along"])
        slope = np.interp(contact["along"][1:-1], dense["along"], slopes)
        assert contact[f"{name}_rate"][1:-1] == pytest.approx(slope, rel=0.05, abs=8.0 * tolerance)


@pytest.mark.parametrize("tabor", [0.05, 1.0, 20.0])
def test_curve_ignores_earlier_requests(tabor):
    shallow, deep, again = new_branch(tabor), new_branch(tabor), new_branch(tabor)
    first, first_work = shallow.reaching(1.0, np.inf)
    deep.reaching(50.0, np.inf)
    second, second_work = deep.reaching(1.0, np.inf)
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(first_work[:-1], second_work[:-1])
    again.reaching(1.0, np.inf)
    np.testing.assert_array_equal(again.reaching(50.0, np.inf)[0], deep.reaching(50.0, np.inf)[0])


def test_larger_budget_continues_the_curve():
    curve = new_branch(1.0)
    all_work = work_by_name(new_branch(1.0).reaching(3.0, np.inf)[1])["multiply_adds"]
    points, work = curve.reaching(3.0, 0.5 * all_work)
    assert 0.5 * all_work <= work_by_name(work)["multiply_adds"] < 0.7 * all_work
    assert points["indentation"][-1] < 3.0
    assert curve.reaching(3.0, np.inf)[0]["indentation"][-1] >= 3.0


def test_eigenvalue_vanishes_at_the_fold(branch, points):
    depth = points["indentation"]
    fold = int(np.argmax(np.diff(depth) < 0.0))  # where the surfaces snap in: the last point before or the first after
    before, near, at = (branch.smallest_eigenvalue(fold - k, RIGID) for k in (2, 1, 0))
    assert before > near > at > -0.1
    deepest = points.size - 1
    assert branch.smallest_eigenvalue(deepest, RIGID) > 0.0
    assert branch.smallest_eigenvalue(fold - 2, LoadingDevice(1e3, False, 1.0, 1.0)) < before


def test_the_last_curves_are_kept():
    first = branch_of(1.0, LennardJones(), STANDARD, 2.0)
    assert branch_of(1.0, LennardJones(), STANDARD, 2.0) is first
    assert branch_of(1.0, Exponential(), STANDARD, 2.0) is not first
    assert branch_of(1.0, Exponential(), STANDARD, 2.0).interface.law.peak_gap == law_of(Exponential()).peak_gap
    assert branch_of.cache_info().maxsize == 32

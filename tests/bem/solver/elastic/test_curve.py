import numpy as np
import pytest

from bem import Elastic, Scene
from bem.accuracy import resolve_accuracy
from bem.reference_solutions import jkr
from bem.solver.elastic.curve import lattice_of, solve_closed, trace
from bem.solver.elastic.march import sampled
from bem.solver.problem import discretise
from bem.solver.work import new_work
from bem.tractions import GAP_AT_PEAK, traction

TABOR = 30.0


@pytest.fixture(scope="module")
def lattice():
    controls = resolve_accuracy("standard").line_controls(elastic=True)
    return lattice_of(discretise(Scene(TABOR, Elastic()), 10.0, controls, None)[0])


@pytest.fixture(scope="module")
def curve(lattice):
    return trace(lattice, -40.0, 10.0, new_work())


def test_every_point_is_an_equilibrium_with_its_edge_on_a_node(curve):
    for points in curve:
        for point in points:
            mesh, law = point.mesh, TABOR * np.array([traction(gap) for gap in point.gap])
            missing = point.gap + law @ mesh.influence - (1.0 - point.depth + 0.5 * TABOR * mesh.radii**2)
            assert np.abs(missing).max() < 1e-6
    for point in curve[1]:
        assert point.gap[np.argmin(np.abs(point.mesh.radii - point.edge))] == GAP_AT_PEAK


def test_it_runs_from_surfaces_apart_to_the_deepest_contact(curve):
    apart, contact = curve
    assert apart[0].depth < -40.0
    assert apart[0].force == pytest.approx(8.0 / 3.0 / (1.0 - apart[0].depth) ** 2, rel=0.05)  # of rigid surfaces
    assert contact[-1].depth >= 10.0
    assert np.all(np.diff([point.edge for point in contact]) > 0.0)


def test_the_contact_is_that_of_jkr_also_where_it_is_unstable(curve):
    contact = [point for point in curve[1] if point.edge > 0.3]
    edges = np.array([point.edge for point in contact])
    assert edges[0] < jkr.FOLD_RADIUS
    force, depth = np.array([(point.force, point.depth) for point in contact]).T
    assert np.abs(force - jkr.force_from_contact_radius(edges)).max() < 0.008
    assert np.abs(depth - jkr.indentation_from_contact_radius(edges, TABOR)).max() < 0.01 * TABOR


def test_energy_and_force_belong_together(curve):
    fine = sampled(*curve)
    inside = fine.edge > 1.0
    work = -np.diff(fine.energy[inside]) / np.diff(fine.depth[inside])
    middle = 0.5 * (fine.force[inside][1:] + fine.force[inside][:-1])
    assert np.median(np.abs(work - middle)) < 0.02


def test_a_distant_neighbour_finds_the_same_point(lattice, curve):
    contact = [point for point in curve[1] if point.edge > 0.8]
    again = solve_closed(lattice, contact[5].edge, contact[0], new_work())
    assert again is not None
    assert again.depth == pytest.approx(contact[5].depth, abs=1e-5)
    assert again.force == pytest.approx(contact[5].force, abs=1e-6)

"""The spring's share of the gap equation."""

import numpy as np
import pytest

from bem import ForceProtocol, HardContact, PiecewiseLinearProtocol, Scene
from bem.solver.machine.compliance import (
    Machine,
    depth_error,
    depth_of,
    expected_depth,
    has_flown_off,
    influence_with_spring,
    right_side_with_spring,
)
from bem.solver.machine.reach import deepest_indentation, machine_of
from bem.solver.stepping.state import right_side
from bem.tractions import LENNARD_JONES, tail_force, traction
from tests.bem.solver.contacts import mesh_for

TABOR, STIFFNESS, RESPONSE = 1.0, 0.7, 0.6
NOTHING = np.zeros(0)


@pytest.fixture(scope="module")
def contact():
    """A mesh, and a gap with the tractions that belong to it."""
    _, mesh = mesh_for(TABOR, edge=1.5, peak=5.0)
    gap = 1.0 + 0.3 * np.maximum(mesh.radii - 1.0, 0.0) ** 2
    return mesh, gap, np.array([TABOR * traction(h) for h in gap])


def force_of(mesh, gap, tractions):
    return float(mesh.force_weights @ tractions) + tail_force(gap[-1])


def test_the_gap_equation_with_a_spring_is_that_at_the_indentation_of_the_sphere(contact):
    mesh, gap, tractions = contact
    machine = Machine(1.0 / STIFFNESS, False, 1.0, 1.0)
    stage = -0.4
    rigid = right_side(TABOR, mesh, stage, NOTHING)
    influence = influence_with_spring(machine, mesh, TABOR, LENNARD_JONES, False, RESPONSE, gap)
    rhs = right_side_with_spring(machine, mesh, TABOR, LENNARD_JONES, False, stage, RESPONSE, rigid, gap, tractions)
    found = gap + RESPONSE * influence.T @ tractions - rhs
    sphere = stage + force_of(mesh, gap, tractions) / STIFFNESS
    expected = gap + RESPONSE * mesh.influence.T @ tractions - right_side(TABOR, mesh, sphere, NOTHING)
    np.testing.assert_allclose(found, expected, atol=1e-10)
    force = force_of(mesh, gap, tractions)
    assert depth_of(machine, mesh, stage, force, rigid, RESPONSE, gap, tractions) == pytest.approx(sphere)


def test_the_matrix_holds_the_slope_of_the_far_force(contact):
    """A small change of the last gap changes the force by the weight that the matrix gives to the last traction."""
    mesh, gap, tractions = contact
    machine = Machine(1.0 / STIFFNESS, False, 1.0, 1.0)
    lifts = (
        (influence_with_spring(machine, mesh, TABOR, LENNARD_JONES, False, RESPONSE, gap) - mesh.influence)
        * RESPONSE
        * STIFFNESS
    )
    np.testing.assert_allclose(lifts, np.repeat(lifts[:, :1], gap.size, axis=1), atol=1e-9)
    np.testing.assert_allclose(lifts[:-1, 0], mesh.force_weights[:-1], rtol=1e-6, atol=1e-9)
    moved = gap.copy()
    moved[-1] *= 1.0 + 1e-5
    changed = np.array([TABOR * traction(h) for h in moved])
    found = (force_of(mesh, moved, changed) - force_of(mesh, gap, tractions)) / (changed[-1] - tractions[-1])
    assert lifts[-1, 0] == pytest.approx(found, rel=1e-3)


def test_a_prescribed_force_is_a_soft_spring_from_where_the_sphere_is_expected(contact):
    mesh, gap, tractions = contact
    machine = Machine(1e3, True, 1.0, 1.0)
    load = -2.0
    rigid = right_side(TABOR, mesh, load, NOTHING)
    influence = influence_with_spring(machine, mesh, TABOR, LENNARD_JONES, False, RESPONSE, gap)
    rhs = right_side_with_spring(machine, mesh, TABOR, LENNARD_JONES, False, load, RESPONSE, rigid, gap, tractions)
    # Where the outermost node has its expected gap, what is left there is the difference of the forces.
    left = (gap + RESPONSE * influence.T @ tractions - rhs)[-1]
    assert left == pytest.approx(1e3 * (force_of(mesh, gap, tractions) - load), rel=1e-6)


def test_the_expected_depth_is_that_of_the_gap_equation(contact):
    mesh, gap, tractions = contact
    free = right_side(TABOR, mesh, 0.0, NOTHING)
    depth = expected_depth(mesh, free, RESPONSE, gap, tractions)
    residual = gap + RESPONSE * mesh.influence.T @ tractions - right_side(TABOR, mesh, depth, NOTHING)
    assert residual[-1] == pytest.approx(0.0, abs=1e-10)


def test_nothing_bears_a_tension_far_above_the_force():
    pulled = Machine(1e3, True, 1.0, 1.0)
    assert has_flown_off(pulled, 1.0, 0.1, 1.0)
    assert not has_flown_off(pulled, 1.0, 0.99, 1.0)
    assert not has_flown_off(pulled, 1e-5, 1e-9, 1.0)
    assert has_flown_off(pulled, 1e-5, 0.0, 1.0)
    assert not has_flown_off(pulled, -1.0, -3.0, 1.0)
    assert not has_flown_off(Machine(1e3, False, 1.0, 1.0), 1.0, 0.1, 1.0)


def test_a_small_indentation_is_judged_by_its_scale():
    machine = Machine(1.0, False, 1.0, 2.0)
    assert depth_error(machine, 0.1, 0.0) == pytest.approx(0.075)
    assert depth_error(machine, 11.0, 10.0) == pytest.approx(0.15)


def test_a_scene_without_a_spring_has_no_compliance():
    assert machine_of(Scene(1.0), False, 1.0).compliance == 0.0
    assert machine_of(Scene(1.0, spring=4.0), False, 1.0).compliance == 0.25
    by_force = machine_of(Scene(1.0, spring=4.0), True, 1.0)
    assert by_force.by_force
    assert by_force.compliance > 500.0  # the spring is no part of the sphere's equilibrium then


@pytest.mark.parametrize("adhesion", [None, HardContact()])
def test_the_sphere_reaches_no_deeper_than_the_bound(adhesion):
    laws = () if adhesion is None else (adhesion,)
    path = PiecewiseLinearProtocol([0.0, 1.0], [-5.0, 10.0])

    def scene(spring=None):
        return Scene(2.0, *laws, spring=spring) if adhesion is None else Scene(2.0, adhesion=adhesion, spring=spring)

    rigid = deepest_indentation(scene(), path)
    assert rigid == 10.0
    bounds = [deepest_indentation(scene(spring), path) for spring in (1e12, 1.0, 0.1)]
    assert bounds[0] == pytest.approx(10.0, rel=1e-9)
    assert bounds[0] > bounds[1] > bounds[2]
    depth = bounds[1]
    tension = 0.0 if adhesion is not None else 2.0
    assert depth == pytest.approx(10.0 + tension - 4.0 / (3.0 * np.pi) * (depth / 2.0) ** 1.5)
    pressed = deepest_indentation(scene(), ForceProtocol([0.0, 1.0], [0.0, -5.0]))
    assert pressed == pytest.approx(2.0 * (0.75 * np.pi * (5.0 + tension)) ** (2.0 / 3.0))

"""The share of a spring, and of a prescribed force, in the gap equation."""

import numpy as np
import pytest

from bem import ForceProtocol, PiecewiseLinearProtocol, Scene
from bem.methods.boundary_elements.discrete_problem import problem_of
from bem.methods.boundary_elements.gap_equation import (
    depth_error,
    expected_depth,
    has_flown_off,
    influence_of,
    right_side,
    rigid_side,
    state_under,
)
from bem.methods.boundary_elements.meshes.regrid import Remembered
from bem.problem.accuracy import resolve_accuracy
from bem.problem.tractions import force_of
from tests.bem.methods.contacts import lennard_jones, mesh_for, stress

TABOR, STIFFNESS, RESPONSE = 1.0, 0.7, 0.6
NOTHING = Remembered(np.zeros(0), RESPONSE)
STAGE, LOAD = PiecewiseLinearProtocol([0.0, 1.0], [-5.0, 5.0]), ForceProtocol([0.0, 1.0], [0.0, -5.0])


def problem(path=STAGE, spring=STIFFNESS):
    return problem_of(Scene(TABOR, spring=spring), path, resolve_accuracy("draft"))


@pytest.fixture(scope="module")
def contact():
    """A mesh, and a gap with the tractions that belong to it."""
    _, mesh = mesh_for(TABOR, edge=1.5, peak=5.0)
    gap = 1.0 + 0.3 * np.maximum(mesh.radii - 1.0, 0.0) ** 2
    return mesh, gap, stress(TABOR, gap)


def force_in(mesh, gap, tractions):
    return force_of(lennard_jones(TABOR), mesh.force_weights, gap, tractions)


def residual_at(depth, mesh, gap, tractions):
    return gap + RESPONSE * mesh.influence.T @ tractions - rigid_side(lennard_jones(TABOR), mesh, depth, NOTHING)


def residual_under(scene, control, mesh, gap, tractions):
    influence = influence_of(scene, mesh, RESPONSE, gap)
    rigid = rigid_side(lennard_jones(TABOR), mesh, control, NOTHING)
    rhs = right_side(scene, mesh, control, RESPONSE, rigid, gap, tractions)
    return gap + RESPONSE * influence.T @ tractions - rhs


def test_spring_equation_is_at_indentation(contact):
    stage, sphere = -0.4, -0.4 + force_in(*contact) / STIFFNESS
    residual = residual_under(problem(), stage, *contact)
    np.testing.assert_allclose(residual, residual_at(sphere, *contact), atol=1e-10)
    mesh, gap, tractions = contact
    assert state_under(problem(), mesh, stage, NOTHING, gap, tractions).depth == pytest.approx(sphere)


def test_rigid_device_changes_nothing(contact):
    np.testing.assert_array_equal(residual_under(problem(spring=None), 0.3, *contact), residual_at(0.3, *contact))


def test_matrix_has_the_far_force_slope(contact):
    """A small change of the last gap changes the force by the weight that the matrix gives to the last traction."""
    mesh, gap, tractions = contact
    lifts = (influence_of(problem(), mesh, RESPONSE, gap) - mesh.influence) * RESPONSE * STIFFNESS
    np.testing.assert_allclose(lifts, np.repeat(lifts[:, :1], gap.size, axis=1), atol=1e-9)
    np.testing.assert_allclose(lifts[:-1, 0], mesh.force_weights[:-1], rtol=1e-6, atol=1e-9)
    moved = gap.copy()
    moved[-1] *= 1.0 + 1e-5
    changed = stress(TABOR, moved)
    slope = (force_in(mesh, moved, changed) - force_in(*contact)) / (changed[-1] - tractions[-1])
    assert lifts[-1, 0] == pytest.approx(slope, rel=1e-3)


def test_force_control_is_a_soft_spring(contact):
    scene, load = problem(LOAD), -2.0
    assert scene.device.compliance > 500.0  # the spring is no part of the sphere's equilibrium then
    # Where the outermost node has its expected gap, what is left there is the difference of the forces.
    left = residual_under(scene, load, *contact)[-1]
    assert left == pytest.approx(scene.device.compliance * (force_in(*contact) - load), rel=1e-6)


def test_expected_depth_solves_the_equation(contact):
    mesh, gap, tractions = contact
    depth = expected_depth(mesh, rigid_side(lennard_jones(TABOR), mesh, 0.0, NOTHING), RESPONSE, gap, tractions)
    assert residual_at(depth, *contact)[-1] == pytest.approx(0.0, abs=1e-10)
    assert state_under(problem(LOAD), mesh, -2.0, NOTHING, gap, tractions).depth == pytest.approx(depth)


@pytest.mark.parametrize(
    ("path", "control", "force", "gone"),
    [
        (LOAD, 1.0, 0.1, True),
        (LOAD, 1.0, 0.99, False),
        (LOAD, 1e-5, 1e-9, False),
        (LOAD, 1e-5, 0.0, True),
        (LOAD, -1.0, -3.0, False),
        (STAGE, 1.0, 0.1, False),
    ],
)
def test_no_tension_far_above_the_force(path, control, force, gone):
    assert has_flown_off(problem(path), control, force) is gone


def test_small_indentation_uses_its_scale():
    device = problem().device._replace(depth_scale=2.0)
    assert depth_error(device, 0.1, 0.0) == pytest.approx(0.075)
    assert depth_error(device, 11.0, 10.0) == pytest.approx(0.15)

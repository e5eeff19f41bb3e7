"""Shapes of the indenter: scales, closed forms, refusals."""

import json
import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from typer.testing import CliRunner

from bem import PowerLaw, Scene
from bem.cli.app import app
from bem.dataset.cases import described, restored
from bem.methods.closed_forms import hertz, jkr
from bem.problem.indenter import depth_factor, tension_without_deformation
from surrogate.validity import tabor_parameters
from tests.processes import succeeded


def test_paraboloid_is_hertz_cone_is_love():
    assert depth_factor(2.0) == 1.0
    assert depth_factor(2.0 + 1e-12) == pytest.approx(1.0)
    assert depth_factor(1.0) == pytest.approx(math.pi / 2.0)  # Johnson (1985), section 5.2
    assert hertz.force_from_indentation(3.0, 1.0, 1.0) == pytest.approx(-2.0 * 9.0 / math.pi**2)  # (2/pi) E* d^2 cot
    assert hertz.load_factor() == 4.0 / (3.0 * math.pi)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 4.0, 8.0])
def test_force_and_indentation_correspond(exponent):
    depth = hertz.indentation_from_force(5.0, 0.7, exponent)
    assert hertz.force_from_indentation(depth, 0.7, exponent) == pytest.approx(-5.0)
    largest = minimize_scalar(
        lambda a: -jkr.force_from_contact_radius(a, exponent), bounds=(0.1, 9.0), method="bounded"
    )
    assert jkr.pull_off_force(exponent) == pytest.approx(-largest.fun, rel=1e-6)
    # at a fixed contact radius the derivatives of both by the punch belong to the same stiffness, 2 a / (pi mu)
    radius = np.array([0.5, 1.0, 2.0])
    force = jkr.force_from_contact_radius(radius, exponent) - hertz.force_from_contact_radius(radius, exponent)
    lift = jkr.indentation_from_contact_radius(radius, 1.0, exponent) - depth_factor(exponent) * radius**exponent
    np.testing.assert_allclose(force, -2.0 * radius / np.pi * lift)


def test_cone_is_maugis_barquins():
    assert jkr.pull_off_force(2.0) == pytest.approx(1.5)
    # 54 dgamma^2 tan(b)^3 / (pi E*), b half the angle of the cone, over pi Q beta dgamma = pi dgamma^2 tan(b)^3 / E*
    assert jkr.pull_off_force(1.0) == pytest.approx(54.0 / math.pi**2)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 3.0, 8.0])
@pytest.mark.parametrize("gap", [1.0, 4.0])
def test_rigid_attraction_sums_the_surface(exponent, gap):
    tabor, radius = 0.5, np.geomspace(1e-7, 1e6, 400_000)
    h = gap + tabor * radius**exponent / exponent
    force = 2.0 * tabor * np.trapezoid(8.0 / 3.0 * (h**-3.0 - h**-9.0) * radius, radius)
    assert tension_without_deformation(tabor, exponent, gap) == pytest.approx(force, rel=1e-3)
    assert tension_without_deformation(tabor, 2.0) == pytest.approx(2.0)


def test_shape_is_written_only_if_given():
    scene = Scene(1.0, indenter=PowerLaw(3.0))
    with pytest.raises(ValueError, match="scene must have Lennard-Jones adhesion, a paraboloid"):
        tabor_parameters(scene, 1)  # by a surrogate
    assert restored(json.loads(json.dumps(described(scene)))) == scene
    assert "indenter" not in described(Scene(1.0))
    assert restored(described(Scene(1.0))) == Scene(1.0)


@pytest.mark.parametrize("word", ["cone", "paraboloid", "power:3"])
def test_shape_on_the_command_line(word):
    cycle = ["--tabor", "1", "--peak-indentation", "2", "--loading-rate", "5", "--unloading-rate", "5"]
    result = succeeded(app, ["simulate", *cycle, "--indenter", word, "--json"])
    assert json.loads(result.stdout)["status"] == "completed"
    refused = CliRunner().invoke(app, ["simulate", *cycle, "--indenter", "pyramid"])
    assert "indenter must be paraboloid, cone, or power:N" in str(refused.exception)

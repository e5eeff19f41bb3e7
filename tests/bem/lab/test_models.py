"""Every model of the ladder declares what it is, and agrees with the reference solutions."""

import numpy as np
import pytest

from bem import Elastic, StandardLinearSolid
from bem.lab import Setup
from bem.lab.models import CONTACT_POINT, MODELS, Path, setup_of
from bem.lab.models.ting import pressed
from bem.lab.segments import straight_lines
from tests.bem.lab.measurement import BEAD, TRUTH, measured

UNITS = {"Pa", "J/m^2", "m", "s", ""}
SETUP = Setup(radius=1e-5, work_of_adhesion=0.05, relaxed_modulus=1e6, half_angle=30.0)
VALUES = {
    "relaxed_modulus": 1e6,
    "work_of_adhesion": 0.05,
    "modulus_ratio": 0.3,
    "retardation_time": 0.2,
    "contact_point": 0.0,
}


@pytest.mark.parametrize("name", MODELS)
def test_a_model_declares_names_units_and_bounds(name):
    model = MODELS[name]
    assert model.title
    for parameter in (*model.parameters, CONTACT_POINT):
        assert parameter.unit in UNITS
        assert parameter.low < parameter.high
        assert parameter.advice
        assert parameter.outer(parameter.inner(0.3)) == pytest.approx(0.3)
        assert parameter.outer(1e9) > 0.9
        assert np.isfinite(parameter.inner(parameter.outer(100.0)))
        assert parameter.title
        assert set(parameter.name) <= set("abcdefghijklmnopqrstuvwxyz_0123456789")
    assert min(map(len, (model.source, model.assumptions))) > 10
    assert model.spans == (name in ("dmt", "jkr"))


@pytest.mark.parametrize("name", [name for name in MODELS if name != "contact"])
def test_a_spring_moves_the_contact_along_the_same_branch(name):
    """Behind a spring, the tension at a stage is that of the sphere at stage plus stretch."""
    time = np.linspace(0.0, 1.0, 1500)
    stage = np.linspace(-1e-6, 2e-6, 1500)
    tension = MODELS[name].tension(VALUES, Path(time, stage, SETUP.replaced(stiffness=30.0)))
    alone = MODELS[name].tension(VALUES, Path(time, stage + tension / 30.0, SETUP))
    away = stage > 0.1e-6
    np.testing.assert_allclose(tension[away], alone[away], rtol=2e-3, atol=2e-3 * np.abs(alone).max())


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_deep_sphere_is_sneddon(share):
    """Depth and force at a contact radius of a share of the radius: Sneddon (1965), equation 6.13."""
    radius, a = SETUP.radius, share * SETUP.radius
    depth = 0.5 * a * np.log((radius + a) / (radius - a))
    force = 0.5e6 / 0.75 * ((a**2 + radius**2) * np.log((radius + a) / (radius - a)) - 2.0 * a * radius)
    path = Path(np.array([0.0, 0.5, 1.0]), np.array([-1e-6, 0.0, depth]), SETUP)
    for name in ("hertz", "dmt"):
        tension = MODELS[name].tension(VALUES | {"work_of_adhesion": 0.0}, path)
        assert -tension[-1] == pytest.approx(force, rel=1e-5)
    for branch in ("jkr", "ting"):
        values = VALUES | {"work_of_adhesion": 0.0, "modulus_ratio": 0.999999}
        fine = Path(np.linspace(0.0, 1.0, 2000), np.linspace(-1e-7, depth, 2000), SETUP)
        assert -MODELS[branch].tension(values, fine)[-1] == pytest.approx(force, rel=2e-3)


def test_layer_of_dimitriadis():
    """The series of an incompressible bonded layer, with the numbers as printed."""
    layer = SETUP.replaced(thickness=10e-6)
    depth = np.array([1e-9, 0.5e-6])
    path = Path(np.array([0.0, 1.0]), depth, layer)
    chi = np.sqrt(SETUP.radius * depth[-1]) / 10e-6
    series = 1.0 + 1.133 * chi + 1.283 * chi**2 + 0.769 * chi**3 + 0.0975 * chi**4
    half_space = MODELS["hertz"].tension(VALUES, Path(path.time, depth, SETUP))[-1]
    assert MODELS["hertz"].tension(VALUES, path)[-1] == pytest.approx(half_space * series, rel=1e-3)
    thick = MODELS["hertz"].tension(VALUES, Path(path.time, depth, SETUP.replaced(thickness=1.0)))[-1]
    assert thick == pytest.approx(half_space, rel=1e-3)


def test_ting_is_hertz_where_nothing_relaxes_and_lags_where_it_does():
    time = np.linspace(0.0, 2.0, 1201)
    path = Path(time, np.minimum(np.minimum(2e-6 * time, 1e-6), 1e-6 * (4.0 - 2.0 * time)) - 0.2e-6, SETUP)
    hertz = MODELS["hertz"].tension(VALUES, path)
    still = MODELS["ting"].tension(VALUES | {"modulus_ratio": 0.999999}, path)
    np.testing.assert_allclose(still, hertz, atol=2e-4 * np.ptp(hertz))
    # It presses harder on the way in, and lets go before the sphere is back.
    relaxing = -MODELS["ting"].tension(VALUES, path)
    assert relaxing.max() > 1.4 * np.abs(hertz).max()
    assert np.flatnonzero(relaxing)[-1] < np.flatnonzero(hertz)[-1]


def test_a_row_of_elements_lets_go_and_is_pressed_again():
    time = np.concatenate([np.linspace(0.0, 1.1, 500), np.linspace(1.2, 30.0, 500), np.linspace(30.01, 31.1, 500)])
    apart = 1e-6 * np.interp(time, [0.0, 1.0, 1.1, 30.0, 31.0, 31.1], [-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])
    profile = ((np.arange(50) + 0.5) / 50) ** 2 * 1e-6
    force = pressed(time, apart, profile, 1e-7, 1e5, np.array([1e5]), np.array([1.0]), 0.0)
    assert np.all(force[(time > 1.1) & (time < 30.0)] == 0.0)
    assert force[time > 30.0].max() == pytest.approx(force[time < 1.1].max(), rel=0.01)


def test_a_corner_between_two_samples_is_where_the_lines_meet():
    time = np.linspace(0.0, 1.0, 101)
    path = np.minimum(2.0 * time, 1.0) - 3.0 * np.maximum(time - 0.7043, 0.0)
    times, places = straight_lines(time, path)
    np.testing.assert_allclose(times, [0.0, 0.5, 0.7043, 1.0], atol=1e-9)
    np.testing.assert_allclose(places, [0.0, 1.0, 1.0, path[-1]], atol=1e-9)


def test_the_solver_follows_few_straight_lines_and_is_the_simulation_that_made_the_curve():
    clean = measured(noise=0.0)
    path = Path(clean.time, clean.indentation, BEAD)
    times, depths = path.lines
    assert times.size < 8
    assert np.max(np.abs(np.interp(path.time, times, depths) - path.position)) < 1.1e-3 * np.ptp(path.position)
    tension = MODELS["contact"].tension(TRUTH, path, "standard")
    inside = np.abs(tension + TRUTH["force_offset"] - clean.force) < 0.02 * np.ptp(clean.force)
    assert np.mean(inside) > 0.99


def test_a_setup_gets_the_solid_that_was_fitted():
    elastic = BEAD.replaced(material=Elastic(), retardation_time=None)
    found = setup_of(VALUES, elastic)
    assert found.material == StandardLinearSolid(0.3)
    assert setup_of({"relaxed_modulus": 1e3}, elastic).relaxed_modulus == 1e3

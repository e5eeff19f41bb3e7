"""The sharp crack against closed forms at large Tabor parameters, and against boundary elements where both answer."""

import numpy as np
import pytest

from bem import (
    ConstantStress,
    Exponential,
    LennardJones,
    PiecewiseLinearProtocol,
    PronySeries,
    Scene,
    StandardLinearSolid,
    simulate,
)
from bem.methods.closed_forms import jkr, persson_brener
from bem.methods.sharp_crack import march_crack
from tests.validation.cases import ramps

SOLID = StandardLinearSolid(0.1)
K = SOLID.modulus_ratio


def records_of(tabor, times, depths, **options):
    """Records of a history whose depths are in mu h0."""
    path = PiecewiseLinearProtocol(times, np.array(depths) * tabor)
    return march_crack(Scene(tabor, SOLID), path, **options).result.records


def loop(records):
    return abs(float(np.trapezoid(records["force"], records["indentation"])))


@pytest.mark.parametrize("tabor", [100.0, 3000.0])
def test_slow_pulling_is_that_of_jkr(tabor):
    records = records_of(tabor, [0.0, 1e7 * tabor**2], [3.0, -3.0])
    assert records["force"].max() == pytest.approx(jkr.PULL_OFF_FORCE, rel=2e-3)
    lost = records["indentation"][records["contact_radius"] > 0.0][-1]
    assert lost == pytest.approx(float(jkr.fold_indentation(tabor)), rel=0.02)
    middle = np.interp(0.0, -records["indentation"], records["contact_radius"])
    assert middle == pytest.approx(float(jkr.contact_radius_from_indentation(0.0, tabor)), rel=2e-3)


def glassy_crack(deep):
    """Loss of a relaxed contact of depth `deep` that is pulled at once: hysteresis over mu, and radius of the loss.

    With the strains (1 - k) (x^2 - deep) / 2 frozen in, k g = k x^2 / 2 - rest and 2 g^2 / (pi a) = 1 / k.
    """
    start = float(jkr.contact_radius_from_indentation(deep, 1.0))
    radius = np.linspace(start, 0.5, 200_001)
    depth = (1.0 - K) * deep + K * (radius**2 - np.sqrt(2.0 * np.pi * radius / K))
    held = depth >= np.minimum.accumulate(np.append(deep, depth[:-1]))
    lost = np.argmin(depth)
    radius, depth = np.append(start, radius[~held][: lost + 1]), np.append(deep, depth[~held][: lost + 1])
    force = 2.0 / (np.pi * K) * (K * radius**3 / 3.0 + ((1.0 - K) * deep - depth) * radius)
    return abs(float(np.trapezoid(force, depth))), radius[-1]


@pytest.mark.parametrize("tabor", [300.0, 3000.0])
def test_pulled_at_once_it_is_a_glassy_crack(tabor):
    records = records_of(tabor, [0.0, 8e-5], [5.0, -3.0])
    hysteresis, radius = glassy_crack(5.0)
    assert (hysteresis, radius) == (pytest.approx(9.28, abs=0.01), pytest.approx(1.58, abs=0.01))
    assert loop(records) / tabor == pytest.approx(hysteresis, rel=5e-3)
    assert records["contact_radius"][records["contact_radius"] > 0.0][-1] == pytest.approx(radius, rel=0.02)


def test_slower_pull_loses_more():
    """A pull of 8 % of a relaxation time relaxes as it goes; what that adds vanishes in proportion to its duration."""
    slow, fast, faster = (
        loop(records_of(300.0, [0.0, duration], [5.0, -3.0])) / 300.0 for duration in (8e-3, 8e-4, 8e-5)
    )
    assert 0.06 < slow - faster < 0.08
    assert fast - faster == pytest.approx((slow - faster) / 10.0, rel=0.15)
    assert faster == pytest.approx(glassy_crack(5.0)[0], rel=3e-3)


@pytest.mark.parametrize("tabor", [300.0, 3000.0])
def test_fast_closing_gives_k_times_the_work(tabor):
    records = records_of(tabor, [0.0, 4e-4], [-1.0, 3.0])
    radius, depth = records["contact_radius"][-1], 3.0
    assert (radius**2 - depth) ** 2 / (2.0 * np.pi * radius) == pytest.approx(K, rel=0.03)


def test_slow_opening_is_persson_brener():
    """JKR's relation gives the apparent work of adhesion from force and contact radius."""
    tabor, deep = 300.0, 6.0
    records = records_of(tabor, [0.0, 10.0 * deep * tabor], [deep, 0.0])
    radius, time = records["contact_radius"], records["time"]
    chosen = np.linspace(1.05 * radius[-1], 0.95 * radius[0], 15)
    force = np.interp(-chosen, -radius, records["force"])
    near = np.interp(np.stack([0.98, 1.02])[:, None] * chosen, radius[::-1], time[::-1])
    velocity = 0.04 * chosen / (near[0] - near[1]) * persson_brener.beta_over_length_scale(tabor)
    work = np.pi * (force + 4.0 * chosen**3 / (3.0 * np.pi)) ** 2 / (8.0 * chosen**3)
    assert work.max() > 1.5
    assert np.abs(work / persson_brener.effective_energy(velocity, K) - 1.0).max() < 0.04


SPECTRUM = PronySeries([0.5, 0.3, 0.1], [0.1, 1.0, 10.0])
COMPARED = [
    (Scene(15.0, SOLID), ramps(75.0, 15.0, 3.0, 1500.0)),
    (Scene(15.0, SOLID), ramps(15.0, 15.0, 3.0, 1.5)),
    (Scene(15.0, SOLID, Exponential()), ramps(15.0, 15.0, 3.0, 15.0)),
    (Scene(15.0, SPECTRUM), ramps(75.0, 15.0, 0.01, 1500.0)),
    (Scene(15.0, SOLID, ConstantStress(0.6)), ramps(15.0, 15.0, 3.0, 15.0)),
    (Scene(15.0, SOLID, LennardJones()), ramps(15.0, 15.0, 0.01, 1500.0)),
]


@pytest.mark.parametrize(("scene", "protocol"), COMPARED)
def test_boundary_elements_agree(scene, protocol):
    expected, (result, error) = simulate(scene, protocol, 0.005), march_crack(scene, protocol.history(scene.tabor))
    unloading = result.records["time"] >= protocol.phase_times(scene.tabor)[2]
    assert 0.005 < error < 0.05
    assert result.records["force"][unloading].max() == pytest.approx(expected.pull_off_force, rel=error)
    assert loop(result.records) == pytest.approx(expected.hysteresis, rel=error)


@pytest.mark.parametrize("tabor", [100.0, 1000.0])
def test_elastic_contacts_follow_their_curve(tabor):
    path = ramps(2.0 * tabor, tabor, 0.5, tabor, -4.0 * tabor)
    curve, (result, _) = simulate(Scene(tabor), path, 1e-3), march_crack(Scene(tabor), path.history(tabor))
    assert curve.stats.method == "elastic branch"
    assert result.records["force"].max() == pytest.approx(curve.pull_off_force, rel=1e-3)
    assert loop(result.records) == pytest.approx(curve.hysteresis, rel=2e-3)
    for own, other in zip(result.jumps["indentation"], curve.jumps, strict=True):
        assert own == pytest.approx(other.indentation, rel=2e-3)


@pytest.mark.parametrize("tabor", [1e4, 1e7])
def test_the_softest_elastic_contacts_are_those_of_jkr(tabor):
    trajectory = simulate(Scene(tabor), ramps(2.0 * tabor, tabor, 0.5, tabor, -4.0 * tabor))
    assert trajectory.completed
    assert trajectory.stats.method == "sharp crack"
    assert trajectory.pull_off_force == pytest.approx(jkr.PULL_OFF_FORCE, rel=1e-4)
    assert trajectory.jumps[-1].indentation == pytest.approx(float(jkr.fold_indentation(tabor)), rel=2e-3)
    assert trajectory.stats.memory_vectors == 0


def test_strains_left_at_rest_open_an_edge():
    """A contact that has just been pressed: they open the zone of a fast edge without any pull."""
    scene = Scene(29.0, StandardLinearSolid(0.042), Exponential())
    path = PiecewiseLinearProtocol([0.0, 0.271, 0.38, 1.042], 29.0 * np.array([-2.145, 0.816, 0.816, -4.29]))
    result, error = march_crack(scene, path)
    meshed = simulate(scene, path, 5e-3, profiles=[1.042])
    assert meshed.stats.method == "boundary elements"
    assert result.records["force"].max() == pytest.approx(meshed.pull_off_force, rel=1.5 * error)
    assert result.records["contact_radius"][-1] == 0.0

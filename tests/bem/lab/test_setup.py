"""A setup in SI is the dimensionless contact, seen through its scales."""

import dataclasses
import warnings

import numpy as np
import pytest

import surrogate
from bem import Elastic, PronySeries, StandardLinearSolid, simulate
from bem.lab import EffectiveRangeWarning, ForceCurve, Setup
from bem.methods.closed_forms import jkr
from bem.results.plots import COLOURS, smooth
from tests.bem.lab import measurement

AFM = {"radius": 20e-9, "work_of_adhesion": 0.05, "relaxed_modulus": 1e9, "poisson_ratio": 0.3}
TIP = Setup(**AFM)
RELAXING = TIP.replaced(retardation_time=0.5, material=StandardLinearSolid(0.2))
SLOW, FAST = ({"loading_rate": speed, "unloading_rate": speed} for speed in (1e-8, 2e-6))
BEAD = measurement.BEAD.replaced(largest_tabor=3.0)  # of an effective range
ELASTIC_BEAD = Setup(radius=50e-6, work_of_adhesion=0.05, relaxed_modulus=2e6)


def test_the_scales_are_those_of_the_paper():
    modulus = 1e9 / (1 - 0.3**2)
    assert TIP.tabor == pytest.approx((20e-9 * 0.05**2 / (modulus**2 * 0.3e-9**3)) ** (1 / 3), rel=1e-12)
    assert TIP.force_scale == pytest.approx(np.pi * 20e-9 * 0.05)
    assert TIP.indentation_scale == 0.3e-9 == TIP.gap
    assert TIP.contact_radius_scale == pytest.approx((20e-9**2 * 0.05 / modulus) ** (1 / 3))
    assert TIP.contact_radius_scale**2 / (TIP.radius * TIP.gap) == pytest.approx(TIP.tabor)
    assert not TIP.range_is_effective


def test_a_simulation_in_si_is_the_dimensionless_one_times_its_scales():
    protocol = RELAXING.protocol(peak_indentation=2e-9, dwell_time=0.1, **SLOW)
    assert protocol.dwell_time == pytest.approx(0.2)
    assert protocol.loading_rate == pytest.approx(1e-8 * 0.5 / 0.3e-9)
    curve, trajectory = RELAXING.simulate(protocol), simulate(RELAXING.scene(), protocol)
    for name, scale in (("time", 0.5), ("indentation", 0.3e-9), ("force", RELAXING.force_scale)):
        np.testing.assert_allclose(getattr(curve, name), getattr(trajectory, name) * scale, rtol=1e-12)
    np.testing.assert_allclose(curve.contact_radius, trajectory.contact_radius * RELAXING.contact_radius_scale)
    assert curve.pull_off_force == pytest.approx(trajectory.pull_off_force * RELAXING.force_scale)
    compression = RELAXING.simulate(protocol, force_sign="compression")
    np.testing.assert_array_equal(compression.force, -curve.force)
    np.testing.assert_array_equal(compression.tension, curve.tension)
    np.testing.assert_array_equal(compression.with_sign("tension").force, curve.force)


def test_a_prediction_in_newtons_is_the_dimensionless_one_times_its_scales():
    model, setup = surrogate.load("fast"), RELAXING
    protocol = setup.protocol(peak_indentation=6e-9, dwell_time=0.1, **SLOW)
    found, curve = model.predict(setup.scene(), protocol), setup.predict(protocol, model)
    for name in ("force", "force_upper", "pull_off_interval"):
        np.testing.assert_allclose(getattr(curve, name), np.multiply(getattr(found, name), setup.force_scale))
    assert curve.pull_off_interval[0] < setup.simulate(protocol).pull_off_force < curve.pull_off_interval[1]
    pressed = setup.predict(protocol, model, force_sign="compression")
    for sign in (pressed, curve.with_sign("compression")):
        np.testing.assert_array_equal(sign.force_lower, -curve.force_upper)
        assert sign.pull_off_interval == curve.pull_off_interval
    assert np.all(pressed.force_lower <= pressed.force_upper)
    # A trajectory and its band are drawn smoothly between the steps, a force curve by its records.
    times, _, force = smooth(found)
    smoothly = (
        force + np.interp(times, found.time, end - found.force) for end in (found.force_lower, found.force_upper)
    )
    for drawn, (lower, upper) in ((found, smoothly), (pressed, (pressed.force_lower, pressed.force_upper))):
        loop = drawn.plot().axes[1]
        across = loop.collections[0].get_paths()[0].vertices[:, 1]
        ends = [lower.min(), upper.max()]
        np.testing.assert_allclose([across.min(), across.max()], ends, rtol=1e-6)
        assert [text.get_text() for text in loop.get_legend().get_texts()] == [found.model, "90 % band"]
        assert loop.lines[1].get_color() == COLOURS["fast"]
        assert [line.get_marker() for line in loop.lines].count("o") == found.detached
    np.testing.assert_array_equal(curve.shifted(force_offset=1e-9).force_lower, curve.force_lower - 1e-9)
    assert curve.to_dataframe().attrs["units"]["force_lower"] == "N"
    wide = model.predict(setup.scene(), protocol, coverage=0.98).force_upper * setup.force_scale
    np.testing.assert_allclose(setup.predict(protocol, model, coverage=0.98).force_upper, wide)
    with pytest.warns(EffectiveRangeWarning, match="depends on the effective range"):
        BEAD.predict(BEAD.protocol(peak_indentation=0.3e-6, dwell_time=0.1, **FAST), model)
    with pytest.raises(ValueError, match="spring"):
        setup.replaced(stiffness=2.0).predict(protocol, model)
    np.testing.assert_array_equal(setup.predict(protocol, model="fast").force, curve.force)
    for wrong, said in (("none", "name must be"), (5.0, "the name of one; received 5.0")):
        with pytest.raises(ValueError, match=said):
            setup.predict(protocol, model=wrong)


def test_an_elastic_soft_sphere_is_that_of_jkr_whatever_its_effective_range():
    forces = {}
    for largest in (2.0, 3.0):
        setup = ELASTIC_BEAD.replaced(largest_tabor=largest)
        assert setup.range_is_effective
        assert setup.tabor == pytest.approx(largest)
        assert setup.physical_tabor > 800.0
        protocol = setup.protocol(peak_indentation=0.3e-6, loading_rate=1e-6, unloading_rate=1e-6)
        forces[largest] = setup.simulate(protocol).pull_off_force / setup.force_scale
    assert jkr.PULL_OFF_FORCE < forces[3.0] < forces[2.0] < 1.06 * jkr.PULL_OFF_FORCE
    assert forces[3.0] == pytest.approx(jkr.PULL_OFF_FORCE, rel=0.04)


def test_a_viscoelastic_contact_at_an_effective_range_is_warned_of():
    words = "depends on the effective range of adhesion, 86.67 nm in place of 300 pm"
    with pytest.warns(EffectiveRangeWarning, match=words):
        BEAD.simulate(BEAD.protocol(peak_indentation=0.3e-6, **FAST), "draft")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ELASTIC_BEAD.replaced(largest_tabor=3.0).simulate(BEAD.protocol(peak_indentation=0.1e-6, **SLOW), "draft")
        TIP.simulate(TIP.protocol(peak_indentation=1e-9, **SLOW), "draft")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"radius": -1.0}, "radius must be a finite number greater than 0; received -1.0"),
        ({"poisson_ratio": 0.6}, "poisson_ratio must be a finite number at least 0 and at most 0.5; received 0.6"),
        ({"material": "rubber"}, "material must be one of Elastic"),
        ({"relaxed_modulus": None}, "relaxed_modulus must be a pressure, such as '2 MPa'; received None"),
        ({"relaxed_modulus": np.nan}, "relaxed_modulus must be a finite number greater than 0; received nan"),
        ({"largest_tabor": 1e8}, "largest_tabor must be a finite number"),
        ({"equilibrium_gap": 1.0}, "the Tabor parameter of a setup must be at least 1e-06"),
        *(({"stiffness": value}, "stiffness must be") for value in (0.0, -1.0, np.nan, "soft")),
        ({"material": StandardLinearSolid(0.2)}, "must be given for a StandardLinearSolid; received None"),
        ({"size": 1.0}, r"the names must be quantities of a setup; received \['size'\]"),
    ],
)
def test_what_is_no_setup_is_one_sentence(changes, message):
    with pytest.raises(ValueError, match=message):
        TIP.replaced(**changes)


def test_quantities_can_be_replaced():
    assert BEAD.replaced(modulus_ratio=0.5, radius=1e-5).material == StandardLinearSolid(0.5)
    assert BEAD.replaced(material=Elastic()).material == Elastic()
    assert TIP.replaced(stiffness=np.inf) == TIP
    # The times of a Prony series are seconds unless a unit is given.
    series = TIP.replaced(material=PronySeries([0.4, 0.2], [0.01, 1.0]))
    assert (series.time_scale, series.replaced(retardation_time=3.0).time_scale) == (1.0, 3.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"force": [0.0, -1e300]}, r"force must be at most 1e\+15 in N; received 1e\+300"),
        ({"force": [0.0]}, "force must be a one-dimensional sequence of at least 2"),
        ({"force": [0.0, 1.0, 2.0]}, "must have the same length"),
        ({"time": [1.0, 0.0]}, "time must not decrease"),
        ({"force_sign": "up"}, "force_sign must be 'tension' or 'compression'; received 'up'"),
    ],
)
def test_a_curve_checks_its_columns(changes, message):
    good = {"time": [0.0, 1.0], "indentation": [0.0, 1.0], "force": [0.0, 1.0]}
    assert len(ForceCurve(**good)) == 2
    with pytest.raises(ValueError, match=message):
        ForceCurve(**(good | changes))


def test_a_cantilever_moves_the_stage_and_not_the_sphere(tmp_path):
    tip = TIP.replaced(stiffness=2.0)
    assert tip.scene().spring == pytest.approx(2.0 * 0.3e-9 / tip.force_scale)
    protocol, rigid = (each.protocol(peak_indentation=2e-9, **SLOW) for each in (tip, TIP))
    # As much further away as the largest adhesion stretches the spring.
    stretched = 2.0 * tip.force_scale / 2.0 / tip.indentation_scale
    assert protocol.start(tip.tabor) == pytest.approx(rigid.start(tip.tabor) - stretched)
    curve = tip.simulate(protocol, "draft", force_sign="compression")
    np.testing.assert_allclose(curve.stage, curve.indentation + curve.force / 2.0, rtol=1e-9, atol=1e-18)
    assert curve.stage.max() == pytest.approx(2e-9)
    assert curve.indentation.max() < 0.95 * 2e-9
    np.testing.assert_allclose(curve.shifted(contact_point=1e-9).stage, curve.stage - 1e-9)
    assert TIP.simulate(rigid, "draft").stage is None
    curve.write(tmp_path / "curve.csv")
    again = ForceCurve.read(tmp_path / "curve.csv", force_sign="compression")
    for name in ("time", "indentation", "force", "contact_radius", "stage"):
        np.testing.assert_allclose(getattr(again, name), getattr(curve, name), rtol=1e-8)


def test_a_weight_in_newtons():
    protocol = RELAXING.force_protocol(times=[0.0, 0.1, 2.0], forces=[0.0, 5e-9, 5e-9], force_sign="compression")
    np.testing.assert_allclose(protocol.times, [0.0, 0.2, 4.0])
    np.testing.assert_allclose(protocol.forces, np.array([0.0, -5e-9, -5e-9]) / RELAXING.force_scale)
    curve = RELAXING.simulate(protocol, "draft", force_sign="compression")
    assert curve.force[-1] == pytest.approx(5e-9, rel=1e-3)
    assert curve.indentation[-1] > 1.5 * curve.indentation[0] > 0.0
    over_time, loop = curve.plot(over_time="indentation").axes
    np.testing.assert_array_equal(over_time.lines[1].get_ydata(), curve.indentation)
    np.testing.assert_array_equal(loop.lines[1].get_ydata(), curve.force)
    assert over_time.get_ylabel() == "indentation"
    assert curve.plot().axes[0].get_ylabel() == "force, compression positive"


def test_a_curve_in_newtons_is_drawn_as_a_trajectory_is():
    setup = ELASTIC_BEAD.replaced(retardation_time=0.1)
    speeds = {"loading_rate": 2e-6, "unloading_rate": 2e-4, "dwell_time": 0.3}
    protocol = setup.protocol(peak_indentation=0.5e-6, start_indentation=-1.5e-6, **speeds)
    curve = setup.simulate(protocol, "draft")
    history, loop = curve.plot().axes
    at = history.get_xticks()
    assert [text.get_text() for text in history.get_xticklabels()][:3] == ["0 s", "1 s", "1.3 s"]
    assert at[3] - at[2] > 0.15  # 10 ms of 1.31 s
    (mark,) = [line for line in loop.lines if line.get_marker() == "o"]
    assert mark.get_xydata()[0, 1] == curve.pull_off_force
    assert curve.detached
    pressed, words = curve.with_sign("compression"), ("pull-off", "largest tension", "not detached; largest tension")
    for detached, said in zip((True, None, False), words, strict=True):
        ended = dataclasses.replace(pressed, contact_radius=None, detached=detached).plot().axes[0]
        assert [text.get_text() for text in ended.texts] == [f"{said} 11.78 µN"]
        assert "compression positive" in ended.get_ylabel()

"""A fit finds what made a curve, says how well, and says what the curve does not tell."""

import json

import numpy as np
import pytest

from bem import Elastic, StandardLinearSolid
from bem.effects.scene_effects import Effects
from bem.lab import ForceCurve, Setup, fit
from bem.lab.fitting import ALL, ELASTIC, FitError
from bem.lab.fitting.model import Model, prescribed_path, straight_lines
from bem.lab.fitting.model_choice import effects_called_for, sentence
from bem.lab.fitting.parameters import PARAMETERS
from bem.lab.fitting.result import result_of
from bem.lab.fitting.search import Search
from bem.lab.fitting.starts import starting_points
from bem.lab.guess import deep_contact, first_contact, guess_setup
from bem.solver.discretisation import master_grid
from tests.bem.lab.measurement import BEAD, TRUTH, measured


@pytest.fixture(scope="module")
def curve():
    return measured()


@pytest.fixture(scope="module")
def fitted(curve):
    return fit(curve, guess_setup(curve, radius=50e-6), ALL)


def test_all_six_parameters_are_found_inside_their_intervals(fitted):
    assert set(fitted.values) == set(TRUTH) == set(fitted.intervals)
    for name, truth in TRUTH.items():
        low, high = fitted.intervals[name]
        # Two 95 % intervals: one seed in a thousand would fail by chance.
        assert abs(fitted.values[name] - truth) < high - low, name
        assert low < fitted.values[name] < high
    assert fitted.values["relaxed_modulus"] == pytest.approx(2e6, rel=0.03)
    assert fitted.setup.relaxed_modulus == fitted.values["relaxed_modulus"]


def test_the_noise_residuals_and_correlations_are_those_of_the_curve(fitted, curve):
    noise = 0.01 * np.ptp(measured(noise=0.0).force)
    assert fitted.noise == pytest.approx(noise, rel=0.15)
    np.testing.assert_allclose(fitted.residuals, fitted.curve.tension - curve.tension, rtol=1e-9)
    for one in ALL:
        assert fitted.correlations[one][one] == pytest.approx(1.0)
        for other in ALL:
            assert fitted.correlations[one][other] == pytest.approx(fitted.correlations[other][one])
            assert abs(fitted.correlations[one][other]) <= 1.0 + 1e-9


def test_the_summary_the_json_and_the_picture_say_it(fitted, tmp_path):
    text = fitted.summary()
    assert all(name in text for name in ALL)
    assert "effective range" in text
    assert "The retardation time belongs to the effective range" in text
    found = json.loads(json.dumps(fitted.to_dict(), allow_nan=False))
    assert found["values"]["relaxed_modulus"] == fitted.values["relaxed_modulus"]
    assert found["units"]["work_of_adhesion"] == "J/m^2"
    fitted.plot(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 1000


def test_a_curve_in_compression_gives_the_same_fit_in_its_own_sign(curve):
    free = ("work_of_adhesion", "force_offset")
    one = fit(curve.shifted(contact_point=TRUTH["contact_point"]), BEAD, free, accuracy="draft")
    flipped = curve.shifted(contact_point=TRUTH["contact_point"]).with_sign("compression")
    other = fit(flipped, BEAD, free, accuracy="draft")
    assert other.values["work_of_adhesion"] == pytest.approx(one.values["work_of_adhesion"], rel=1e-9)
    assert other.values["force_offset"] == pytest.approx(-one.values["force_offset"])
    low, high = other.intervals["force_offset"]
    assert low < other.values["force_offset"] < high
    np.testing.assert_allclose(other.curve.force, -one.curve.force)


def test_an_elastic_curve_is_not_fitted_with_relaxation():
    tip = Setup(radius=20e-9, work_of_adhesion=0.05, relaxed_modulus=1e9, poisson_ratio=0.3)
    path = {"peak_indentation": 3e-9, "loading_rate": 1e-8, "unloading_rate": 1e-8, "start_indentation": -6e-9}
    true = measured(tip, dwell_time=0.1, **path).shifted(
        contact_point=TRUTH["contact_point"], force_offset=TRUTH["force_offset"]
    )
    result = fit(true, tip.replaced(relaxed_modulus=0.7e9), accuracy="draft")
    assert set(result.values) == set(ELASTIC)
    assert result.setup.material == Elastic()
    assert result.sentences[0] == "The curve calls for these effects: elastic, adhesive."
    assert result.values["relaxed_modulus"] == pytest.approx(1e9, rel=0.2)


def test_the_effects_a_curve_calls_for_are_named(fitted):
    effects = effects_called_for(fitted)
    assert str(effects) == "viscoelastic, adhesive"
    assert sentence(effects) == "The curve calls for these effects: viscoelastic, adhesive."
    assert "Hertz describes it" in sentence(Effects(adhesion=False, first=0, last=1, of=1))
    assert "stays glassy" in sentence(Effects(adhesion=True, first=0, last=0, of=1))


def test_what_the_curve_does_not_determine_is_said(curve, monkeypatch):
    """Without a contact there is no modulus in a curve; a search that sees it nowhere says so."""
    far = ForceCurve(time=curve.time[:60], indentation=curve.indentation[:60], force=curve.force[:60])
    search = Search(
        Model(far, BEAD),
        ("relaxed_modulus", "force_offset"),
        {"contact_point": 0.0},
        {"relaxed_modulus": 0.02},
        {"relaxed_modulus": 1e6},
        np.ones(60),
    )
    x = search.point({"relaxed_modulus": 2e6})
    result = result_of(search, x, search.residuals(x) + 1e-8, np.column_stack([np.zeros(60), search.weights]))
    assert result.intervals["relaxed_modulus"] == (0.0, np.inf)
    assert (
        "The curve does not determine relaxed_modulus: a deeper indentation or a longer dwell would."
        in result.sentences
    )
    assert result.to_dict()["intervals"]["relaxed_modulus"] == [0.0, None]
    monkeypatch.setattr(search.model, "tension", lambda *_: None)
    with pytest.raises(FitError, match="does not complete the contact at its end"):
        result_of(search, x, np.ones(60), np.ones((60, 2)))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((BEAD, ("stiffness",)), "free must be one or more of relaxed_modulus, .*received"),
        ((BEAD, ()), "free must be one or more"),
        ((BEAD, ("force_offset",)), "with or without force_offset; received 'force_offset'"),
        ((BEAD, ("relaxed_modulus", "colour")), "received 'colour'"),
        (("bead",), "setup must be one of Setup"),
    ],
)
def test_what_is_no_fit_is_one_sentence(curve, arguments, message):
    with pytest.raises(ValueError, match=message):
        fit(curve, *arguments)


def test_a_curve_whose_time_stands_still_is_one_sentence(curve):
    still = ForceCurve(time=np.zeros(len(curve)), indentation=curve.indentation, force=curve.force)
    with pytest.raises(ValueError, match="time must increase after contact; received 0 s to the end"):
        fit(still, BEAD)


def test_a_fit_the_solver_cannot_follow_is_an_error(curve, monkeypatch):
    stuck = BEAD.replaced(largest_tabor=50.0)
    for limit in ("LARGEST_GRID", "LARGEST_LATTICE", "LARGEST_REMEMBERED"):
        monkeypatch.setattr(master_grid, limit, 10)
    with pytest.raises(FitError, match="the fit did not converge"):
        fit(curve, stuck, ("work_of_adhesion",))


def test_a_measured_path_becomes_few_straight_lines(curve):
    times, depths = straight_lines(curve.time, curve.indentation)
    assert times.size < 8
    assert np.max(np.abs(np.interp(curve.time, times, depths) - curve.indentation)) < 1.1e-3 * np.ptp(curve.indentation)


def test_a_corner_between_two_samples_is_where_the_lines_meet():
    time = np.linspace(0.0, 1.0, 101)
    path = np.minimum(2.0 * time, 1.0) - 3.0 * np.maximum(time - 0.7043, 0.0)
    times, places = straight_lines(time, path)
    np.testing.assert_allclose(times, [0.0, 0.5, 0.7043, 1.0], atol=1e-9)
    np.testing.assert_allclose(places, [0.0, 1.0, 1.0, path[-1]], atol=1e-9)


def test_the_model_is_the_simulation_that_made_the_curve():
    clean = measured(noise=0.0)
    tension = Model(clean, BEAD).tension({"contact_point": TRUTH["contact_point"]}, "standard")
    assert np.sqrt(np.mean((tension + TRUTH["force_offset"] - clean.force) ** 2)) < 0.01 * np.ptp(clean.force)


@pytest.mark.parametrize("name", list(PARAMETERS))
def test_a_parameter_goes_to_the_search_and_back(name):
    parameter = PARAMETERS[name]
    assert parameter.outer(parameter.inner(0.3)) == pytest.approx(0.3)
    assert parameter.outer(1e9) > 0.99
    assert parameter.advice


def test_guesses_are_near(curve):
    guess = guess_setup(curve, radius=50e-6, poisson_ratio=0.5)
    assert 0.3 < guess.relaxed_modulus / 2e6 < 3.0
    assert 0.3 < guess.work_of_adhesion / 0.05 < 5.0
    assert guess_setup(curve, radius=50e-6, relaxed_modulus=1e6).relaxed_modulus == 1e6
    assert StandardLinearSolid(0.3) == BEAD.material


def test_what_is_known_may_have_a_unit(curve):
    pytest.importorskip("pint")
    guess = guess_setup(curve, radius="50 um", work_of_adhesion="50 mJ/m^2")
    plain = guess_setup(curve, radius=50e-6, work_of_adhesion=0.05)
    assert guess.work_of_adhesion == pytest.approx(0.05)
    assert guess.relaxed_modulus == pytest.approx(plain.relaxed_modulus)


CANTILEVER = BEAD.replaced(stiffness=25.0)


@pytest.fixture(scope="module")
def behind_a_cantilever():
    """A curve of the stage; the indentation is that of stage and measured force, offset and noise included."""
    path = {"peak_indentation": 2.5e-6, "loading_rate": 8e-6, "unloading_rate": 8e-6, "start_indentation": -2.5e-6}
    curve = measured(CANTILEVER, **path)
    stage = curve.indentation
    return ForceCurve(time=curve.time, indentation=stage + curve.force / 25.0, force=curve.force, stage=stage)


def test_a_fit_knows_the_cantilever(behind_a_cantilever):
    curve = behind_a_cantilever
    assert curve.stiffness == pytest.approx(25.0)
    free = ("work_of_adhesion", "contact_point", "force_offset")
    result = fit(curve, BEAD, free, accuracy="draft")
    assert result.setup.stiffness == pytest.approx(25.0)
    for name in free:
        low, high = result.intervals[name]
        assert abs(result.values[name] - TRUTH[name]) < high - low, name
    model = result.curve
    np.testing.assert_allclose(model.stage, curve.stage)
    np.testing.assert_allclose(model.indentation, model.stage + model.force / 25.0)
    # It jumps into contact, as the sphere alone does not: without the cantilever the fit is worse.
    alone = ForceCurve(time=curve.time, indentation=curve.indentation, force=curve.force)
    assert fit(alone, BEAD, free, accuracy="draft").noise > 1.5 * result.noise


def test_a_stage_is_found_from_the_indentation_where_a_curve_has_none(behind_a_cantilever):
    curve = behind_a_cantilever
    alone = ForceCurve(time=curve.time, indentation=curve.indentation, force=curve.force)
    assert alone.stiffness is None
    np.testing.assert_allclose(prescribed_path(alone, CANTILEVER), curve.stage, atol=1e-18)
    np.testing.assert_array_equal(prescribed_path(curve, BEAD), curve.indentation)
    rigid = ForceCurve(time=curve.time, indentation=curve.stage, force=curve.force, stage=curve.stage)
    assert rigid.stiffness is None


def test_the_deep_part_of_an_approach_shows_where_the_solid_begins():
    """Hertz's parabola after a long soft tail."""
    depth = np.linspace(-20e-6, 5e-6, 400)
    force = -4.0 / 3.0 * 100.0 * np.sqrt(10e-6) * np.maximum(depth, 0.0) ** 1.5 - 2e-11 * np.exp(depth / 3e-6)
    curve = ForceCurve(time=np.linspace(0.0, 1.0, 400), indentation=depth, force=force)
    contact = first_contact(curve)
    assert contact.contact_point < -3e-6
    point, modulus = deep_contact(curve, contact, 10e-6)
    assert abs(point) < 0.2e-6
    assert modulus == pytest.approx(100.0, rel=0.1)
    setup = Setup(radius=10e-6, work_of_adhesion=1e-6, relaxed_modulus=50.0)
    starts = starting_points(curve, setup, contact, 1.0, ELASTIC)
    assert any(abs(start["contact_point"]) < 0.2e-6 for start in starts)
    flat = ForceCurve(time=curve.time, indentation=depth, force=-force)
    assert deep_contact(flat, contact, 10e-6) is None

"""A fit finds what made a curve, says how well, and says what the curve does not tell."""

import dataclasses
import json

import matplotlib as mpl
import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import stdtrit

from bem import simulate
from bem.discretisation import master_grid
from bem.lab import ForceCurve, Setup, fit
from bem.lab.contact_point import find_contact, noise_of
from bem.lab.fitting import ALL, FitError, guess_setup, regression, simulated
from bem.lab.fitting.curve_fit import windows_of_depth
from bem.lab.fitting.measurement import hertz_line, measurement_of, prescribed_path, slow_noise
from bem.lab.fitting.regression import Regression
from bem.lab.models import CONTACT_POINT, LADDER, Path
from bem.solver import simulation
from experiments.robustness.lab_coverage import drawn_curve
from experiments.robustness.lab_curves import CLASSES
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
    matrix = np.array([[fitted.correlations[one][other] for other in ALL] for one in ALL])
    np.testing.assert_allclose(matrix, matrix.T)
    np.testing.assert_allclose(np.diag(matrix), 1.0)
    assert np.abs(matrix).max() <= 1.0 + 1e-9


def test_the_summary_the_json_and_the_picture_say_it(fitted, tmp_path):
    text = fitted.summary()
    assert all(name in text for name in ALL)
    assert "effective range" in text
    assert "The retardation time belongs to the effective range" in text
    found = json.loads(json.dumps(fitted.to_dict(), allow_nan=False))
    assert found["values"]["relaxed_modulus"] == fitted.values["relaxed_modulus"]
    assert found["units"]["work_of_adhesion"] == "J/m^2"
    assert found["ladder"][0]["model"] == fitted.model == "solver"
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


def test_the_ladder_is_climbed_to_the_solver_where_adhesion_and_relaxation_are_both_called_for(curve):
    result = fit(curve, guess_setup(curve, radius=50e-6), accuracy="draft")
    assert result.model == "solver"
    assert result.adequate
    climbed = [rung.model for rung in result.ladder]
    assert climbed[:3] == ["hertz", "dmt", "jkr"]
    assert climbed[3:] == ["ting", "maugis", "solver"]
    assert result.values["relaxed_modulus"] == pytest.approx(2e6, rel=0.03)


@pytest.mark.parametrize("model", CLASSES)
def test_each_class_of_closed_forms_is_recognised(model):
    """Five curves a class: that nine truths of ten lie inside their intervals is one failure in thirty."""
    inside = []
    for seed in range(5):
        curve, setup, truth = CLASSES[model](np.random.default_rng([seed, 11]), noise=0.01)
        result = fit(curve, setup)
        assert model in (result.model, *result.alike)
        assert result.adequate
        for name in set(truth) & set(result.values):
            low, high = result.intervals[name]
            inside.append(low <= truth[name] <= high)
            assert abs(result.values[name] - truth[name]) < 2.0 * (high - low), (seed, name)
    assert np.mean(inside) >= 0.85


def test_a_fit_gives_the_values_of_its_model_alone():
    """First guesses for other models were among them, and Hertz's setup was viscoelastic."""
    curve, setup, _ = CLASSES["hertz"](np.random.default_rng(0), noise=0.01)
    result = fit(curve, setup)
    assert result.setup == setup.replaced(relaxed_modulus=result.values["relaxed_modulus"])
    for rung in result.ladder:
        names = [each.name for each in (*LADDER[rung.model].parameters, CONTACT_POINT)]
        assert list(rung.values) == [*names, "force_offset", "tilt", "drag"]


def test_a_power_law_is_not_taken_for_adhesion():
    time = np.linspace(0.0, 1.4, 600)
    place = 0.8e-6 - 1.6e-6 * np.abs(time / 0.7 - 1.0)
    setup = Setup(radius=5e-6, work_of_adhesion=1e-3, relaxed_modulus=1e3)
    truth = {"modulus_at_1s": 2e3, "exponent": 0.25, "contact_point": 0.0}
    tension = LADDER["ting_power_law"].tension(truth, Path(time, place, setup))
    noise = 0.002 * np.ptp(tension) * np.random.default_rng(0).standard_normal(600)
    result = fit(ForceCurve(time=time, indentation=place, force=tension + noise), setup)
    assert result.adequate
    assert [rung.model for rung in result.ladder][-2:] == ["ting", "ting_power_law"]
    assert result.model == "ting_power_law"
    assert result.values["exponent"] == pytest.approx(0.25, rel=0.02)
    # In more noise a standard linear solid leaves little to it.
    noisy = fit(ForceCurve(time=time, indentation=place, force=tension + 4.0 * noise), setup)
    assert "ting_power_law" in (noisy.model, *noisy.alike)
    # On the approach alone the residuals of adhesion are noise too.
    approach = fit(ForceCurve(time=time, indentation=place, force=tension + 4.0 * noise), setup, segment="approach")
    assert min(rung.misfit for rung in approach.ladder if rung.model in ("dmt", "jkr")) < 1.15
    assert "ting_power_law" in (approach.model, *approach.alike)
    low, high = approach.intervals["contact_point"]
    assert low < 0.0 < high


@pytest.mark.slow
@pytest.mark.parametrize("number", [5, 20])
def test_what_an_elastic_rung_leaves_of_a_memory_is_not_taken_for_slow_noise(number):
    curve, setup, _ = drawn_curve("stage", 33, number)
    assert fit(curve, setup).model == "solver"


@pytest.mark.parametrize("correlation", [0.9, 0.93])
def test_correlated_noise_is_not_taken_for_adhesion_or_relaxation_and_widens_intervals(correlation):
    inside = []
    for seed in range(10):
        curve, setup, truth = CLASSES["hertz"](np.random.default_rng([seed, 3]), noise=0.01, correlation=correlation)
        result = fit(curve, setup)
        assert result.model == "hertz", seed
        assert result.adequate
        low, high = result.intervals["relaxed_modulus"]
        inside.append(low <= truth["relaxed_modulus"] <= high)
    assert sum(inside) >= 8


@pytest.mark.parametrize("correlation", [0.0, 0.95, None])
def test_the_noise_of_slow_sums_is_found_under_what_a_fit_takes_up(correlation):
    """Noise of an autoregression, and noise whose power grows as the inverse frequency beside white noise."""
    rng, count, place = np.random.default_rng(5), 600, np.interp(np.linspace(0.0, 2.0, 600), [0, 1, 2], [-1, 1, -1])
    pressed, frequency = np.maximum(place, 0.0), np.fft.rfftfreq(2 * count)
    frequency[0] = frequency[1]
    basis, triangle = np.linalg.qr(np.column_stack([np.ones(count), place, pressed**0.5, pressed**1.5]))
    inside = []
    for white in rng.standard_normal((300, 2 * count)):
        shaped = np.fft.irfft(np.fft.rfft(white) * np.sqrt(1.0 / frequency + 40.0))[:count]
        noise = shaped if correlation is None else lfilter([1.0], [1.0, -correlation], white)[count:]
        variance, degrees = slow_noise(noise - basis @ (basis.T @ noise), basis)
        off = np.linalg.solve(triangle, basis.T @ noise)[-1] / np.linalg.norm(np.linalg.inv(triangle)[-1])
        inside.append(abs(off) < stdtrit(degrees, 0.975) * np.sqrt(variance))
    assert 0.89 < np.mean(inside) < 0.995


def test_a_neck_as_long_as_the_baseline_is_contact():
    """The retraction still pulled where the approach had been out of contact, and was taken for baseline."""
    place = np.concatenate([np.linspace(-0.6e-6, 0.6e-6, 600), np.linspace(0.6e-6, -0.6e-6, 600)])
    setup = Setup(radius=1e-5, work_of_adhesion=0.05, relaxed_modulus=1e6)
    truth = {"relaxed_modulus": 8e5, "work_of_adhesion": 0.05, "contact_point": 0.0}
    tension = LADDER["jkr"].tension(truth, Path(np.arange(1200.0), place, setup))
    fold = -0.75 * np.cbrt(np.pi**2 * 0.05**2 * 1e-5 / (8e5 / 0.75) ** 2)
    tension[(place < fold) | ((place < 0.0) & (np.arange(1200) < 600))] = 0.0
    force = tension + 1e-3 * np.ptp(tension) * np.random.default_rng(0).standard_normal(1200)
    result = fit(ForceCurve(time=np.arange(1200.0), indentation=place, force=force), setup)
    assert result.model == "jkr"
    assert result.adequate
    assert result.values["work_of_adhesion"] == pytest.approx(0.05, rel=0.01)


def test_a_force_that_noise_hides_at_first_does_not_bend_the_baseline():
    depth = np.linspace(-1.0, 1.2, 300)
    for seed in range(20):
        noise = 0.05 * np.random.default_rng(seed).standard_normal(300)
        assert find_contact(depth, np.maximum(depth, 0.0) ** 2 + noise).contact_point < 0.6


def test_a_simulation_takes_no_more_than_the_budget_of_a_search(curve, monkeypatch):
    data, asked = measurement_of(curve, BEAD), []
    monkeypatch.setattr(simulation, "simulate", lambda *_, **named: asked.append(named) or simulate(*_, **named))
    for budget in ([1e10], [1.0], None):
        LADDER["solver"].tension(TRUTH, data.path, budget=budget)
    assert [named["most_work"] for named in asked] == [1e10, 5e9, None]


def test_a_curve_without_noise_is_described():
    curve, setup, truth = CLASSES["hertz"](np.random.default_rng(2), noise=1e-9)
    result = fit(curve, setup)
    assert result.adequate
    assert result.values["relaxed_modulus"] == pytest.approx(truth["relaxed_modulus"], rel=1e-4)


def test_no_adhesion_is_allowed_and_reported_as_zero():
    found = []
    for seed in range(6):
        curve, setup, _ = CLASSES["hertz"](np.random.default_rng(seed), noise=0.01)
        found.append(fit(curve, setup, model="dmt"))
        assert fit(curve, setup).model == "hertz"
    for one in found:
        low, high = one.intervals["work_of_adhesion"]
        assert low == 0.0 < high
        assert "Hertz describes the curve as well: the work of adhesion may be zero." in one.sentences


def test_a_curve_that_no_model_describes_is_said_with_the_spread_over_depth():
    """Hertz on a solid that is ten times stiffer from a depth on."""
    depth = np.concatenate([np.linspace(-1e-6, 1e-6, 500), np.linspace(1e-6, -1e-6, 500)])
    press = np.maximum(depth, 0.0) ** 1.5 * (1.0 + 10.0 * np.maximum(depth - 0.5e-6, 0.0) / 1e-6)
    noise = 1e-12 * np.random.default_rng(0).standard_normal(1000)
    curve = ForceCurve(time=np.linspace(0.0, 1.0, 1000), indentation=depth, force=-press + noise)
    result = fit(curve, Setup(radius=1e-5, work_of_adhesion=1e-6, relaxed_modulus=1e3), model="hertz")
    assert not result.adequate
    low, high = result.intervals["relaxed_modulus"]
    shallow = 0.75 * 0.75 / np.sqrt(1e-5)
    assert low == pytest.approx(shallow, rel=0.1)
    assert high > 1.2 * low
    assert result.intervals["contact_point"] == (-np.inf, np.inf)
    assert "No model is adequate" in result.summary()
    assert "over windows of depth" in result.summary()


@pytest.mark.parametrize("segment", ["approach", "retract"])
def test_a_segment_or_a_range_alone_is_fitted(segment):
    curve, setup, truth = CLASSES["hertz"](np.random.default_rng(5), noise=0.005)
    result = fit(curve, setup, model="hertz", segment=segment)
    low, high = result.intervals["relaxed_modulus"]
    assert abs(result.values["relaxed_modulus"] - truth["relaxed_modulus"]) < high - low
    part = fit(curve, setup, model="hertz", within=(None, 0.05 * setup.radius))
    assert part.intervals["relaxed_modulus"][1] - part.intervals["relaxed_modulus"][0] > high - low
    force = fit(curve, setup, model="hertz", within=("0 N", f"{0.5 * np.ptp(curve.force)} N"))
    assert force.values["relaxed_modulus"] == pytest.approx(truth["relaxed_modulus"], rel=0.1)


def test_the_noise_is_that_of_the_points_that_count():
    curve, setup, _ = CLASSES["jkr"](np.random.default_rng(3), noise=0.01)
    for segment in ("both", "approach"):
        assert fit(curve, setup, model="jkr", segment=segment).noise == pytest.approx(noise_of(curve.force), rel=0.1)


@pytest.mark.parametrize("memory", [0.0, 0.9, 0.95])
def test_slow_noise_is_that_of_independent_points_as_strong_at_low_frequencies(memory):
    """The variance of the mean of correlated noise, known in closed form, decides how wide intervals have to be."""
    line = np.linalg.qr(np.vander(np.arange(600) / 600, 2))[0]
    draws = np.random.default_rng(0).standard_normal((100, 1000))
    noise = lfilter([1.0], [1.0, -memory], draws)[:, 400:]
    found = [slow_noise(one - line @ (line.T @ one), line)[0] for one in noise]
    assert np.mean(found) == pytest.approx((1.0 - memory) ** -2, rel=0.2)


def test_intervals_of_the_solver_are_at_least_those_of_independent_residuals():
    """Sixteen low frequencies may show less noise than there is, and the solver adds errors of its own."""
    rng = np.random.default_rng(2)
    curve, setup, _ = CLASSES["hertz"](rng)
    data = measurement_of(curve, setup)
    problem = Regression(LADDER["hertz"], data, hertz_line(data), ("relaxed_modulus", "contact_point"))
    alternating = rng.standard_normal(len(problem)) + np.where(np.arange(len(problem)) % 2, 2.0, -2.0)
    quiet = dataclasses.replace(problem.run(np.zeros(2)), residuals=alternating)
    assert quiet.variance < 0.5 * quiet.misfit**2
    solver = dataclasses.replace(quiet, problem=dataclasses.replace(problem, model=LADDER["solver"]))
    assert solver.variance == pytest.approx(quiet.misfit**2)


def test_a_curve_in_the_steps_of_the_solver_has_the_noise_of_its_baseline():
    """Half of its few long steps before contact reached into the attraction, whose bend was taken for noise."""
    setup = BEAD.replaced(equilibrium_gap=90e-9)
    ramps = {"peak_indentation": 1e-6, "loading_rate": 2e-6, "unloading_rate": 2e-6}
    simulated = setup.simulate(setup.protocol(**ramps))
    assert measurement_of(simulated, setup).noise < 1e-3 * np.ptp(simulated.force)


def test_what_the_curve_does_not_determine_is_said(curve):
    """A dwell far shorter than the retardation time shows no end of the relaxation."""
    early = fit(curve, BEAD.replaced(retardation_time=1e5), ("relaxed_modulus", "modulus_ratio", "contact_point"))
    starts = ("The curve does not determine", "The best", "The curve hardly", "No model")
    assert any(text.startswith(starts) for text in early.sentences)


RAMP = np.linspace(-1e-6, 1e-6, 300)
STILL = ForceCurve(time=np.zeros(300), indentation=RAMP, force=-np.maximum(RAMP, 0.0))
CREEP = np.interp(np.arange(600.0), [0.0, 300.0, 500.0, 599.0], [-1e-6, 1e-6, 1.001e-6, -1e-6])
LATE = ForceCurve(time=np.arange(600.0), indentation=CREEP, force=-1e-9 * (np.abs(np.arange(600) - 450) < 50))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"free": ("stiffness",)}, "free must be one or more of relaxed_modulus, .*received"),
        ({"free": ()}, "free must be one or more"),
        ({"free": ("force_offset",)}, "with or without force_offset, tilt and drag; received 'force_offset'"),
        ({"free": ("relaxed_modulus", "colour")}, "received 'colour'"),
        ({"model": "sphere"}, "model must be auto or one of hertz, cone, .*received 'sphere'"),
        ({"model": "cone"}, "half_angle must be given for a cone or a pyramid"),
        ({"segment": "middle"}, "segment must be one of both, approach, retract; received 'middle'"),
        ({"within": ("1 kg", None)}, "range must be a force, in a unit such as N; received the unit 'kg'"),
        ({"within": (1e-6, 0.0)}, "the range must grow"),
        ({"within": ("0 um", "2 uN")}, "range must be a force, in a unit such as N; received .*'um'"),
        (
            {"within": ("5 mm", "6 mm")},
            r"the range must hold 10 points in contact; received \('5 mm', '6 mm'\), which holds 0",
        ),
        ({"setup": "bead"}, "setup must be one of Setup"),
        ({"curve": LATE}, "a force curve must come into contact on its approach"),
        ({"curve": STILL}, "time must increase after contact; received 0 s to the end"),
    ],
)
def test_what_is_no_fit_is_one_sentence(curve, changes, message):
    with pytest.raises(ValueError, match=message):
        fit(**({"curve": curve, "setup": BEAD} | changes))


def test_a_search_that_spends_its_budget_says_so(curve, monkeypatch):
    monkeypatch.setattr(simulated, "_WORK", 2e7)
    spent = fit(curve, BEAD, ("relaxed_modulus", "work_of_adhesion", "contact_point"), accuracy="draft")
    assert any(text.startswith("The search did not converge") for text in spent.sentences)


@pytest.mark.parametrize("evaluations", [0.5, 3.5, 45.5])
def test_a_search_that_spends_its_budget_has_derivatives_where_it_ends(curve, monkeypatch, evaluations):
    # The second start spends the budget, when the solutions of the first are forgotten.
    start = {"relaxed_modulus": 1.8e6, "work_of_adhesion": 0.05, "contact_point": TRUTH["contact_point"]}
    budget = [0.0]
    problem = Regression(LADDER["solver"], measurement_of(curve, BEAD), start, tuple(start))
    problem.model.tension(start, problem.data.path, budget=budget)
    monkeypatch.setattr(simulated, "_WORK", -budget[0] * evaluations)
    monkeypatch.setattr(regression, "_REMEMBERED", 8)
    found = simulated.search(problem, [start, start | {"work_of_adhesion": 0.1}], "standard")
    assert not found.converged
    assert evaluations > 4.0 or problem.options["accuracy"] == "draft"  # what is finer was not paid for
    assert all(np.isfinite(ends).all() for ends in found.intervals()[0].values())


def test_windows_of_depth_in_which_the_modulus_ends_at_its_bound_do_not_count():
    """A tilted baseline looks like a wide and very soft contact in windows as shallow as these."""
    depth = np.linspace(-2e-5, 3e-7, 2000)
    tilted = 3e-5 * (depth - depth[0]) + np.random.default_rng(1).normal(0.0, 1e-11, depth.size)
    force = tilted + 4.0 / 3.0 * 2e3 / 0.75 * np.sqrt(5e-6) * np.maximum(depth, 0.0) ** 1.5
    curve = ForceCurve(time=(depth - depth[0]) / 1e-6, indentation=depth, force=force, force_sign="compression")
    data = measurement_of(curve, Setup(radius=5e-6, work_of_adhesion=1e-5, relaxed_modulus=2e3))
    assert windows_of_depth(data, hertz_line(data)) == []


def test_the_ends_of_a_valley_widen_intervals_and_never_narrow_them():
    curve, setup, _ = CLASSES["hertz"](np.random.default_rng(1), noise=0.01)
    data = measurement_of(curve, setup)
    found = Regression(LADDER["hertz"], data, hertz_line(data), ("relaxed_modulus", "contact_point")).run(np.zeros(2))
    linear = found.intervals()[0]
    assert dataclasses.replace(found, ends=(found.x, found.x)).intervals()[0] == linear
    low, high = dataclasses.replace(found, ends=(found.x - 1.0, found.x)).intervals()[0]["relaxed_modulus"]
    assert low == pytest.approx(found.values["relaxed_modulus"] / np.e)
    assert high == linear["relaxed_modulus"][1]


def test_the_points_beside_the_ends_of_an_adhesive_contact_do_not_count():
    curve, setup, _ = CLASSES["jkr"](np.random.default_rng(3), noise=0.01)
    data = measurement_of(curve, setup)
    start = hertz_line(data) | {"work_of_adhesion": 0.03}
    problem = Regression(LADDER["jkr"], data, start, tuple(start))
    problem.run(np.zeros(3))
    ends = np.flatnonzero(np.diff(problem.inside))
    assert ends.size == 2
    assert not problem.weights[[ends, ends + 1]].any()


def test_windows_that_only_pull_have_no_modulus():
    depth = 1e-6 * np.concatenate([np.linspace(-1.0, 1.0, 500), np.linspace(1.0, -1.0, 500)])
    pulled = 2e-10 * np.clip(depth / 0.8e-6, 0.0, 1.0) ** 1.5 + 1e-12 * np.random.default_rng(0).standard_normal(1000)
    pressed = 3e-9 * np.maximum(5.0 * depth / 1e-6 - 4.0, 0.0) ** 1.5
    setup = Setup(radius=1e-5, work_of_adhesion=1e-6, relaxed_modulus=1e3)
    for force, count in ((pulled, 0), (pulled - pressed, 1)):
        data = measurement_of(ForceCurve(time=np.linspace(0.0, 1.0, 1000), indentation=depth, force=force), setup)
        found = windows_of_depth(data, {"relaxed_modulus": 2.0, "contact_point": 0.0})
        assert len(found) == count
        assert all(modulus > 1e3 for modulus in found)
    # Hertz finds a contact point millimetres away, where the solver does not follow.
    pulled = ForceCurve(time=np.linspace(0.0, 1.0, 1000), indentation=depth, force=pulled)
    assert not fit(pulled, setup).adequate


def test_a_fit_the_solver_cannot_follow_is_an_error(curve, monkeypatch):
    stuck = BEAD.replaced(largest_tabor=50.0)
    for limit in ("LARGEST_GRID", "LARGEST_LATTICE", "LARGEST_REMEMBERED"):
        monkeypatch.setattr(master_grid, limit, 10)
    with pytest.raises(FitError, match="the fit did not converge"):
        fit(curve, stuck, ("work_of_adhesion",))


def test_guesses_are_near_and_what_is_known_is_kept(curve):
    guess = guess_setup(curve, radius=50e-6, poisson_ratio=0.5)
    assert 0.3 < guess.relaxed_modulus / 2e6 < 3.0
    assert 0.3 < guess.work_of_adhesion / 0.05 < 5.0
    known = guess_setup(curve, radius="50 um", work_of_adhesion="50 mJ/m^2")
    assert known.work_of_adhesion == pytest.approx(0.05)
    assert known.relaxed_modulus == pytest.approx(guess.relaxed_modulus)


CANTILEVER = BEAD.replaced(stiffness=25.0)


@pytest.fixture(scope="module")
def behind_a_cantilever():
    path = {"peak_indentation": 2.5e-6, "loading_rate": 8e-6, "unloading_rate": 8e-6, "start_indentation": -2.5e-6}
    return measured(CANTILEVER, **path)


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


def hertzian(noise=0.0, unit=1.0):
    """A bead of 5 um on 10 kPa, measured in units of a newton."""
    depth = 1e-6 * np.concatenate([np.linspace(-1.0, 1.0, 200), np.linspace(1.0, -1.0, 200)])
    force = -4.0 / 3.0 * 1e4 / 0.75 * np.sqrt(5e-6) * np.maximum(depth, 0.0) ** 1.5
    force += np.random.default_rng(0).normal(0.0, noise, depth.size) if noise else 0.0
    return ForceCurve(time=np.linspace(0.0, 2.0, depth.size), indentation=depth, force=force / unit)


def test_a_curve_without_any_noise_or_adhesion_is_fitted():
    curve = hertzian()
    found = fit(curve, guess_setup(curve, radius=5e-6))
    assert found.model == "hertz"
    assert found.values["relaxed_modulus"] == pytest.approx(1e4, rel=1e-6)


def test_a_force_in_another_unit_is_asked_about():
    curve = hertzian(1e-11, 1e-9)
    assert any("are the units right?" in one for one in fit(curve, guess_setup(curve, radius=5e-6)).sentences)


def test_residuals_that_chance_may_explain_are_named_and_do_not_hide_in_the_picture(tmp_path):
    tip = Setup(radius=20e-9, work_of_adhesion=0.05, relaxed_modulus=1e9, poisson_ratio=0.35)
    rates = {"loading_rate": 1e-7, "unloading_rate": 1e-7}
    curve = tip.simulate(tip.protocol(peak_indentation=3e-9, start_indentation=-2e-8, **rates))
    found = fit(curve, tip.replaced(work_of_adhesion=0.04), free="work_of_adhesion", accuracy="draft")
    assert any("too short to tell whether chance" in one for one in found.sentences)
    sizes = np.sort(np.abs(found.residuals))
    assert sizes[-1] > 3.0 * sizes[-len(sizes) // 20]  # at the jump
    with mpl.rc_context({"svg.fonttype": "none"}):
        found.plot(tmp_path / "fit.svg")
    assert "points beyond" in (tmp_path / "fit.svg").read_text(encoding="utf-8")

"""What a fit is made of: contact, baseline, noise and jumps of a curve, least squares and their intervals."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import stdtrit

from bem import simulate, simulation
from bem.lab import ForceCurve, Setup, fit
from bem.lab.contact_point import find_contact, noise_of
from bem.lab.fitting import regression, search
from bem.lab.fitting.fitted import run
from bem.lab.fitting.measurement import hertz_line, measurement_of, slow_noise
from bem.lab.fitting.regression import Regression
from bem.lab.models import MODELS
from bem.problem.scene import LARGEST_TABOR
from experiments.robustness.lab_coverage import drawn_curve
from tests.bem.lab.measurement import BEAD, TRUTH, closed_form, loop, measured, over_time


@pytest.fixture(scope="module")
def curve():
    return measured()


@pytest.fixture(scope="module")
def fitted():
    """Hertz on a curve of Hertz."""
    curve, setup, _ = closed_form("hertz", 1)
    return fitted_by("hertz", measurement_of(curve, setup))


def fitted_by(model, data, **further):
    start = hertz_line(data) | further
    return run(Regression(MODELS[model], data, start, tuple(start)), np.zeros(len(start)))


def test_baseline_noise_and_contact_point_are_found(curve):
    contact = curve.contact()
    noise = 0.01 * np.ptp(measured(noise=0.0).force)
    assert contact.force_offset == pytest.approx(TRUTH["force_offset"], abs=noise)
    assert contact.noise == pytest.approx(noise, rel=0.3)
    assert noise_of(curve.force) == pytest.approx(noise, rel=0.3)
    # Attraction of short range is felt where the undeformed sphere would touch, within two samples.
    assert abs(contact.contact_point - TRUTH["contact_point"]) < 2.0 * 2e-6 * float(np.median(np.diff(curve.time)))
    shifted = curve.shifted(contact_point=contact.contact_point, force_offset=contact.force_offset).contact()
    assert shifted.contact_point == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("part", "size", "message"),
    [
        (slice(None), 0.0, "the approach shows no contact"),
        (slice(100, None), 1.0, "must begin before contact or at it"),
        (slice(-30, None), 1.0, "at least 20 points up to its deepest one"),
    ],
)
def test_a_curve_without_contact_or_baseline_is_refused(curve, part, size, message):
    force = size * curve.force + (1.0 - size) * 1e-9 * np.random.default_rng(0).standard_normal(len(curve))
    with pytest.raises(ValueError, match=message):
        ForceCurve(time=curve.time[part], indentation=curve.indentation[part], force=force[part]).contact()


def test_a_force_that_noise_hides_at_first_does_not_bend_the_baseline():
    depth = np.linspace(-1.0, 1.2, 300)
    for seed in range(20):
        noise = 0.05 * np.random.default_rng(seed).standard_normal(300)
        assert find_contact(depth, np.maximum(depth, 0.0) ** 2 + noise).contact_point < 0.6


def test_noise_creep_and_steps_out_of_contact_are_no_second_cycle():
    knots = [-1.0, -3.0, -1.0, 1.0, 1.15, 1.1, -2.0, -1.0]
    path = np.interp(np.arange(1400.0), np.arange(8) * 200.0, knots)
    path = 1e-6 * (path + 0.05 * np.random.default_rng(0).standard_normal(1400))
    curve = over_time(path, -1e-3 * np.maximum(path, 0.0))
    data = measurement_of(curve, BEAD)
    # The approach ends where the noise no longer shows that it goes on.
    assert 0.42 < data.time[data.segments.top] < data.time[data.segments.leaves] < 0.74


def test_the_jumps_into_and_out_of_contact_are_found_and_a_smooth_curve_has_none():
    curve, setup, _ = closed_form("jkr", 3, noise=0.002)
    into, out = (jump.time for jump in measurement_of(curve, setup).jumps)
    steps, half = np.diff(curve.tension), len(curve) // 2
    spacing = 3.0 * float(np.median(np.diff(curve.time)))
    assert into == pytest.approx(curve.time[np.argmax(steps[:half])], abs=spacing)
    assert out == pytest.approx(curve.time[half + np.argmin(steps[half:])], abs=spacing)
    assert measurement_of(*closed_form("hertz", 3)[:2]).jumps == ()


@pytest.mark.parametrize("memory", [0.0, 0.95])
def test_slow_noise_is_that_of_independent_points_as_strong_at_low_frequencies(memory):
    """The variance of the mean of correlated noise, known in closed form, decides how wide intervals have to be."""
    line = np.linalg.qr(np.vander(np.arange(600) / 600, 2))[0]
    draws = np.random.default_rng(0).standard_normal((100, 1000))
    noise = lfilter([1.0], [1.0, -memory], draws)[:, 400:]
    found = [slow_noise(one - line @ (line.T @ one), line)[0] for one in noise]
    assert np.mean(found) == pytest.approx((1.0 - memory) ** -2, rel=0.2)


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


def test_intervals_of_the_solver_are_at_least_those_of_independent_residuals(fitted):
    """Sixteen low frequencies may show less noise than there is, and the solver adds errors of its own."""
    problem, rng = fitted.problem, np.random.default_rng(2)
    alternating = rng.standard_normal(len(problem)) + np.where(np.arange(len(problem)) % 2, 2.0, -2.0)
    quiet = dataclasses.replace(fitted, residuals=alternating)
    assert quiet.slow[0] < 0.5 * quiet.misfit**2
    solver = dataclasses.replace(quiet, problem=dataclasses.replace(problem, model=MODELS["contact"]))
    assert solver.slow[0] == pytest.approx(quiet.misfit**2)


def test_intervals_of_the_solver_include_its_own_error(fitted):
    """Hardly any noise and many points would else leave an interval far below what the solver errs by."""
    problem, less = fitted.problem, 1e-4
    quiet = dataclasses.replace(problem.data, noise=less * problem.data.noise)
    widths = []
    for name in ("hertz", "contact"):
        again = dataclasses.replace(problem, model=MODELS[name], data=quiet)
        again.weights = problem.weights
        few = dataclasses.replace(fitted, problem=again, jacobian=fitted.jacobian / less)
        low, high = few.intervals()[0]["relaxed_modulus"]
        widths.append(np.log(high / low))
    assert widths[0] < 1e-4
    assert 1e-3 < widths[1] < 5e-2


def test_derivatives_are_taken_within_a_few_standard_deviations():
    """Near the pull-off, 2 % of the modulus change the force by forty: intervals along the valley were a third."""
    curve, setup, truth = drawn_curve("sphere", 36, 1)
    data = measurement_of(curve, setup.replaced(largest_tabor=LARGEST_TABOR))
    names = ("work_of_adhesion", "contact_point")
    problem = Regression(MODELS["contact"], data, truth, names)
    problem.options = {"jumps": data.jumps}
    problem.residuals(np.zeros(2))
    problem.narrow_steps(problem.derivatives(np.zeros(2)))
    changes = problem.steps * np.linalg.norm(problem.derivatives(np.zeros(2)), axis=0)
    assert problem.steps[0] < 0.2 * MODELS["contact"].difference
    assert changes.max() < 12.0


def test_the_points_beside_the_ends_of_an_adhesive_contact_do_not_count():
    problem = fitted_by("jkr", measurement_of(*closed_form("jkr", 3)[:2]), work_of_adhesion=0.03).problem
    ends = np.flatnonzero(np.diff(problem.inside))
    assert ends.size == 2
    assert not problem.weights[[ends, ends + 1]].any()


def test_points_that_a_jump_passes_have_no_derivative():
    """One of them counted as hundreds of others: the interval of the contact point was a tenth of what it is."""
    curve, setup, truth = drawn_curve("stage", 34, 0)
    model, data = MODELS["contact"], measurement_of(curve, setup.replaced(largest_tabor=LARGEST_TABOR))
    lengths = []
    for difference in (0.02, 0.005):
        problem = Regression(dataclasses.replace(model, difference=difference), data, truth, ("contact_point",))
        problem.options = {"jumps": data.jumps}
        problem.residuals(np.zeros(1))
        lengths.append(float(np.linalg.norm(problem.derivatives(np.zeros(1))[: len(problem)])))
    assert lengths[0] == pytest.approx(lengths[1], rel=0.05)


def test_a_simulation_takes_no_more_than_the_budget_of_a_search(curve, monkeypatch):
    data, asked = measurement_of(curve, BEAD), []
    monkeypatch.setattr(simulation, "simulate", lambda *_, **named: asked.append(named) or simulate(*_, **named))
    for budget in ([1e10], [1.0], None):
        MODELS["contact"].tension(TRUTH, data, budget=budget)
    # A search may wander to scenes that take a minute.
    assert [named["most_work"] for named in asked] == [1e10, 5e9, 5e9]


@pytest.mark.parametrize("evaluations", [0.5, 3.5, 45.5])
def test_a_search_that_spends_its_budget_has_derivatives_where_it_ends(curve, monkeypatch, evaluations):
    # The second start spends the budget, when the solutions of the first are forgotten.
    start = {"relaxed_modulus": 1.8e6, "work_of_adhesion": 0.05, "contact_point": TRUTH["contact_point"]}
    budget, problem = [0.0], Regression(MODELS["contact"], measurement_of(curve, BEAD), start, tuple(start))
    problem.model.tension(start, problem.data, budget=budget)
    monkeypatch.setattr(search, "_WORK", -budget[0] * evaluations)
    monkeypatch.setattr(regression, "_REMEMBERED", 8)
    best = search.search(problem, start, "standard")
    assert not best.converged
    assert evaluations > 4.0 or problem.options["accuracy"] == search._ACCURACY  # what is finer was not paid for
    assert all(np.isfinite(ends).all() for ends in best.intervals()[0].values())


def test_a_curve_that_only_pulls_is_no_fit_of_hertz():
    """Hertz finds a contact point millimetres away, where the solver does not follow."""
    depth = 1e-6 * loop(500)
    pulled = 2e-10 * np.clip(depth / 0.8e-6, 0.0, 1.0) ** 1.5 + 1e-12 * np.random.default_rng(0).standard_normal(1000)
    setup = Setup(radius=1e-5, work_of_adhesion=1e-6, relaxed_modulus=1e3)
    assert not fit(over_time(depth, pulled), setup).adequate

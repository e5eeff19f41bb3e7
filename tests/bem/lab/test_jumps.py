"""Jumps of a measured force, and how far a model's are from them."""

import numpy as np
import pytest

from bem import StandardLinearSolid, simulate
from bem.lab import ForceCurve, Setup, fit
from bem.lab.fitting import ALL, curve_fit
from bem.lab.fitting.jumps import as_residuals, instants_of, lateness, measured_jumps, shares_between, weights_of
from bem.lab.guess import guess_setup
from experiments.lab import lab_coverage

TIME = np.linspace(0.0, 1.0, 201)
SAMPLE = 0.005


def jumping(instant: float, height: float = -1e-6) -> ForceCurve:
    """A noisy force that is steep after 0.5 s and jumps at an instant."""
    steep = 1e-9 * np.random.default_rng(0).standard_normal(201) + 1e-5 * np.maximum(TIME - 0.5, 0.0)
    return ForceCurve(time=TIME, indentation=TIME, force=np.where(instant < TIME, steep + height, steep))


def test_a_jump_weighs_little_and_a_steep_force_as_much_as_any():
    weights = weights_of(jumping(2.0), 1e-9)
    assert weights.min() == pytest.approx(weights.max())
    weights = weights_of(jumping(0.7013), 1e-9)
    away = np.abs(TIME - 0.7025)
    assert weights[away < 0.006].max() < 0.1 * weights[away > 0.026].min()


@pytest.mark.parametrize("height", [-1e-6, 1e-6])
def test_a_jump_is_found_between_the_samples_it_falls_between(height):
    assert measured_jumps(jumping(2.0), 1e-9) == ()
    (jump,) = measured_jumps(jumping(0.7013, height), 1e-9)
    assert jump.time == pytest.approx(0.7025)
    assert jump.level == pytest.approx(2e-6 + 0.5 * height, abs=0.1e-6)
    assert jump.rises == (height > 0.0)
    assert jump.deviation == pytest.approx(SAMPLE / np.sqrt(12.0))


def test_the_nearest_passage_of_the_level_in_the_same_direction_counts():
    jumps = measured_jumps(jumping(0.7013), 1e-9)
    time = np.array([0.0, 0.2, 0.3, 0.6, 0.6, 0.9, 1.0])
    tension = np.array([0.0, 3e-6, 0.0, 4e-6, 0.0, 2e-6, 0.0])
    (instant,) = instants_of(jumps, time, tension)
    assert instant == pytest.approx(0.6)
    assert np.isnan(instants_of(jumps, time, 0.1 * tension)[0])


def test_lateness_counts_standard_deviations_and_far_ones_as_their_logarithm():
    jumps = measured_jumps(jumping(0.7013), 1e-9)
    deviation = np.hypot(SAMPLE / np.sqrt(12.0), 0.001)
    instants = np.array([0.7025 + deviation]), np.array([0.2]), np.array([np.nan])
    late, early, never = (lateness(jumps, instant, 0.001, 1.0)[0] for instant in instants)
    assert late == pytest.approx(1.0)
    assert early == pytest.approx(-0.5025 / deviation)
    assert never == pytest.approx(1.0 / deviation)
    assert as_residuals(np.array([1.0]))[0] == pytest.approx(1.0, rel=1e-3)
    assert 30.0 < as_residuals(np.array([never]))[0] < 0.6 * never


def test_the_points_between_the_jumps_of_curve_and_model_count_little_where_those_are_close():
    jumps = measured_jumps(jumping(0.7013), 1e-9)
    close = shares_between(jumps, np.array([0.6512]), np.array([3.0]), TIME, SAMPLE)
    assert TIME[close < 1.0][[0, -1]] == pytest.approx([0.65, 0.7], abs=SAMPLE)
    assert (close < 1.0).sum() == pytest.approx(11, abs=1)
    assert close.min() == pytest.approx(0.01, rel=0.02)
    far = shares_between(jumps, np.array([0.1]), np.array([-300.0]), TIME, SAMPLE)
    assert far.min() > 0.98
    assert np.all(shares_between(jumps, np.array([np.nan]), np.array([700.0]), TIME, SAMPLE) == 1.0)


@pytest.mark.parametrize("number", [7, 10])
def test_a_fit_finds_the_jumps_of_a_cantilever(number, monkeypatch):
    # The forces alone leave the search where its jump is several samples from the measured one.
    rng = np.random.default_rng([0, 1, number])
    truth = lab_coverage.drawn(rng, "stage")
    curve = lab_coverage.measured(truth, rng)
    searches = []
    keep = curve_fit.result_of
    monkeypatch.setattr(curve_fit, "result_of", lambda search, *found: searches.append(search) or keep(search, *found))
    result = fit(curve, guess_setup(curve, radius=lab_coverage.RADIUS), lab_coverage.ALL)
    late = searches[-1].model.late()
    assert late.size >= 1
    assert np.all(np.abs(late) < 3.0)
    for name, (low, high) in result.intervals.items():
        assert low <= truth[name] <= high, name
    assert result.noise == pytest.approx(0.01 * np.ptp(curve.force), rel=0.1)


def curve_of(setup, path, points, noise, offset=0.0):
    """A noisy curve behind the setup's spring."""
    trajectory = simulate(setup.scene(), path, 5e-4)
    instants = np.linspace(0.0, trajectory.time[-1], points)
    force = setup.force_scale * trajectory.at(instants)
    force += offset + noise * np.ptp(force) * np.random.default_rng(0).standard_normal(points)
    stage = setup.indentation_scale * path.history(setup.tabor).indentation_at(instants)
    return ForceCurve(
        time=setup.time_scale * instants, indentation=stage + force / setup.stiffness, force=force, stage=stage
    )


def test_small_forces_and_many_points_leave_no_bias():
    gel = Setup(
        radius=5e-6,
        work_of_adhesion=5e-4,
        relaxed_modulus=2e4,
        material=StandardLinearSolid(0.3),
        retardation_time=0.2,
        stiffness=0.05,
    )
    path = gel.protocol(
        peak_indentation=4e-7, loading_rate=2e-6, dwell_time=1.0, unloading_rate=2e-6, start_indentation=-9e-7
    )
    curve = curve_of(gel, path, 3000, 0.01)
    result = fit(curve, guess_setup(curve, radius=5e-6), ALL)
    for name, (low, high) in result.intervals.items():
        truth = getattr(gel, name, {"modulus_ratio": 0.3}.get(name, 0.0))
        assert low <= truth <= high, name


def test_a_soft_spring_jumps_from_afar_and_a_fast_memory_is_found():
    bead = Setup(
        radius=50e-6,
        work_of_adhesion=0.05,
        relaxed_modulus=2e6,
        material=StandardLinearSolid(0.3),
        retardation_time=0.05,
        stiffness=3.0,
    )
    path = bead.protocol(
        peak_indentation=1.5e-6, loading_rate=2e-5, dwell_time=0.2, unloading_rate=2e-5, start_indentation=-6e-6
    )
    curve = curve_of(bead, path, 5000, 0.003)
    result = fit(curve, guess_setup(curve, radius=50e-6), ALL)
    assert result.noise == pytest.approx(0.003 * np.ptp(curve.force), rel=0.1)
    assert result.values["retardation_time"] == pytest.approx(0.05, rel=0.3)
    assert result.values["work_of_adhesion"] == pytest.approx(0.05, rel=0.05)
    # The attraction far away is not taken for an offset.
    assert abs(result.values["force_offset"]) < 3e-9

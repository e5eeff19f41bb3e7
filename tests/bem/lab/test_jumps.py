"""Jumps of a measured force, and how far a model's are from them."""

import numpy as np
import pytest

from bem.lab import ForceCurve, fit
from bem.lab.fitting.jumps import between, instants_of, lateness, measured_jumps, weights_of
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
    (late,) = lateness(jumps, np.array([0.7025 + deviation]), 0.001, 1.0)
    assert late == pytest.approx(1.0, rel=1e-3)
    (early,) = lateness(jumps, np.array([0.2]), 0.001, 1.0)
    (never,) = lateness(jumps, np.array([np.nan]), 0.001, 1.0)
    assert -150.0 < early < -30.0 < 30.0 < never < 200.0


def test_the_points_between_the_jumps_of_curve_and_model_are_left_out():
    jumps = measured_jumps(jumping(0.7013), 1e-9)
    left = between(jumps, np.array([0.6512]), TIME, SAMPLE)
    assert TIME[left][[0, -1]] == pytest.approx([0.65, 0.7], abs=SAMPLE)
    assert left.sum() == pytest.approx(11, abs=1)
    assert not between(jumps, np.array([np.nan]), TIME, SAMPLE).any()


@pytest.mark.parametrize("number", [7, 10])
def test_a_fit_finds_the_jumps_of_a_cantilever(number):
    # The forces alone leave the search where its jump is several samples from the measured one.
    rng = np.random.default_rng([0, 1, number])
    truth = lab_coverage.drawn(rng, "stage")
    curve = lab_coverage.measured(truth, rng)
    result = fit(curve, guess_setup(curve, radius=lab_coverage.RADIUS), lab_coverage.ALL)
    for name, (low, high) in result.intervals.items():
        assert low <= truth[name] <= high, name
    assert result.noise == pytest.approx(0.01 * np.ptp(curve.force), rel=0.1)

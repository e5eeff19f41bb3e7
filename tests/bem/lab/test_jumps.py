"""Jumps of a measured force, and fits of curves that jump."""

import numpy as np
import pytest

from bem.lab import fit
from bem.lab.fitting import ALL, guess_setup
from bem.lab.fitting.measurement import measurement_of
from experiments.robustness import lab_coverage
from experiments.robustness.lab_curves import CLASSES
from tests.bem.lab.measurement import BEAD, measured


def test_the_jumps_into_and_out_of_contact_are_found():
    curve, setup, _ = CLASSES["jkr"](np.random.default_rng(3), noise=0.002)
    into, out = (jump.time for jump in measurement_of(curve, setup).jumps)
    steps = np.diff(curve.tension)
    half = len(curve) // 2
    spacing = 3.0 * float(np.median(np.diff(curve.time)))
    assert into == pytest.approx(curve.time[np.argmax(steps[:half])], abs=spacing)
    assert out == pytest.approx(curve.time[half + np.argmin(steps[half:])], abs=spacing)


def test_a_smooth_curve_has_no_jump():
    curve, setup, _ = CLASSES["hertz"](np.random.default_rng(3), noise=0.01)
    assert measurement_of(curve, setup).jumps == ()


@pytest.mark.parametrize(("seed", "number"), [(0, 7), (0, 10), (7, 12)])
def test_a_fit_finds_the_jumps_of_a_cantilever(seed, number):
    # The forces alone leave the search where its jump is several samples from the measured one.
    rng = np.random.default_rng([seed, 1, number])
    truth = lab_coverage.drawn(rng, "stage")
    curve = lab_coverage.measured(truth, rng)
    result = fit(curve, guess_setup(curve, radius=lab_coverage.RADIUS), ALL)
    for name, (low, high) in result.intervals.items():
        assert abs(result.values[name] - truth[name]) < high - low, name
    assert result.noise == pytest.approx(0.01 * np.ptp(curve.force), rel=0.1)


NOWHERE = {"contact_point": 0.0, "force_offset": 0.0}


def test_small_forces_and_many_points_leave_no_bias():
    changes = {"radius": 5e-6, "work_of_adhesion": 5e-4, "relaxed_modulus": 2e4, "retardation_time": 0.2}
    gel = BEAD.replaced(**changes, stiffness=0.05)
    path = {"peak_indentation": 4e-7, "dwell_time": 1.0, "start_indentation": -9e-7}
    curve = measured(gel, 0.01, 3000, NOWHERE, 5e-4, **path)
    result = fit(curve, guess_setup(curve, radius=5e-6), ALL)
    for name, (low, high) in result.intervals.items():
        truth = getattr(gel, name, {"modulus_ratio": 0.3}.get(name, 0.0))
        assert low <= truth <= high, name


def test_a_soft_spring_jumps_from_afar_and_a_fast_memory_is_found():
    bead = BEAD.replaced(retardation_time=0.05, stiffness=3.0)
    path = {"peak_indentation": 1.5e-6, "loading_rate": 2e-5, "unloading_rate": 2e-5, "start_indentation": -6e-6}
    curve = measured(bead, 0.003, 5000, NOWHERE, 5e-4, dwell_time=0.2, **path)
    result = fit(curve, guess_setup(curve, radius=50e-6), ALL)
    assert result.noise == pytest.approx(0.003 * np.ptp(curve.force), rel=0.1)
    assert result.values["retardation_time"] == pytest.approx(0.05, rel=0.3)
    assert result.values["work_of_adhesion"] == pytest.approx(0.05, rel=0.05)
    # The attraction far away is not taken for an offset.
    assert abs(result.values["force_offset"]) < 3e-9

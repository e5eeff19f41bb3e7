"""Pull-off after a relaxed, deep preload against the theory of a viscoelastic crack.

The fourteen protocols and their crack velocities are the paper's (appendix "BEM/Persson-Brener reference mapping"); the
amplifications at five rates were found by an independent solver.
"""

import functools

import numpy as np
import pytest

from bem import Scene, StandardLinearSolid
from bem.methods.closed_forms import jkr, persson_brener
from tests.validation.cases import completed, ramps

SCENE = Scene(tabor=3.24, material=StandardLinearSolid(modulus_ratio=0.1))
CRACK_VELOCITY = {
    0.1: 6.00e-2,
    0.178: 1.01e-1,
    0.316: 1.69e-1,
    0.562: 2.69e-1,
    1.0: 4.21e-1,
    5.62: 2.31,
    10.0: 3.86,
    17.8: 6.58,
    31.6: 1.12e1,
    56.2: 1.98e1,
    100.0: 9.74e1,
    178.0: 3.23e2,
    316.0: 7.58e2,
    562.0: 1.51e3,
}
AMPLIFICATION = {0.1: 1.216, 1.0: 2.012, 10.0: 4.099, 100.0: 8.789, 562.0: 10.166}
SOME, ALL = tuple(AMPLIFICATION), tuple(CRACK_VELOCITY)


@functools.cache
def amplification(rate):
    """Pull-off force over the JKR one at an unloading rate."""
    protocol = ramps(80.0, 1.3895, 3.0, rate)
    trajectory = completed(SCENE, protocol, "standard")
    return trajectory.pull_off_force / jkr.PULL_OFF_FORCE


@pytest.mark.parametrize("rates", [SOME, pytest.param(ALL, marks=pytest.mark.slow)])
def test_protocols_are_close_to_the_theory(rates):
    theory = persson_brener.effective_energy([CRACK_VELOCITY[rate] for rate in rates], 0.1)
    deviation = np.abs(np.array([amplification(rate) for rate in rates]) / theory - 1.0)
    assert np.max(deviation) < 0.08
    assert np.median(deviation) < 0.035


@pytest.mark.parametrize("rate", SOME)
def test_an_independent_solver_agrees(rate):
    assert amplification(rate) == pytest.approx(AMPLIFICATION[rate], rel=0.01)


@pytest.mark.parametrize("rates", [SOME, pytest.param(ALL, marks=pytest.mark.slow)])
def test_faster_pulling_needs_more_force(rates):
    values = np.array([amplification(rate) for rate in sorted(rates)])
    assert np.all(np.diff(values) > 0.0)
    assert 1.0 < values[0] < values[-1] < 1.05 / 0.1

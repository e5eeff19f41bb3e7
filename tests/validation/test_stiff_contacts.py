"""Stiff contacts: nearly rigid ones, stiff glasses, long dwells. Residuals of the equilibria must not set the steps."""

import numpy as np
import pytest

from bem import HardContact, LennardJones, Scene, simulate
from bem.problem.materials import StandardLinearSolid
from bem.problem.protocol import PiecewiseLinearProtocol
from tests.validation.cases import ramps

MOST_STEPS = 8_000


def drawn(count, seed):
    rng = np.random.default_rng(seed)
    for number in range(count):
        tabor, ratio = 10.0 ** rng.uniform(-2.0, np.log10(0.5)), 10.0 ** rng.uniform(-3.0, np.log10(0.3))
        adhesion = HardContact() if rng.random() < 0.4 else LennardJones()
        peak, dwell = 10.0 ** rng.uniform(-2.0, 1.5), 10.0 ** rng.uniform(-4.0, 5.0)
        loading, unloading = 10.0 ** rng.uniform(-3.0, 4.0, 2)
        protocol = ramps(peak, loading, dwell, unloading)
        yield Scene(tabor, StandardLinearSolid(ratio), adhesion), protocol, ("draft", "standard")[number % 2]


def test_nearly_rigid_dwell_takes_few_steps():
    scene = Scene(0.03, StandardLinearSolid(0.01))
    protocol = ramps(0.3, 50.0, 1e5, 50.0)
    trajectory = simulate(scene, protocol, "draft")
    assert trajectory.completed
    assert trajectory.stats.steps < 400


def test_looser_takes_no_more_steps():
    scene = Scene(0.12, StandardLinearSolid(0.001), HardContact())
    protocol = PiecewiseLinearProtocol([0.0, 30.0, 30.1], [0.07, -1.0, 0.07])
    draft, standard = (simulate(scene, protocol, accuracy) for accuracy in ("draft", "standard"))
    assert draft.completed
    assert draft.stats.steps <= standard.stats.steps < 1000
    assert draft.hysteresis == pytest.approx(standard.hysteresis, rel=0.01)


@pytest.mark.parametrize(("count", "seed"), [(60, 1), pytest.param(3000, 2, marks=pytest.mark.slow)])
def test_random_stiff_contacts_are_followed(count, seed):
    for scene, protocol, accuracy in drawn(count, seed):
        trajectory = simulate(scene, protocol, accuracy)
        case = f"{scene}, {protocol}, {accuracy}"
        assert trajectory.completed, f"{trajectory.status}: {case}"
        assert trajectory.stats.steps <= MOST_STEPS, f"{trajectory.stats.steps} steps: {case}"
        # A step costs a few dozen microseconds; so many iterations would be seconds.
        assert trajectory.stats.iterations <= 20 * MOST_STEPS, f"{trajectory.stats.iterations} iterations: {case}"

"""Loops of elastic contacts: what the jumps lose, by the balance of energy."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from bem import HardContact, PiecewiseLinearProtocol, Scene, simulate
from tests.validation.cases import ramps, stage_area

DEEP = ramps(30.0, 1.0, 0.0, 1.0)


@pytest.mark.parametrize("tabor", [1.1, 1.5, 2.0, 3.0])
def test_deep_loop_meets_its_target(tabor):
    trajectory, fine = (simulate(Scene(tabor), DEEP, accuracy) for accuracy in ("standard", 5e-4))
    assert len(trajectory.jumps) >= 2
    assert trajectory.hysteresis == pytest.approx(fine.hysteresis, rel=2.0 * trajectory.hysteresis_accuracy)


@pytest.mark.parametrize("tabor", [0.7, 0.8, 0.9])
def test_small_loss_states_its_error(tabor):
    trajectory, fine = (simulate(Scene(tabor), DEEP, accuracy) for accuracy in ("standard", 5e-4))
    assert trajectory.hysteresis_accuracy > 2.0 * trajectory.accuracy
    assert abs(trajectory.hysteresis - fine.hysteresis) <= trajectory.accuracy * max(0.5, trajectory.hysteresis)
    # What is found where no branch folds back is no jump.
    assert all(abs(jump.energy_lost) < 1e-4 for jump in trajectory.jumps) or tabor > 0.7


def test_few_loops_miss_a_small_jump():
    missed = 0
    for tabor, peak in itertools.product(np.linspace(0.8, 1.2, 28), (3.0, 10.0, 20.0, 30.0)):
        protocol = replace(DEEP, peak_indentation=peak)
        trajectory, fine = (simulate(Scene(tabor), protocol, accuracy) for accuracy in ("standard", 5e-4))
        missed += len(trajectory.jumps) < len(fine.jumps)
    assert missed <= 4  # of 112


@pytest.mark.parametrize("scene", [Scene(3.0), Scene(1.0), Scene(1.0, adhesion=HardContact())])
def test_loading_stores_the_work(scene):
    trajectory = simulate(scene, PiecewiseLinearProtocol([0.0, 1.0], [0.0, 8.0]), 1e-3)
    area = stage_area(trajectory)
    assert trajectory.work() == pytest.approx(area, rel=5e-3)

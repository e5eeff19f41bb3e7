"""Loops of elastic contacts: what the jumps lose, by the balance of energy."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from bem import HardContact, PiecewiseLinearProtocol, Scene, simulate
from tests.validation.cases import ramps, stage_area

DEEP = ramps(30.0, 1.0, 0.0, 1.0)


@pytest.mark.parametrize("tabor", [1.1, 1.5, 2.0, 3.0])
def test_the_hysteresis_of_a_deep_loop_meets_its_target(tabor):
    found, fine = (simulate(Scene(tabor), DEEP, accuracy) for accuracy in ("standard", 5e-4))
    assert len(found.jumps) >= 2
    assert found.hysteresis == pytest.approx(fine.hysteresis, rel=2.0 * found.hysteresis_accuracy)


@pytest.mark.parametrize("tabor", [0.7, 0.8, 0.9])
def test_a_loop_that_loses_little_states_its_larger_error(tabor):
    found, fine = (simulate(Scene(tabor), DEEP, accuracy) for accuracy in ("standard", 5e-4))
    assert found.hysteresis_accuracy > 2.0 * found.accuracy
    assert abs(found.hysteresis - fine.hysteresis) <= found.accuracy * max(0.5, found.hysteresis)
    # What is found where no branch folds back is no jump.
    assert all(abs(jump.energy_lost) < 1e-4 for jump in found.jumps) or tabor > 0.7


def test_few_loops_miss_a_small_jump():
    missed = 0
    for tabor, peak in itertools.product(np.linspace(0.8, 1.2, 28), (3.0, 10.0, 20.0, 30.0)):
        protocol = replace(DEEP, peak_indentation=peak)
        found, fine = (simulate(Scene(tabor), protocol, accuracy) for accuracy in ("standard", 5e-4))
        missed += len(found.jumps) < len(fine.jumps)
    assert missed <= 4  # of 112


@pytest.mark.parametrize("scene", [Scene(3.0), Scene(1.0), Scene(1.0, adhesion=HardContact())])
def test_loading_alone_stores_the_work_that_is_put_in(scene):
    found = simulate(scene, PiecewiseLinearProtocol([0.0, 1.0], [0.0, 8.0]), 1e-3)
    area = stage_area(found)
    assert found.work() == pytest.approx(area, rel=5e-3)

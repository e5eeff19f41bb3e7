"""Elastic contacts that follow the curve of their equilibria, beside time steps."""

import numpy as np
import pytest

from bem import Elastic, HardContact, LoadingProtocol, PiecewiseLinearProtocol, Scene, StandardLinearSolid, simulate
from bem.solver import simulation
from bem.solver.elastic.march import prefers_curve

TABOR = 4.6  # just above the smallest that follows the curve always, where time steps cost little


@pytest.mark.parametrize("depths", [[-9.0, 2.0, -9.0], [-8.0, -3.0, 1.0, -12.0, -4.5]])
def test_the_curve_and_time_steps_agree(depths, monkeypatch):
    protocol = PiecewiseLinearProtocol(np.arange(len(depths)), depths)
    found = simulate(Scene(TABOR, Elastic()), protocol)
    monkeypatch.setattr(simulation, "prefers_curve", lambda *_: False)
    stepped = simulate(Scene(TABOR, Elastic()), protocol)
    assert found.stats.rejections == 0 < stepped.stats.rejections  # two ways
    assert len(found.jumps) == len(stepped.jumps)
    assert found.pull_off_force == pytest.approx(stepped.pull_off_force, rel=1e-3)
    assert found.hysteresis == pytest.approx(stepped.hysteresis, rel=4e-3)
    instants = np.linspace(0.0, len(depths) - 1.0, 200)
    assert np.median(np.abs(found.at(instants) - stepped.at(instants))) < 2e-3


def test_surfaces_that_never_touch_take_a_few_time_steps():
    protocol = LoadingProtocol(peak_indentation=-4.5, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
    found = simulate(Scene(TABOR, Elastic()), protocol)
    assert found.completed
    assert not found.jumps
    assert found.stats.iterations < 200


@pytest.mark.parametrize(
    ("scene", "deepest", "wanted"),
    [
        (Scene(TABOR, Elastic()), 5.0, True),
        (Scene(TABOR, Elastic()), -3.0, True),
        (Scene(TABOR, Elastic()), -6.0, False),
        (Scene(4.0, Elastic()), 5.0, False),
        (Scene(TABOR, Elastic(), HardContact()), 5.0, False),
        (Scene(TABOR, StandardLinearSolid(0.1)), 5.0, False),
        (Scene(TABOR, Elastic(), spring=10.0), 5.0, False),
    ],
)
def test_only_a_direct_elastic_contact_prefers_the_curve(scene, deepest, wanted):
    assert prefers_curve(scene, deepest) is wanted

"""A viscoelastic contact moved very fast or very slowly is an elastic one.

An elastic half-space of modulus E0/k under the same sphere, adhesion and h0 has the Tabor parameter mu k^(2/3), since
mu^3 goes with the inverse square of the modulus; indentations in h0 and forces in pi R dgamma are the same numbers.
"""

import numpy as np
import pytest

from bem import Elastic, PiecewiseLinearProtocol, PronySeries, Scene, StandardLinearSolid, simulate
from tests.validation.cases import completed, ramps

DEPTHS = [-2.0, 4.0, -2.0]
ACCURACY = 1e-3


def run(material, tabor, duration, **options):
    path = PiecewiseLinearProtocol([0.0, 0.5 * duration, duration], DEPTHS)
    return completed(Scene(tabor=tabor, material=material), path, ACCURACY, **options)


def assert_same_loop(first, second, tolerance=2e-3):
    parts = np.linspace(0.0, 1.0, 121)
    a, b = first.at(parts * first.time[-1]), second.at(parts * second.time[-1])
    assert np.sum(np.abs(a - b)) < tolerance * np.sum(np.abs(b))
    assert first.pull_off_force == pytest.approx(second.pull_off_force, rel=tolerance)
    assert first.max_compression == pytest.approx(second.max_compression, rel=tolerance)


@pytest.mark.parametrize("ratio", [0.5, 0.1])
def test_fast_is_glassy(ratio):
    fast = run(StandardLinearSolid(ratio), 0.6, 1e-7, initial_state="glassy")
    assert_same_loop(fast, run(Elastic(), 0.6 * ratio ** (2.0 / 3.0), 1.0))


@pytest.mark.parametrize("ratio", [0.5, 0.1])
def test_slow_is_rubbery(ratio):
    assert_same_loop(run(StandardLinearSolid(ratio), 0.6, 1e6), run(Elastic(), 0.6, 1.0))


def test_only_the_faster_time_has_relaxed():
    material = PronySeries([0.4, 0.4], [1e-6, 1e6])
    middle = run(material, 0.6, 1.0, initial_state="glassy")
    # the slow term is still glassy: compliance 1 - 0.4
    assert_same_loop(middle, run(Elastic(), 0.6 * 0.6 ** (2.0 / 3.0), 1.0))


def test_loop_between_the_limits():
    glassy, rubbery = run(Elastic(), 0.6 * 0.1 ** (2.0 / 3.0), 1.0), run(Elastic(), 0.6, 1.0)
    middle = run(StandardLinearSolid(0.1), 0.6, 1.0)
    assert glassy.max_compression < 1.1 * middle.max_compression < 1.2 * rubbery.max_compression
    assert middle.hysteresis > 10.0 * max(glassy.hysteresis, rubbery.hysteresis)


@pytest.mark.parametrize(("tabor", "ratio", "rate"), [(3.0, 0.1, 1e-3), (3.0, 0.1, 0.03), (3.0, 0.9, 10.0)])
def test_slow_edge_sticks_at_no_node(tabor, ratio, rate):
    protocol = ramps(3.0, rate, 0.0, rate)
    scene = Scene(tabor=tabor, material=StandardLinearSolid(ratio))
    usual, fine = (simulate(scene, protocol, accuracy) for accuracy in ("standard", 5e-4))
    assert usual.hysteresis == pytest.approx(fine.hysteresis, rel=6e-3)
    assert usual.pull_off_force == pytest.approx(fine.pull_off_force, rel=4e-3)
    assert len(usual.jumps) == len(fine.jumps)


@pytest.mark.parametrize(("tabor", "ratio", "rate", "peak"), [(0.17, 0.6, 600.0, 0.34), (0.3, 0.3, 1000.0, 1.0)])
def test_fast_small_loss_states_its_error(tabor, ratio, rate, peak):
    cycle = ramps(peak, rate * tabor, 0.0, rate * tabor)
    trajectory, fine = (simulate(Scene(tabor, StandardLinearSolid(ratio)), cycle, a) for a in ("standard", 1e-4))
    error = abs(trajectory.hysteresis / fine.hysteresis - 1.0)
    assert trajectory.accuracy < error < trajectory.hysteresis_accuracy

"""What holds for every scene and protocol, whatever the numbers are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bem import PiecewiseLinearProtocol, PronySeries, Scene, StandardLinearSolid
from tests.validation.cases import completed, ramps

SCENE = Scene(tabor=1.0, material=StandardLinearSolid(modulus_ratio=0.1))
START = -(np.pi ** (2.0 / 3.0))


def run(scene, protocol, accuracy="draft", **options):
    return completed(scene, protocol, accuracy, **options)


def two_futures(later, duration):
    common_times, common = [0.0, 0.5, 0.6], [START, 3.0, 1.0]
    first = run(SCENE, PiecewiseLinearProtocol([*common_times, 1.6], [*common, START]))
    second = run(SCENE, PiecewiseLinearProtocol([*common_times, 0.6 + duration], [*common, later]))
    return first, second


@settings(max_examples=10)
@given(later=st.floats(-2.0, 0.0), duration=st.floats(0.01, 2.0))
def test_the_future_has_no_influence(later, duration):
    # The grid is chosen for the deepest part of the whole protocol and, where that is slow, the slowest: none is here.
    first, second = two_futures(later, duration)
    past, same_past = ([*zip(trajectory.time, trajectory.force, strict=True)] for trajectory in (first, second))
    count = int(np.searchsorted(first.time, 0.6, side="right"))
    assert count > 30
    np.testing.assert_allclose(past[:count], same_past[:count], rtol=1e-12, atol=1e-12)
    assert past[-1] != same_past[-1]


@settings(max_examples=10)
@given(later=st.floats(-2.0, 2.9), duration=st.floats(0.01, 10.0))
def test_slow_future_hardly_moves_the_past(later, duration):
    first, second = two_futures(later, duration)  # a slow part to come may ask for another grid
    instants = np.linspace(0.0, 0.6, 61)
    assert np.max(np.abs(first.at(instants) - second.at(instants))) < first.accuracy * np.ptp(first.force)


def test_a_shift_in_time_changes_nothing():
    times, depths = np.array([0.0, 0.5, 1.5]), [START, 3.0, START]
    first = run(SCENE, PiecewiseLinearProtocol(times, depths))
    second = run(SCENE, PiecewiseLinearProtocol(times + 64.0, depths))
    np.testing.assert_allclose(second.at(np.linspace(64.0, 65.5, 50)), first.at(np.linspace(0.0, 1.5, 50)), rtol=1e-6)


def test_cycles_after_rest_repeat():
    one_cycle = [START, 3.0, START]
    cycle = run(SCENE, PiecewiseLinearProtocol([0.0, 0.5, 1.0], one_cycle), "standard")
    rested = run(
        SCENE, PiecewiseLinearProtocol([0.0, 0.5, 1.0, 41.0, 41.5, 42.0], [*one_cycle, *one_cycle]), "standard"
    )
    first = slice(0, cycle.time.size)
    np.testing.assert_allclose(rested.force[first], cycle.force, rtol=1e-9)
    times = np.linspace(0.0, 0.99, 80)  # interpolation smooths the corner at the end
    scale = np.max(np.abs(cycle.force))
    np.testing.assert_allclose(rested.at(41.0 + times), cycle.at(times), atol=4e-3 * scale)


def test_cycles_without_rest_remember():
    depths = [START, *([3.0, 0.0] * 4)]
    trajectory = run(SCENE, PiecewiseLinearProtocol(0.2 * np.arange(9.0), depths), "standard")
    peaks = trajectory.at(0.2 * np.arange(1.0, 9.0, 2.0))
    assert abs(peaks[1] / peaks[0] - 1.0) > 0.01
    assert abs(peaks[3] - peaks[2]) < 0.5 * abs(peaks[1] - peaks[0])


def test_time_scales_with_retardation():
    slow = Scene(tabor=1.0, material=PronySeries([0.9], [100.0]))
    first = run(SCENE, PiecewiseLinearProtocol([0.0, 0.5, 1.0], [START, 3.0, START]))
    second = run(slow, PiecewiseLinearProtocol([0.0, 50.0, 100.0], [START, 3.0, START]))
    parts = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(second.at(100.0 * parts), first.at(parts), rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("accuracy", ["draft", "standard"])
def test_pull_off_error_is_as_promised(accuracy):
    protocol = ramps(10.0, 10.0, 0.1, 100.0)
    trajectory, exact = run(SCENE, protocol, accuracy), run(SCENE, protocol, 3e-4)
    assert trajectory.pull_off_force == pytest.approx(exact.pull_off_force, rel=trajectory.accuracy)
    assert trajectory.hysteresis == pytest.approx(exact.hysteresis, rel=trajectory.accuracy)

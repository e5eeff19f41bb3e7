import numpy as np
import pytest

from surrogate.prediction.validity import RANGE_TOLERANCE, excesses, history_quantities


@pytest.mark.parametrize(("low", "high"), [(1e-3, 3.0), (2.0, 1e6)])
@pytest.mark.parametrize("share", [0.5, 2.0])
def test_a_bound_is_kept_to_rounding_of_its_own_size(low, high, share):
    step = share * RANGE_TOLERANCE
    values = np.array([low * (1.0 - step), low, high, high * (1.0 + step), np.nan])
    found = excesses({"dwell_time": values}, {"dwell_time": (low, high)})
    outside = np.zeros(5, dtype=bool) if not found else found[0].beyond > 0.0
    assert outside.tolist() == [share > 1.0, False, False, share > 1.0, False]


def cycle(loading=50, dwell=20, unloading=50):
    """A history from -2 to 8 in 2, 1 at rest, and back to -3 in 4."""
    ramp, rest, back = (np.arange(1, points + 1) / points for points in (loading - 1, dwell, unloading))
    times = np.concatenate([[0.0], 2.0 * ramp, 2.0 + rest, 3.0 + 4.0 * back])
    return times, np.interp(times, [0.0, 2.0, 3.0, 7.0], [-2.0, 8.0, 8.0, -3.0])


def learned(*history):
    return not excesses(history_quantities(*(one[None] for one in history)), {})


def test_quantities_of_a_history_by_hand():
    times, indentations = cycle()
    found = {name: values[0] for name, values in history_quantities(times[None], indentations[None]).items()}
    expected = {
        "peak_indentation": 8.0,
        "loading_rate": 5.0,
        "dwell_time": 1.0,
        "unloading_rate": 2.75,
        "start_indentation": -2.0,
        "end_indentation": -3.0,
        "loading_points": 50.0,
        "dwell_points": 20.0,
        "unloading_points": 50.0,
        "bend": 0.0,
        "step_ratio": 1.0,
    }
    assert found == pytest.approx(expected, abs=1e-9)
    bent = indentations + np.where(np.arange(120) == 30, 0.11, 0.0)
    assert history_quantities(times[None], bent[None])["bend"][0] == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("points", "as_learned"),
    [((50, 20, 50), True), ((42, 16, 42), True), ((58, 24, 58), True), ((41, 20, 50), False), ((50, 25, 50), False)],
)
def test_points_in_proportion_are_as_the_models_learned(points, as_learned):
    assert learned(*cycle(*points)) == as_learned


@pytest.mark.parametrize(("late", "as_learned"), [(0.15, True), (0.25, False)])
def test_steps_of_a_phase_are_even(late, as_learned):
    times, indentations = cycle()
    times[100] += late * 0.08
    indentations = np.interp(times, [0.0, 2.0, 3.0, 7.0], [-2.0, 8.0, 8.0, -3.0])
    assert learned(times, indentations) == as_learned


def test_ends_lie_near_those_of_the_training():
    tabor = np.array([1.0])
    usual = -(np.pi ** (2.0 / 3.0))
    for name in ("start_indentation", "end_indentation"):
        for share, outside in ((1.02, False), (0.98, False), (1.04, True), (0.96, True)):
            assert bool(excesses({"tabor": tabor, name: share * usual * tabor}, {})) == outside

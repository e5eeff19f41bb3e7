import numpy as np
import pytest

from bem.methods.records import RECORD, with_peaks


def records_of(times, forces, depths=None):
    times = np.asarray(times, dtype=float)
    depths = -times if depths is None else np.asarray(depths, dtype=float)
    return np.array(list(zip(times, depths, forces, 2.0 * times, strict=True)), RECORD)


def test_vertex_between_uneven_steps():
    times = np.array([0.0, 0.4, 0.5, 1.3, 2.0])
    records = records_of(times, 3.0 - (times - 0.7) ** 2)
    unloading = np.array([False, True, True, True, True])
    out, flags = with_peaks(records, unloading)
    assert len(out) == len(flags) == 6
    (added,) = [row for row in out if row["time"] not in times]
    np.testing.assert_allclose(added.tolist(), [0.7, -0.7, 3.0, 1.4], rtol=1e-12)
    assert np.all(np.diff(out["time"]) > 0.0)
    assert flags.tolist() == [False, True, True, True, True, True]


def test_cubic_top_from_two_steps_before():
    times = np.array([0.0, 0.3, 0.6, 1.2])
    for slow in (times, 1e6 * times, 1e-6 * times):
        records = records_of(slow, times * (1.5 - times) * (2.0 - times))
        (added,) = [row for row in with_peaks(records, np.ones(4, bool))[0] if row["time"] not in slow]
        top = (3.5 - np.sqrt(3.5**2 - 9.0)) / 3.0
        np.testing.assert_allclose(added["time"] / (slow[-1] / 1.2), top, rtol=1e-9)
        np.testing.assert_allclose(added["force"], top * (1.5 - top) * (2.0 - top), rtol=1e-12)


def test_every_local_maximum_gets_one():
    times = np.linspace(0.0, 4.0 * np.pi, 60)
    out, _ = with_peaks(records_of(times, np.sin(times)), np.zeros(60, bool))
    added = out[~np.isin(out["time"], times)]
    np.testing.assert_allclose(added["time"], [0.5 * np.pi, 2.5 * np.pi], atol=5e-3)
    np.testing.assert_allclose(added["force"], 1.0, atol=1e-4)


def test_the_peak_is_of_third_order():
    def worst_error(step):
        errors = []
        for shift in np.linspace(0.0, step, 11):
            times = shift + step * np.arange(int(1.0 / step))
            out, _ = with_peaks(records_of(times, times * np.exp(-4.0 * times)), np.zeros(times.size, bool))
            errors.append(abs(out["force"].max() - 0.25 * np.exp(-1.0)))
        return max(errors)

    for step in (0.1, 0.05, 0.025):
        assert worst_error(0.5 * step) < 0.2 * worst_error(step)


def test_monotone_and_short_are_left_alone():
    for count in (1, 2, 9):
        times = np.arange(count, dtype=float)
        out, _ = with_peaks(records_of(times, times**2), np.zeros(count, bool))
        assert len(out) == count


SHORT = ([0.0, 2.0, 2.0 + 1e-6, 2.0 + 2e-6], [0.468, 0.476, 0.474, 0.474])
UNEQUAL = ([0.0, 5e-3, 5e-3 + 4e-5, 8e-3], [1.62, 1.953, 1.943, 1.4])


@pytest.mark.parametrize(
    ("times", "forces", "depths"),
    [
        pytest.param([0.0, 1.0, 1.0, 2.0], [0.0, 2.0, 1.0, 0.5], [0.0, -1.0, -1.0, -2.0], id="a jump"),
        pytest.param([0.0, 1.0, 2.0, 3.0], [0.0, 2.0, 1.0, 0.5], [0.0, 1.0, 0.0, -1.0], id="a corner of the protocol"),
        pytest.param(*SHORT, None, id="rounding beside a tiny step"),
        pytest.param(*UNEQUAL, None, id="steps of very unequal length"),
    ],
)
def test_no_parabola_reaches_across(times, forces, depths):
    records = records_of(times, forces, depths)
    out, _ = with_peaks(records, np.ones(4, bool))
    np.testing.assert_array_equal(out, records)

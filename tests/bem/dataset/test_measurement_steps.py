import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bem.dataset.measurement_steps import FMS, measurement_grid, measurement_times, proportional_counts
from bem.protocol import LoadingProtocol

ONE = {"tabor": 1.0, "peak_indentation": 15.0, "loading_rate": 1.0, "dwell_time": 0.1, "unloading_rate": 1.0}
PROTOCOL = LoadingProtocol(peak_indentation=15.0, loading_rate=1e3, dwell_time=8e-3, unloading_rate=1e2)


@given(st.integers(6, 5000))
def test_counts_are_those_of_the_paper_or_in_their_proportion(total):
    assert [proportional_counts(points) for points in (120, 100, 140)] == [FMS, (42, 16, 42), (58, 24, 58)]
    counts = proportional_counts(total)
    assert sum(counts) == total
    assert min(counts) >= 1


def test_phases_are_sampled_uniformly_and_meet_their_ends():
    times = measurement_times(PROTOCOL, tabor=3.2)
    t0, t1, t2, t3 = PROTOCOL.phase_times(3.2)
    assert times.shape == (120,)
    assert (times[0], times[49], times[69], times[119]) == (t0, t1, t2, t3)
    for phase in (times[:50], times[49:70], times[69:]):
        np.testing.assert_allclose(np.diff(phase), np.diff(phase)[0], rtol=1e-9)


@given(
    tabor=st.floats(0.2, 3.2),
    peak=st.floats(2.0, 100.0),
    load=st.floats(-1.0, 3.0),
    dwell=st.floats(1e-3, 3.0),
    unload=st.floats(-1.0, 3.0),
)
def test_grid_agrees_with_the_protocol(tabor, peak, load, dwell, unload):
    protocol = LoadingProtocol(
        peak_indentation=peak, loading_rate=10.0**load, dwell_time=dwell, unloading_rate=10.0**unload
    )
    times, indentations = measurement_grid(
        tabor=[tabor, tabor],
        peak_indentation=peak,
        loading_rate=10.0**load,
        dwell_time=dwell,
        unloading_rate=[10.0**unload, 1.0],
    )
    assert times.shape == indentations.shape == (2, 120)
    assert np.all(np.diff(times, axis=1) > 0.0)
    np.testing.assert_array_equal(times[0], measurement_times(protocol, tabor))
    np.testing.assert_allclose(indentations[0], protocol.history(tabor).indentation_at(times[0]), atol=1e-9 * peak)
    assert indentations[0, 0] == indentations[0, -1] == protocol.start(tabor)
    np.testing.assert_array_equal(indentations[0, 49:70], peak)


def test_a_protocol_without_dwell_has_no_dwell_points():
    times, _ = measurement_grid(**{**ONE, "dwell_time": 0.0}, counts=(50, 0, 50))
    assert times.shape == (1, 100)
    assert np.all(np.diff(times) > 0.0)
    assert measurement_grid(**{**ONE, "tabor": 0.2, "peak_indentation": -0.1})[1].max() == -0.1

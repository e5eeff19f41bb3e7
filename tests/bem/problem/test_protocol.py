import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bem.problem.protocol import (
    ForceProtocol,
    LoadingProtocol,
    PiecewiseLinearProtocol,
    default_start_indentation,
    in_phase,
)

GOOD = {"peak_indentation": 10.0, "loading_rate": 2.0, "dwell_time": 0.5, "unloading_rate": 4.0}


def test_phases_of_a_plain_protocol():
    history = LoadingProtocol(**GOOD, start_indentation=-2.0).history(tabor=1.0)
    np.testing.assert_array_equal(history.times, [0.0, 6.0, 6.5, 9.5])
    np.testing.assert_array_equal(history.indentations, [-2.0, 10.0, 10.0, -2.0])
    assert history.phases == ("loading", "dwell", "unloading")
    assert history.duration == 9.5
    np.testing.assert_array_equal(history.rates, [2.0, 0.0, -4.0])
    instants = np.array([0.0, 5.9, 6.0, 6.2, 6.5, 6.6, 9.5])
    assert in_phase(history, instants, "dwell").tolist() == [False, False, True, True, True, False, False]
    np.testing.assert_allclose(history.indentation_at([-1.0, 3.0, 6.2, 8.0, 20.0]), [-2.0, 4.0, 10.0, 4.0, -2.0])


def test_the_default_start_is_the_papers():
    protocol = LoadingProtocol(**GOOD)
    assert protocol.start(3.0) == default_start_indentation(3.0) == pytest.approx(-3.0 * np.pi ** (2.0 / 3.0))
    assert protocol.history(3.0).indentations[0] == protocol.start(3.0)


def test_no_dwell_no_segment():
    protocol = LoadingProtocol(**GOOD | {"dwell_time": 0.0})
    assert protocol.history(1.0).phases == ("loading", "unloading")
    _, t1, t2, _ = protocol.phase_times(1.0)
    assert t1 == t2


def test_peak_may_lie_below_zero():
    shallow = LoadingProtocol(**GOOD | {"peak_indentation": -1.0})
    assert shallow.history(tabor=1.0).rates.tolist() == pytest.approx([2.0, 0.0, -4.0])
    expected = (
        r"peak_indentation must lie above the start indentation, which is -0\.429\d+ at tabor 0\.2; received -1\.0"
    )
    with pytest.raises(ValueError, match=expected):
        shallow.history(tabor=0.2)


@given(
    tabor=st.floats(0.02, 5.0),
    travel=st.floats(1e-2, 500.0),
    load=st.floats(-3.0, 5.0),
    dwell=st.sampled_from([0.0, 1e-6, 1.0, 1e3]),
    unload=st.floats(-3.0, 5.0),
)
def test_hard_histories_are_well_formed(tabor, travel, load, dwell, unload):
    peak = default_start_indentation(tabor) + travel
    protocol = LoadingProtocol(
        peak_indentation=peak, loading_rate=10.0**load, dwell_time=dwell, unloading_rate=10.0**unload
    )
    history = protocol.history(tabor)
    assert history.indentations[0] == history.indentations[-1]
    assert history.indentation_at(protocol.phase_times(tabor)[1]) == pytest.approx(peak)
    assert history.rates[0] == pytest.approx(10.0**load, rel=1e-9)
    assert -history.rates[-1] == pytest.approx(10.0**unload, rel=1e-6)
    assert history.duration == pytest.approx(protocol.phase_times(tabor)[3])


@pytest.mark.parametrize("make", [PiecewiseLinearProtocol, ForceProtocol])
def test_any_history_is_a_value(make):
    sign = 1 if make is PiecewiseLinearProtocol else -1  # compression is loading
    protocol = make([0.0, 1.0, 2.0, 4.0], [0.0, sign * 5.0, sign * 5.0, 1.0])
    assert protocol.phases == ("loading", "dwell", "unloading")
    assert protocol.duration == 4.0
    again = make((0, 1, 2, 4), (0, sign * 5, sign * 5, 1))
    assert protocol == again
    assert len({protocol, again}) == 1
    assert protocol != make([0.0, 1.0], [0.0, sign * 5.0])
    for values in vars(protocol).values():
        if isinstance(values, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                values[0] = 1.0
    pairs = [0.0, 1.0], [0.0, 1.0]
    assert PiecewiseLinearProtocol(*pairs) != ForceProtocol(*pairs)

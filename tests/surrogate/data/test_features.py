import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from surrogate.data.features import (
    channels,
    edge_from_counts,
    edge_from_indentations,
    plateau,
)


def test_velocity_is_the_backward_difference():
    times, indentations = np.array([[0.0, 1.0, 3.0, 3.5]]), np.array([[0.0, 2.0, 2.0, 1.0]])
    np.testing.assert_array_equal(channels(times, indentations, 0 * times)[..., 2], [[0.0, 2.0, 0.0, -2.0]])


def test_acceleration_of_steady_motion_fades():
    times = np.linspace(0.0, 1.0, 11)[None]
    a = 0.3
    expected = [0.0, 20.0 * a, 20.0 * a * (1 - a), 20.0 * a * (1 - a) ** 2]
    np.testing.assert_allclose(channels(times, 2.0 * times, times, "C")[0, :4, 3], expected)


def test_found_edges_equal_the_known_ones(grid):
    _, indentations = grid
    np.testing.assert_array_equal(
        edge_from_indentations(indentations), edge_from_counts((50, 20, 50), len(indentations))
    )
    assert set(np.flatnonzero(edge_from_counts((50, 20, 50), 1)[0])) == {49, 69}


def test_plateau_of_odd_histories():
    assert plateau(np.arange(5.0)) is None
    assert plateau(np.array([3.0])) is None
    assert plateau(np.array([0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0])) == (3, 5)
    assert plateau(np.array([1.0, 1.0, 0.0, 2.0, 2.0])) == (0, 1)
    assert plateau(np.array([0.0, 100.0, 100.0 * (1 + 1e-15), 0.0])) == (1, 2)
    assert plateau(np.zeros(4)) == (0, 3)


@given(st.integers(2, 30), st.integers(0, 30), st.integers(1, 30))
def test_plateau_is_found_at_any_resolution(loading, dwell, unloading):
    history = np.concatenate([np.linspace(-1, 5, loading), np.full(dwell, 5.0), 5.0 - np.arange(1, unloading + 1)])
    assert plateau(history) == ((loading - 1, loading + dwell - 1) if dwell else None)

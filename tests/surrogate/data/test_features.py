"""Channels: differences and edges, and what no set may do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bem.dataset.measurement_steps import measurement_grid
from surrogate.data.features import channels, edge_from_counts, edge_from_indentations, plateau

PROTOCOL = {"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}


def histories(counts=(50, 20, 50)):
    return measurement_grid(tabor=[1.0, 0.5], **PROTOCOL, counts=counts)


def test_no_channel_looks_ahead():
    times, indentations = histories()
    edge = np.zeros_like(times)
    whole = channels(times, indentations, edge, "C")
    part = channels(times[:, :77], indentations[:, :77], edge[:, :77], "C")
    np.testing.assert_array_equal(whole[:, :77], part)


def test_unknown_set_is_refused():
    times, indentations = histories()
    with pytest.raises(ValueError, match=r"features must be .*; received 'Z'"):
        channels(times, indentations, np.zeros_like(times), "Z")


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

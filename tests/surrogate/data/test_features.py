"""Channels: differences and edges, the physics of the solid, and what no set may do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bem import LoadingProtocol, Scene, StandardLinearSolid
from bem.dataset.measurement_steps import measurement_grid
from bem.methods.closed_forms import hereditary_hertz
from surrogate.data.features import channel_names, channels, edge_from_counts, edge_from_indentations, plateau

PROTOCOL = {"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}


def histories(counts=(50, 20, 50)):
    return measurement_grid(tabor=[1.0, 0.5], **PROTOCOL, counts=counts)


def test_force_is_lee_radok_while_growing():
    counts = (2000, 800, 50)
    times, indentations = histories(counts)
    tabor, ratio = np.array([1.0, 0.5]), np.array([0.1, 0.3])
    force = channels(times, indentations, 0 * times, "F", tabor=tabor, modulus_ratio=ratio)[..., 5]
    for row in range(2):
        scene = Scene(tabor[row], StandardLinearSolid(ratio[row]))
        path = LoadingProtocol(**PROTOCOL).history(tabor[row])
        expected = hereditary_hertz.force(scene, path, times[row, :2800])
        np.testing.assert_allclose(force[row, :2800], expected, rtol=2e-3, atol=2e-3 * np.abs(expected).max())
    # It turns to tension before the undeformed sphere would leave.
    assert np.all(force[:, 2800:].max(axis=1) > 0.0)


def test_memories_have_the_solids_times():
    times = np.array([[0.0, 1.0, 3.0]])
    indentations = np.array([[0.0, 2.0, 2.0]])
    found = channels(times, indentations, 0 * times, "F", tabor=np.ones(1), modulus_ratio=0.25)[0, :, 7:9].T
    for memory, time in zip(found, (0.25, 1.0), strict=True):
        risen = 2.0 * time * (1.0 - np.exp(-1.0 / time))
        np.testing.assert_allclose(memory, [0.0, risen, risen * np.exp(-2.0 / time)], rtol=1e-12)


def test_sets_e_and_f_extend_d():
    times, indentations = histories()
    edge = edge_from_indentations(indentations)
    found = {
        name: channels(times, indentations, edge, name, tabor=np.array([1.0, 0.5]), modulus_ratio=0.1)
        for name in "ABCDEF"
    }
    assert [values.shape[-1] for values in found.values()] == [2, 3, 4, 4, 5, 12]
    np.testing.assert_array_equal(found["F"][..., :5], found["E"])
    np.testing.assert_array_equal(found["E"][..., :4], found["D"])
    by_name = dict(zip(channel_names("F"), np.moveaxis(found["F"], -1, 0), strict=True))
    np.testing.assert_allclose(np.exp(by_name["log_step"][:, 1:]), np.diff(times, axis=1))
    np.testing.assert_allclose(by_name["log_modulus_ratio"], np.log(0.1))
    assert by_name["loading"].sum() == 2 * 49
    assert by_name["unloading"].sum() == 2 * 50


@pytest.mark.parametrize("features", ["C", "F"])
def test_no_channel_looks_ahead(features):
    times, indentations = histories()
    edge, material = np.zeros_like(times), {"tabor": np.array([1.0, 0.5]), "modulus_ratio": np.array([0.1, 0.5])}
    whole = channels(times, indentations, edge, features, **material)
    part = channels(times[:, :77], indentations[:, :77], edge[:, :77], features, **material)
    np.testing.assert_array_equal(whole[:, :77], part)


@pytest.mark.parametrize(
    ("features", "words"),
    [("F", "tabor and modulus_ratio must be given for feature set F"), ("Z", "features must be .*; received 'Z'")],
)
def test_sets_that_cannot_be_computed(features, words):
    times, indentations = histories()
    with pytest.raises(ValueError, match=words):
        channels(times, indentations, np.zeros_like(times), features)


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

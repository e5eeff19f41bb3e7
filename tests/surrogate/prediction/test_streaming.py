"""A stream says step by step what the model says of the whole history, warns as it leaves it, and can go back."""

import dataclasses
import gc
import tracemalloc
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol, Scene, StandardLinearSolid
from bem.dataset.measurement_steps import measurement_grid
from surrogate.data.features import edge_from_counts
from surrogate.prediction.predictor import Surrogate
from surrogate.prediction.stream import Stream
from surrogate.prediction.validity import ExtrapolationWarning
from tests.surrogate.conftest import every_model
from tests.surrogate.prediction.conftest import PROTOCOL

HISTORY = 4
pytestmark = pytest.mark.filterwarnings("ignore:.*extrapolates")


def scene(tabor, ratio=0.1):
    return Scene(tabor, StandardLinearSolid(ratio))


@pytest.fixture(scope="module")
def model(stirred):
    return Surrogate(stirred("M1-concat")[0])


@pytest.fixture(scope="module")
def history(dataset, grid):
    times, indentations = (part[HISTORY] for part in grid)
    return times, indentations, float(dataset.protocols["tabor"][HISTORY])


def steps(stream, times, indentations, edges=(49, 69)):
    points = enumerate(zip(times, indentations, strict=True))
    return np.array([stream.step(time, depth, edge=index in edges) for index, (time, depth) in points])


@pytest.mark.parametrize(("name", "features"), every_model(but="M5"))
def test_steps_equal_the_whole_sequence(name, features, stirred, history):
    backend, wholes = stirred(name, features)
    times, indentations, tabor = history
    streamed = backend.scaling.scale_force(steps(Surrogate(backend).stream(scene(tabor)), times, indentations))
    assert np.ptp(wholes[HISTORY]) > 1e-2
    np.testing.assert_allclose(streamed, wholes[HISTORY], rtol=0.0, atol=1e-5)


def test_a_model_that_looks_ahead_cannot_stream(stirred):
    with pytest.raises(ValueError, match=r"causal model.*use `predict`.*M5-FiLM"):
        Surrogate(stirred("M5-FiLM")[0]).stream(scene(1.0))


def test_reset_and_snapshot(model, history):
    times, indentations, tabor = history
    stream = model.stream(scene(tabor))
    whole = steps(stream, times, indentations)
    assert stream.time == times[-1]
    stream.reset()
    assert stream.time == -np.inf
    np.testing.assert_array_equal(steps(stream, times[:60], indentations[:60]), whole[:60])

    kept = stream.snapshot()
    wandered = steps(stream, times[60:], indentations[60:] + 1.0, edges=())
    assert np.abs(wandered - whole[60:]).max() > 1e-3
    stream.restore(kept)
    np.testing.assert_array_equal(steps(stream, times[60:], indentations[60:], edges=(9,)), whole[60:])

    other = model.stream(scene(tabor))
    other.restore(kept)
    np.testing.assert_array_equal(steps(other, times[60:], indentations[60:], edges=(9,)), whole[60:])
    with pytest.raises(ValueError, match=r"snapshot of M1-concat at tabor=2"):
        model.stream(scene(2.0)).restore(kept)
    with pytest.raises(ValueError, match="snapshot of M1-concat"):
        stream.restore(None)


def test_a_refused_step_leaves_the_stream_where_it_was(model, history):
    times, indentations, tabor = history
    stream = model.stream(scene(tabor))
    expected = steps(stream, times[:20], indentations[:20])
    stream.reset()
    steps(stream, times[:19], indentations[:19])
    for time, depth, words in (
        (times[18], 0.0, "time after .*that of the previous step"),
        (np.nan, 0.0, "finite time, and an indentation"),
        (times[19], np.inf, "finite time, and an indentation"),
        (times[19], 1e7, "an indentation within"),
        (1e-320, 0.0, "time after"),
        (times[18] + 1e-13, 50.0, "a rate of at most 1e"),
        (1e300, 0.0, "time after .* at most"),
        (times[19] + 0j, 0.0, "time must be real numbers"),
        (times[19], 1j, "indentation must be real numbers"),
        ("x" * 10**5, 0.0, "time must be real numbers; received 'xxx"),
        (10**400, 0.0, "time must be real numbers"),
        (times[19:21], 0.0, "one number as time"),
    ):
        with pytest.raises(ValueError, match=words):
            stream.step(time, depth)
    assert stream.step(times[19], indentations[19]) == expected[19]
    with pytest.raises(ValueError, match=r"the modulus ratio 0\.1, the only one that M1-concat was trained on"):
        model.stream(scene(1.0, 0.3))


def test_a_whole_history_is_its_steps_to_the_last_bit(model, history):
    times, indentations, tabor = history
    edge = np.zeros_like(times)
    edge[[49, 69]] = 1.0
    stream = model.stream(scene(tabor))
    whole = stream.run(times, indentations, edge)
    assert whole.dtype == np.float64
    stream.reset()
    np.testing.assert_array_equal(steps(stream, times, indentations), whole)
    stream.reset()
    first = stream.run(times[:70], indentations[:70], edge[:70])
    np.testing.assert_array_equal(np.concatenate([first, stream.run(times[70:], indentations[70:], edge[70:])]), whole)
    for bad, words in (
        ((times, indentations[1:], edge), "of the same shape"),
        ((times, indentations, edge[1:]), "edge marks of shape"),
        ((times, indentations, 0.5 * edge), "zero or one"),
        ((times[::-1], indentations, edge), "time after"),
        ((times + 0j, indentations, edge), "times must be real numbers"),
    ):
        stream.reset()
        with pytest.raises(ValueError, match=words):
            stream.run(*bad)
        assert stream.time == -np.inf


@pytest.mark.slow
def test_a_step_allocates_nothing_that_stays(model):
    stream = model.stream(scene(1.0))
    stream.step(-1.0, -(np.pi ** (2 / 3)))
    tracemalloc.start()
    grown = []
    for window in range(4):  # a leak is in each of them, what ONNX Runtime keeps once is not
        before = tracemalloc.get_traced_memory()[0]
        for index in range(2000):
            stream.step(2000.0 * window + index, 1.0)
        gc.collect()
        grown.append(tracemalloc.get_traced_memory()[0] - before)
    tracemalloc.stop()
    assert min(grown) < 2_000


def planned(**changes):
    counts = changes.pop("counts", (50, 20, 50))
    grid = measurement_grid(tabor=1.0, **PROTOCOL | changes, counts=counts)
    return grid[0][0], grid[1][0], edge_from_counts(counts, 1)[0]


def twice(times, indentations, edge):
    later = (times[1:] + times[-1], indentations[1:], edge[1:])
    return map(np.append, (times, indentations, edge), later)


def stretched(times, indentations, edge):
    return times * np.where(np.arange(times.size) > 90, 2.0, 1.0), indentations, edge


@pytest.mark.parametrize(
    ("history", "causes"),
    [
        (planned(), []),
        (planned(loading_rate=5500.0), ["loading_rate = 5500 lies"]),
        (planned(start_indentation=1.0), ["start_indentation = 1 lies"]),
        (planned(unloading_rate=0.05), ["unloading_rate = 0.05 lies"]),
        (planned(peak_indentation=200.0), ["peak_indentation = 1"]),
        (planned(peak_indentation=1.0), ["peak_indentation = 1 lies"]),
        (planned(dwell_time=10.0), ["dwell_time = "]),
        (planned(counts=(20, 20, 50)), ["loading_points = 20 lies"]),
        (planned(counts=(50, 40, 50)), ["dwell_points = 25 lies"]),
        (planned(counts=(50, 20, 10)), ["unloading_points = 10 lies"]),
        (stretched(*planned()), ["step_ratio = "]),
        (twice(*planned()), ["cycles = 2 lies", "edge_marks = 3 lies"]),
        ((*planned()[:2], np.zeros(120)), ["edge_marks = 0 lies"]),
        ((*planned()[:2], np.arange(120) == 49), ["edge_marks = 1 lies"]),
        ((np.arange(120.0), 20.0 * np.sin(np.arange(120) / 38.0) - np.pi ** (2 / 3), np.zeros(120)), ["bend = "]),
    ],
)
def test_a_stream_warns_of_each_cause_once(stirred, history, causes):
    backend = stirred("M1-concat")[0]
    box = {"tabor": (0.5, 5.0), "peak_indentation": (2.0, 100.0), "dwell_time": (1e-3, 3.0)}
    rates = dict.fromkeys(("loading_rate", "unloading_rate"), (0.1, 1000.0))
    stream = Stream(backend.content(), dataclasses.replace(backend.scaling, ranges=box | rates), tabor=1.0)
    times, indentations, edge = history
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        for time, depth, mark in zip(times, indentations, edge, strict=True):
            stream.step(float(time), float(depth), bool(mark))
            stream.restore(stream.snapshot())
    said = [str(warning.message) for warning in found]
    assert all(sum(cause in one for one in said) == 1 for cause in causes)
    assert said if causes else not said


def test_a_stream_outside_the_training_warns(model):
    with pytest.warns(ExtrapolationWarning, match=r"tabor = 50 lies outside \["):
        stream = model.stream(scene(50.0))
    with pytest.warns(ExtrapolationWarning, match=r"start_indentation = 1 lies outside \[-110\.\d+, -104"):
        stream.step(0.0, 1.0)


def physical(model):
    """Instants, indentations, marks and forces of a history on the physical steps of a model with bands."""
    found = model.predict(scene(1.3, 0.07), LoadingProtocol(**PROTOCOL | {"dwell_time": 0.7, "unloading_rate": 40.0}))
    return found.time, found.indentation, edge_from_counts(model.counts, 1)[0], found.force


@pytest.mark.parametrize("name", ["untrained", "accurate"])
def test_steps_on_physical_steps_equal_the_whole_history(name, banded, monkeypatch):
    model = banded if name == "untrained" else surrogate.load(name)
    times, indentations, edges, force = physical(model)
    if name == "accurate":  # a stream leaves out the networks that need later steps
        session = model.network.session
        causal = SimpleNamespace(run=lambda _, given: session.run(["causal"], given))
        monkeypatch.setattr(model.network, "session", causal)
        whole, force = force, physical(model)[-1]
        assert np.ptp(whole - force) > 1e-4 * np.ptp(force)
    stream = model.stream(scene(1.3, 0.07))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # When the first step is, is of no interest.
        found = stream.run(times + 5.0, indentations, edges)
    assert np.ptp(force) > 0.1
    np.testing.assert_allclose(found, force, rtol=0.0, atol=2e-5 * np.ptp(force))
    other = model.stream(scene(1.3, 0.5))
    assert np.abs(other.run(times, indentations, edges) - force).max() > 1e-3 * np.ptp(force)
    with pytest.raises(ValueError, match=rf"Expected a snapshot of {model.name}"):
        other.restore(stream.snapshot())
    with pytest.warns(ExtrapolationWarning, match="modulus_ratio"):
        model.stream(scene(1.3, 1e-3))


def test_steps_that_are_not_physical_are_named(banded):
    times, indentations, edges, _ = physical(banded)
    ends = np.flatnonzero(edges)[-1]
    times[ends:] = np.linspace(times[ends], times[-1], len(times) - ends)
    indentations[ends:] = np.linspace(indentations[ends], indentations[-1], len(times) - ends)
    with pytest.warns(ExtrapolationWarning, match="compression_points = "):
        banded.stream(scene(1.3, 0.07)).run(times, indentations, edges)

import dataclasses
import gc
import tracemalloc
import warnings

import numpy as np
import pytest

import surrogate
from surrogate.inference.predictor import Surrogate
from surrogate.inference.streaming import Stream
from surrogate.inference.validity import ExtrapolationWarning
from surrogate.network.graph import Graph
from surrogate.network.kernels import COLUMNS, hyperbolic_tangents

HISTORY = 4
CAUSAL = [name for name in surrogate.names() if not name.startswith("M5")]


@pytest.fixture(scope="module")
def model(stirred):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        return Surrogate(stirred("M1-concat")[0])


@pytest.fixture(scope="module")
def history(dataset, grid):
    times, indentations = (part[HISTORY] for part in grid)
    return times, indentations, float(dataset.protocols["tabor"][HISTORY])


def steps(stream, times, indentations, edges=(49, 69)):
    points = enumerate(zip(times, indentations, strict=True))
    return np.array([stream.step(time, depth, edge=index in edges) for index, (time, depth) in points])


@pytest.mark.filterwarnings("ignore:.*extrapolates")
@pytest.mark.parametrize(
    ("name", "features"), [*((name, "D") for name in CAUSAL), *(("M3-concat", features) for features in "ABCEF")]
)
def test_steps_equal_the_whole_sequence(name, features, stirred, history):
    backend, wholes = stirred(name, features)
    times, indentations, tabor = history
    streamed = backend.scaling.scale_force(steps(Surrogate(backend).stream(tabor=tabor), times, indentations))
    assert np.ptp(wholes[HISTORY]) > 1e-2
    np.testing.assert_allclose(streamed, wholes[HISTORY], rtol=0.0, atol=1e-5)


@pytest.mark.filterwarnings("ignore:.*extrapolates")
def test_a_model_that_looks_ahead_cannot_stream(stirred):
    with pytest.raises(ValueError, match=r"causal model.*use `predict`.*M5-concat"):
        Surrogate(stirred("M5-concat")[0]).stream(tabor=1.0)


def test_reset_and_snapshot(model, history):
    times, indentations, tabor = history
    stream = model.stream(tabor=tabor)
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

    other = model.stream(tabor=tabor)
    other.restore(kept)
    np.testing.assert_array_equal(steps(other, times[60:], indentations[60:], edges=(9,)), whole[60:])
    with pytest.raises(ValueError, match=r"snapshot of M1-concat at tabor=2"):
        model.stream(tabor=2.0).restore(kept)
    with pytest.raises(ValueError, match="snapshot of M1-concat"):
        stream.restore(None)


def test_a_refused_step_leaves_the_stream_where_it_was(model, history):
    times, indentations, tabor = history
    stream = model.stream(tabor=tabor)
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
    for tabor in (0.0, np.nan, -1.0):
        with pytest.raises(ValueError, match="Tabor parameters above zero"):
            model.stream(tabor=tabor)


def test_a_whole_history_is_its_steps_to_the_last_bit(model, history):
    times, indentations, tabor = history
    edge = np.zeros_like(times)
    edge[[49, 69]] = 1.0
    stream = model.stream(tabor=tabor)
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


@pytest.mark.parametrize("name", ["M1-concat", "M2-concat", "M4-gated"])
@pytest.mark.filterwarnings("ignore:.*extrapolates")
def test_the_clock_starts_with_the_history(name, stirred, history):
    times, indentations, tabor = history
    stream = Surrogate(stirred(name)[0]).stream(tabor=tabor)
    base = steps(stream, times, indentations)
    stream.reset()
    late = steps(stream, times + 1024.0, indentations)
    assert stream.time == times[-1] + 1024.0
    # Times lose their last digits beside a late clock.
    np.testing.assert_allclose(late, base, rtol=1e-6, atol=1e-6)


def test_a_stream_outside_the_training_warns(model):
    with pytest.warns(ExtrapolationWarning, match=r"tabor = 50 lies outside \["):
        stream = model.stream(tabor=50.0)
    with pytest.warns(ExtrapolationWarning, match=r"start_indentation = 1 lies outside \[-110\.\d+, -104"):
        stream.step(0.0, 1.0)


@pytest.mark.filterwarnings("ignore:.*extrapolates")
def test_a_damaged_network_is_refused(stirred):
    backend, _ = stirred("M3-concat")
    graph = backend.graph()
    first = next(operation for operation in graph.operations if operation.kind == "dense")
    for name, values in (("kernel", np.zeros((3, 3))), ("bias", np.zeros(1)), ("kernel", None)):
        weights = {key: array for key, array in graph.weights.items() if key != f"{first.name}/{name}"}
        if values is not None:
            weights[f"{first.name}/{name}"] = values
        with pytest.raises(ValueError, match=r"weights that fit"):
            Stream(Graph(graph.operations, weights), backend.scaling, tabor=1.0)


def test_a_step_allocates_nothing_that_stays(model):
    stream = model.stream(tabor=1.0)
    stream.step(-1.0, -(np.pi ** (2 / 3)))
    for index in range(50):
        stream.step(index, 1.0)
    gc.collect()
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for index in range(50, 2050):
        stream.step(index, 1.0)
    now, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert now - before < 2_000
    # The widest vector of the network would be 5 kB.
    assert peak - before < 4_000


def test_hyperbolic_tangent():
    values = np.linspace(-20.0, 20.0, 400_001).astype(np.float32)
    expected = np.tanh(values.astype(np.float64))
    hyperbolic_tangents(values)
    np.testing.assert_allclose(values, expected, rtol=0.0, atol=4e-7)
    broken = np.array([np.nan, np.inf, -np.inf], dtype=np.float32)
    hyperbolic_tangents(broken)
    assert np.isnan(broken).all()


@pytest.mark.filterwarnings("ignore:.*extrapolates")
def test_inputs_of_the_material_need_one_that_is_known(stirred, history):
    times, indentations, tabor = history
    backend, _ = stirred("M3-concat", "F")
    forces = [
        Stream(backend.graph(), backend.scaling, tabor=tabor, **ratio).run(times, indentations, 0.0 * times)
        for ratio in ({}, {"modulus_ratio": 0.1}, {"modulus_ratio": 0.5})
    ]
    np.testing.assert_array_equal(forces[0], forces[1])
    assert np.abs(forces[2] - forces[0]).max() > 1e-3
    ranges = {name: bounds for name, bounds in backend.scaling.ranges.items() if name != "modulus_ratio"}
    scaling = dataclasses.replace(backend.scaling, ranges=ranges)
    with pytest.raises(ValueError, match=r"one known modulus ratio for features F\. Received: none"):
        Stream(backend.graph(), scaling, tabor=tabor)


@pytest.mark.filterwarnings("ignore:.*extrapolates")
def test_weights_of_every_operation_begin_on_a_cache_line(stirred):
    backend, _ = stirred("M3-concat")
    stream = Stream(backend.graph(), backend.scaling, tabor=1.0)
    column = COLUMNS.index("weights")
    assert stream._weights.ctypes.data % 64 == 0
    assert not (stream._program[:, column] * 4 % 64).any()

"""A stream of a pretrained model says step by step what the model says of the whole history."""

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from bem.dataset.physical_steps import physical_grid
from surrogate.inference.validity import ExtrapolationWarning
from surrogate.pretrained.model import NAMES

PROTOCOL = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=0.7, unloading_rate=40.0)
TABOR, RATIO = 1.3, 0.07


def whole(model):
    """Instants, indentations, marks and forces of the history."""
    (found,) = model.trajectories(PROTOCOL, tabor=TABOR, modulus_ratio=RATIO)
    edges = np.zeros(found.time.size)
    edges[[model.counts[0] - 1, model.counts[0] + model.counts[1] - 1]] = 1.0
    return found.time, found.indentation, edges, found.force


def compare(model):
    times, indentations, edges, force = whole(model)
    stream = model.stream(tabor=TABOR, modulus_ratio=RATIO)
    # Where the first step is of no interest.
    found = stream.run(times + 5.0, indentations, edges)
    assert np.ptp(force) > 0.1
    np.testing.assert_allclose(found, force, rtol=0.0, atol=2e-5 * np.ptp(force))
    return stream, found


def test_steps_equal_the_whole_history(model):
    compare(model)


@pytest.mark.parametrize("name", NAMES)
def test_steps_of_the_published_models_equal_the_whole_history(name):
    try:
        published = surrogate.load(name)
    except FileNotFoundError:
        pytest.skip(f"{name} is not published here")
    compare(published)


def test_a_stream_starts_anew_and_goes_back(model):
    times, indentations, edges, _ = whole(model)
    stream, found = compare(model)
    stream.reset()
    assert stream.time == -np.inf
    before = stream.run(times[:40], indentations[:40], edges[:40])
    now = stream.snapshot()
    after = stream.run(times[40:], indentations[40:], edges[40:])
    stream.restore(now)
    assert stream.step(float(times[40]), float(indentations[40]), bool(edges[40])) == after[0]
    np.testing.assert_allclose(np.concatenate([before, after]), found, rtol=0.0, atol=1e-5 * np.ptp(found))
    other = model.stream(tabor=TABOR, modulus_ratio=2.0 * RATIO)
    with pytest.raises(ValueError, match="Expected a snapshot of fast"):
        other.restore(now)
    with pytest.raises(ValueError, match="Expected a time after"):
        stream.step(float(times[40]), 0.0)


def test_the_solid_matters_and_is_checked(model):
    times, indentations, edges, force = whole(model)
    other = model.stream(tabor=TABOR, modulus_ratio=0.5).run(times, indentations, edges)
    assert np.abs(other - force).max() > 1e-3 * np.ptp(force)
    with pytest.raises(ValueError, match=r"modulus ratios in \(0, 1\]"):
        model.stream(tabor=TABOR, modulus_ratio=2.0)
    with pytest.warns(ExtrapolationWarning, match="modulus_ratio"):
        model.stream(tabor=TABOR, modulus_ratio=1e-3)


def test_a_step_allocates_no_array(model):
    import tracemalloc

    times, indentations, edges, _ = whole(model)
    stream = model.stream(tabor=TABOR, modulus_ratio=RATIO)
    points = list(zip(times.tolist(), indentations.tolist(), edges.tolist(), strict=True))
    stream.step(*points[0])
    tracemalloc.start()
    for point in points[1:]:
        stream.step(*point)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 4096


def test_the_steps_are_those_of_the_grid(model):
    times, indentations, _, _ = whole(model)
    quantities = {"tabor": TABOR, "modulus_ratio": RATIO} | {
        name: getattr(PROTOCOL, name) for name in ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
    }
    grid = physical_grid(**quantities)
    np.testing.assert_array_equal(times, grid[0][0])
    np.testing.assert_array_equal(indentations, grid[1][0])

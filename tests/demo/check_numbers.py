"""The page's own arithmetic, steps and `fast`, against Python without a browser; run by `make test-demo`."""

import json
import subprocess
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import numpy_helper
from scipy.special import erf

import surrogate
from bem.dataset.designs import QUANTITIES
from bem.dataset.physical_steps import physical_grid
from surrogate.data.features import edge_from_counts
from tests.demo.check_in_browser import python

NAMES = (*QUANTITIES, "modulus_ratio")
TOLERANCE = 1e-5


@pytest.fixture(scope="module")
def model():
    return surrogate.load("fast")


@pytest.fixture(scope="module")
def solids(model):
    """Corners of the training, and protocols over all of it, by name."""
    rng = np.random.default_rng(11)
    low, high = np.log([model.scaling.ranges[name] for name in NAMES]).T
    corners = np.array([[(row >> bit) & 1 for bit in range(6)] for row in range(64)], dtype=float)
    values = np.exp(low + (high - low) * np.concatenate([corners, rng.random((136, 6))]))
    values[:, 5] = np.minimum(values[:, 5], 1.0)
    return dict(zip(NAMES, values.T.copy(), strict=True))


@pytest.fixture(scope="module")
def protocols(solids):
    return [dict(zip(NAMES, row, strict=True)) for row in np.array([*solids.values()]).T.tolist()]


@pytest.fixture(scope="module")
def page(model, protocols):
    """Steps and predictions of the page's TypeScript."""
    script = Path(__file__).with_name("numbers.mjs")
    cases = json.dumps({"protocols": protocols, "counts": list(model.counts)})
    done = subprocess.run(["node", script], input=cases, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_steps_are_those_of_python(solids, model, page):
    times, indentations = physical_grid(**solids, counts=model.counts)
    np.testing.assert_allclose([row["times"] for row in page], times, rtol=1e-11)
    np.testing.assert_allclose([row["indentations"] for row in page], indentations, rtol=1e-11, atol=1e-10)
    np.testing.assert_array_equal([row["edge"] for row in page], edge_from_counts(model.counts, len(times)))


def test_time_is_linear_within_phases(page):
    """So that a ramp stays straight; a phase is as wide as the logarithm of its length."""
    for row in page:
        axis = row["axis"]
        times, ends = np.array(row["times"]), np.array(axis["ends"])
        np.testing.assert_allclose(axis["places"], np.interp(times, axis["corners"], ends), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(axis["back"], times, rtol=1e-9, atol=1e-9)
        assert axis["real"] == row["times"]
        durations = np.diff(axis["corners"])
        np.testing.assert_allclose(np.diff(ends), np.log10(durations / 2e-4), rtol=1e-9)


def in_double(model):
    """A copy of a model whose dense layers are evaluated in double precision."""
    graph = onnx.load_model_from_string(model.network.content()).graph
    weights = [numpy_helper.to_array(item).astype(float) for item in graph.initializer if "/" in item.name]
    steps = list(model.network.steps)

    def scaled(sequence, tabor):
        tabors = np.broadcast_to(tabor[:, np.newaxis], (len(tabor), len(steps), 1))
        values = np.concatenate([sequence[:, steps], tabors], axis=2).reshape(len(tabor), -1).astype(float)
        for at in range(0, len(weights), 2):
            values = values if at == 0 else 0.5 * values * (1.0 + erf(values / np.sqrt(2.0)))
            values = values @ weights[at] + weights[at + 1]
        return values

    copy = surrogate.load(model.name)
    copy.network.scaled = scaled
    return copy


@pytest.mark.parametrize("precision", ["double", "single"])
def test_fast_predicts_what_python_does(model, protocols, page, precision):
    """To 1e-5 at corners and everywhere in double precision, and at fifty protocols inside as `predict` has it.

    Single precision decides elsewhere which of two nearly equal steps is the highest, and so the parabola.
    """
    reference, chosen = (in_double(model), slice(None)) if precision == "double" else (model, slice(64, 114))
    for row, expected in zip(page[chosen], python(reference, protocols[chosen]), strict=True):
        largest = np.abs(expected.force).max()
        for name, values in (
            ("force", expected.force),
            ("lower", expected.force_lower),
            ("upper", expected.force_upper),
        ):
            np.testing.assert_allclose(row[name], values, rtol=TOLERANCE, atol=TOLERANCE * largest)
        assert row["pullOff"]["force"] == pytest.approx(expected.pull_off_force, rel=TOLERANCE)
        assert row["pullOff"]["time"] == pytest.approx(expected.pull_off_time, rel=TOLERANCE)
        assert row["interval"] == pytest.approx(expected.pull_off_interval, rel=TOLERANCE)
        work = np.ptp(expected.indentation) * largest
        assert row["hysteresis"] == pytest.approx(expected.hysteresis, rel=TOLERANCE, abs=TOLERANCE * work)

"""The page's own arithmetic, steps and `fast`, against Python without a browser; run by `make test-demo`."""

import json
import subprocess
from dataclasses import fields
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.special import erf

from bem.dataset.designs import QUANTITIES
from experiments.cases import RANGES
from surrogate.data.dense import Stage
from surrogate.data.features import edge_from_counts
from surrogate.data.fronts import Front
from surrogate.data.solid_features import solid_features
from surrogate.solids import SolidSurrogate
from tests.demo.check_in_browser import python, steps

TOLERANCE = 1e-5
SLOWEST = 10.0
"""Milliseconds of a prediction, so that a corner can be dragged."""
CORNERS = 64


@pytest.fixture(scope="module")
def solids():
    """Corners of the ranges, a little inside and at their ends, protocols all over, elastic solids and nearly so."""
    rng = np.random.default_rng(11)
    low, high = np.log([*RANGES.values()]).T
    corners = (np.arange(CORNERS)[:, np.newaxis] >> np.arange(6)) & 1
    places = np.concatenate([0.06 + 0.88 * corners, corners, rng.random((140, 6))])
    values = np.exp(low + (high - low) * places)
    values[-40:, 5] = np.repeat([1.0, 1.0 - 1e-6, 0.9999, 0.98], 10)
    return dict(zip(RANGES, np.minimum(values, [*np.exp(high[:5]), 1.0]).T.copy(), strict=True))


@pytest.fixture(scope="module")
def protocols(solids):
    return [dict(zip(RANGES, row, strict=True)) for row in np.array([*solids.values()]).T.tolist()]


@pytest.fixture(scope="module")
def expected(fast, protocols):
    return python(fast, protocols)


@pytest.fixture(scope="module")
def page(fast, protocols, expected):
    """What the page's TypeScript finds."""
    script = Path(__file__).with_name("numbers.mjs")
    times = [trajectory.pull_off_time for trajectory in expected]
    cases = json.dumps({"protocols": protocols, "counts": list(fast.counts), "pullOffTimes": times})
    done = subprocess.run(["node", script], input=cases, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def rows(page):
    return page["rows"]


def test_features_are_those_of_python(solids, rows):
    # An elastic contact knows no time.
    timed = {name: np.where(solids["modulus_ratio"] < 1.0, solids[name], 1.0) for name in QUANTITIES[2:]}
    strengths = 1.0 - solids["modulus_ratio"][:, np.newaxis]
    features = solid_features(solids | timed, strengths, np.ones(strengths.shape))
    np.testing.assert_allclose([row["features"] for row in rows], features, rtol=1e-9, atol=1e-9)


def test_steps_are_those_of_python(protocols, fast, expected, rows):
    times, indentations = steps(protocols, [trajectory.pull_off_time for trajectory in expected])
    found = [row["steps"] for row in rows]
    np.testing.assert_allclose([each["times"] for each in found], times, rtol=1e-11)
    np.testing.assert_allclose([each["indentations"] for each in found], indentations, rtol=1e-11, atol=1e-9)
    np.testing.assert_array_equal([each["edge"] for each in found], edge_from_counts(fast.counts, len(times)))


def test_histories_are_interpolated_as_by_scipy(fast, rows):
    ends = [0, *np.cumsum(fast.counts) - 1]
    for row in rows:
        values = np.sin(row["steps"]["indentations"])
        for begin, end in pairwise(ends):
            phase = slice(begin, end + 1)
            instants, wanted = (np.array(row[name]["times"][phase]) for name in ("steps", "other"))
            cubic = PchipInterpolator(instants - instants[0], values[phase])
            np.testing.assert_allclose(row["interpolated"][phase][1:], cubic(wanted - instants[0])[1:], atol=1e-6)


def test_time_is_linear_within_phases(rows):
    """So that a ramp stays straight; a phase is as wide as the logarithm of its length."""
    for row in rows:
        axis = row["axis"]
        times, ends = np.array(row["steps"]["times"]), np.array(axis["ends"])
        np.testing.assert_allclose(axis["places"], np.interp(times, axis["corners"], ends), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(axis["back"], times, rtol=1e-9, atol=1e-9)
        assert axis["real"] == row["steps"]["times"]
        durations = np.diff(axis["corners"])
        np.testing.assert_allclose(np.diff(ends), np.log10(durations / 2e-4), rtol=1e-9)


class StageInDouble(Stage):
    """A stage that is evaluated in double precision."""

    def _part(self, features, places):
        hidden = (features - self.polynomial.mean) / self.polynomial.deviation
        for kernel, bias in zip(self.kernels[:-1], self.biases[:-1], strict=True):
            hidden = hidden @ kernel + bias
            hidden = 0.5 * hidden * (1.0 + erf(hidden / np.sqrt(2.0)))
        left = hidden @ self.kernels[-1] + self.biases[-1]
        for front, (where, place) in zip(self.fronts, places, strict=True):
            weights = (values.astype(float) for values in vars(front).values())
            left[:, where] += Front(*weights)(hidden, place)
        return self.polynomial(features) + left * self.polynomial.scale + self.polynomial.offset


def in_double(model):
    """A copy of a model whose stages are evaluated in double precision."""
    stages = [StageInDouble(*(getattr(stage, field.name) for field in fields(stage))) for stage in model.stages]
    return SolidSurrogate(stages, model.reach, counts=model.counts, name=model.name, intervals=model.intervals)


@pytest.mark.parametrize("precision", ["double", "single"])
def test_fast_predicts_what_python_does(fast, protocols, rows, expected, precision):
    """To 1e-5 at corners and everywhere in double precision, and at fifty protocols inside as `predict` has it.

    Where Python says that it extrapolates, the page predicts nothing.
    """
    chosen = slice(None)
    if precision == "double":
        expected = python(in_double(fast), protocols)
        assert [row["prediction"] is None for row in rows] == [bool(each.extrapolated) for each in expected]
        assert all(row["prediction"] for row in rows[:CORNERS])
    else:
        chosen = slice(2 * CORNERS, 2 * CORNERS + 50)
    for row, trajectory in zip(rows[chosen], expected[chosen], strict=True):
        if (found := row["prediction"]) is None:
            continue
        largest, band = np.abs(trajectory.force).max(), found["band"]
        for history, wanted in (
            (found["force"], trajectory.force),
            (band["lower"], trajectory.force_lower),
            (band["upper"], trajectory.force_upper),
        ):
            np.testing.assert_allclose(history, wanted, rtol=TOLERANCE, atol=TOLERANCE * largest)
        assert found["pullOff"]["force"] == pytest.approx(trajectory.pull_off_force, rel=TOLERANCE)
        assert found["pullOff"]["time"] == pytest.approx(trajectory.pull_off_time, rel=TOLERANCE)
        assert found["band"]["pullOff"] == pytest.approx(trajectory.pull_off_interval, rel=TOLERANCE)
        work = np.ptp(trajectory.indentation) * largest
        assert found["hysteresis"] == pytest.approx(trajectory.hysteresis, rel=TOLERANCE, abs=TOLERANCE * work)


def test_prediction_is_quick_enough_to_drag_a_corner(page):
    assert page["milliseconds"] < SLOWEST

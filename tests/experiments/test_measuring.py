"""What the measurements share: numbers for JSON, spreads, errors, progress."""

import json

import numpy as np
import pytest

from experiments import measuring
from experiments.measuring import exponent, force_error, plain, spread


def test_plain_holds_nothing_json_cannot():
    content = {"a": np.array([1.0, np.nan]), "b": (np.int64(3), np.inf), "c": np.bool_(True)}
    assert json.dumps(plain(content), allow_nan=False) == '{"a": [1.0, null], "b": [3, null], "c": true}'


def test_spread_and_exponent():
    assert spread([1.0, 2.0, 3.0, np.nan])["median"] == 2.0
    assert spread([])["count"] == 0
    slope, error = exponent([1.0, 2.0, 4.0], [3.0, 12.0, 48.0])
    assert (slope, error) == (pytest.approx(2.0), pytest.approx(0.0, abs=1e-12))


def test_force_error_counts_what_is_said():
    exact = np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]])
    found = np.array([[0.5, 1.0, np.nan], [np.nan, np.nan, np.nan]])
    np.testing.assert_allclose(force_error(found, exact), [0.125, np.nan])


def test_progress_says_what_is_left(monkeypatch, capsys):
    monkeypatch.setattr(measuring, "SAID_EVERY", -1.0)
    assert list(measuring.progress(iter("abc"), "letters", 3)) == ["a", "b", "c"]
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in lines] == ["letters: 1 of 3", "letters: 2 of 3", "letters: 3 of 3"]
    assert all(line.endswith(" left") for line in lines)

"""The study of intervals draws contacts, fits them and counts."""

import json
import types

import numpy as np

from bem.lab.fitting import ALL
from experiments.lab import lab_coverage


def test_cases_are_drawn_from_their_ranges_and_again_the_same():
    truths = [lab_coverage.drawn(np.random.default_rng([0, number])) for number in range(20)]
    for name, (low, high) in lab_coverage.LOGARITHMIC.items():
        assert all(low <= truth[name] <= high for truth in truths)
        assert len({truth[name] for truth in truths}) == 20
    assert truths[3] == lab_coverage.drawn(np.random.default_rng([0, 3]))


def test_noise_is_a_share_of_the_range_of_the_force(monkeypatch):
    truth = lab_coverage.drawn(np.random.default_rng(0))
    ramp = types.SimpleNamespace(completed=True, time=np.array([0.0, 0.1]), at=lambda instants: 10.0 * instants)
    monkeypatch.setattr(lab_coverage, "simulate", lambda *_: ramp)
    draws = [types.SimpleNamespace(standard_normal=np.zeros), types.SimpleNamespace(standard_normal=np.ones)]
    clean, noisy = (lab_coverage.measured(truth, rng) for rng in draws)
    np.testing.assert_allclose(noisy.force - clean.force, lab_coverage.NOISE * np.ptp(clean.force))


def test_a_fit_that_fails_counts_as_a_miss(tmp_path, monkeypatch, capsys):
    def fails(*_):
        raise lab_coverage.FitError("the fit did not converge")

    monkeypatch.setattr(lab_coverage, "fit", fails)
    lab_coverage.main(cases=1, seed=0, jobs=1, out=tmp_path / "a.json")
    found = json.loads((tmp_path / "a.json").read_text())
    assert found["fitted"] == 0
    assert found["inside"] == dict.fromkeys(ALL, 0)
    assert found["results"][0]["failure"] == "the fit did not converge"
    assert "0 of 1 fitted" in capsys.readouterr().out


def test_a_case_says_which_intervals_hold_the_truth(tmp_path):
    lab_coverage.main(cases=1, seed=0, jobs=1, out=tmp_path / "a.json")
    found = json.loads((tmp_path / "a.json").read_text())
    assert found["fitted"] == 1
    result = found["results"][0]
    assert set(result["inside"]) == set(ALL)
    assert sum(result["inside"].values()) >= 4

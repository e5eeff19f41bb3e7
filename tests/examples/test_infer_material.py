"""The posterior contains the truth, is that of the solver, and the picture is drawn."""

import sys

import numpy as np
import pytest

import surrogate
from tests.examples.test_examples import example


@pytest.fixture(scope="module")
def module():
    return example("infer_material")


@pytest.fixture(scope="module")
def model():
    try:
        return surrogate.load("fast")
    except FileNotFoundError:
        pytest.skip("fast is not published here")


def test_curves_of_surrogate_and_solver_are_recorded_at_the_same_instants(module, model):
    points = np.log([module.TRUE, (0.8, 0.3, 4.0), (3.1, 0.03, 0.25)])
    found, true = module.predicted(model, points), module.simulated(points, "draft")
    assert found.shape == true.shape == (3, 200)
    assert np.all(np.abs(found - true).max(axis=1) < 0.1 * np.ptp(true, axis=1))
    assert np.all(np.abs(found - true).mean(axis=1) < 0.015 * np.ptp(true, axis=1))
    # The true contact has peeled off by the end of the record.
    assert abs(true[0, -1]) < 0.01 * true[0].max()


def test_the_posterior_is_the_solvers_and_contains_the_truth(module, model, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(module, "CALIBRATION", 64)
    picture = tmp_path / "posterior.png"
    monkeypatch.setattr(sys, "argv", ["infer_material", str(picture), "--samples", "4000", "--solver-samples", "300"])
    kept = []
    infer = module.infer
    monkeypatch.setattr(module, "infer", lambda *one, **more: kept.append(infer(*one, **more)) or kept[0])
    module.main()
    assert picture.stat().st_size > 10_000
    said = capsys.readouterr().out
    assert said.count("of equal weight") == 3
    assert "processor time of a sample: surrogate" in said
    found = {name: sample.summary() for name, sample in kept[0].posteriors.items()}
    surrogates, solvers = found[module.SURROGATE], found[module.SOLVER]
    # Three standard deviations hold the truth; a quarter of one is the difference that the draws alone make at most.
    assert np.all(np.abs(surrogates["mean"] - module.TRUE) < 3.0 * surrogates["sd"])
    assert np.all(np.abs(surrogates["mean"] - solvers["mean"]) < 0.4 * solvers["sd"])
    np.testing.assert_allclose(surrogates["sd"], solvers["sd"], rtol=0.25)
    assert all(sample.effective > 0.1 * len(sample) for sample in kept[0].posteriors.values())
    assert kept[0].seconds[module.SOLVER] > kept[0].seconds[module.SURROGATE]


def test_too_few_samples_are_refused(module, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["infer_material", "--solver-samples", "3"])
    with pytest.raises(SystemExit):
        module.main()
    assert "--solver-samples must be at least 100; received 3" in capsys.readouterr().err

"""Small models are trained once, measured as what they are, and drawn beside those of the paper."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from bem import simulate
from experiments import common
from experiments.surrogates import size_error
from experiments.surrogates.hidden_protocols import Hidden
from surrogate.data.dataset import TrajectoryDataset
from tests.physical_data import physical_dataset

pytest.importorskip("surrogate.training.pretrained")
COUNT = 160
DRAW = Hidden.draw


@pytest.fixture
def dataset(monkeypatch):
    """Any forces that depend on the inputs, in place of a file of the solver's; the solver at its quickest."""
    held = physical_dataset(COUNT)
    monkeypatch.setattr(TrajectoryDataset, "load", lambda _: held)
    monkeypatch.setattr(size_error, "limit_threads", lambda _: None)

    def simulated(row, *, accuracy, modulus_ratio):
        assert accuracy == "standard"
        return simulate(*common.problem(row, modulus_ratio), "draft")

    monkeypatch.setattr(common, "simulated", simulated)
    return held


def measure(folder, **more):
    out = folder / "size_error.json"
    size_error.main(2, [3, 5], COUNT, 1, folder / "any.h5", folder / "runs", folder / "models", out, **more)
    return json.loads(out.read_text(encoding="utf-8"))


def test_models_are_trained_once_and_compared_with_the_papers(dataset, tmp_path, capsys):
    published = common.MODELS.absolute() / "M1-concat"
    (tmp_path / "models").mkdir()
    if (published / "model.onnx").is_file():
        (tmp_path / "models/M1-concat").symlink_to(published)
    content = measure(tmp_path)
    assert capsys.readouterr().out.count("epoch 1 of 1") == 2
    small, large = content["lstm"]
    for row in (small, large):
        units = row["units"]
        # The LSTM of 13 inputs, and the readout of 64.
        assert row["parameters"] == 4 * units * (13 + units + 1) + 64 * (units + 1) + 65
        assert row["test"]["mse"] > 0.0
        assert all(row[kind][error]["p90"] > 0.0 for kind in ("paper", "any") for error in ("pull_off", "force"))
    if content["paper"]:
        (paper,) = content["paper"]
        metrics = json.loads((Path(published) / "metrics.json").read_text(encoding="utf-8"))
        assert paper["parameters"] == metrics["parameters"]
        assert paper["test"]["mse"] == metrics["test"]["mse"]["mean"]
        # Nobody trained the others.
        assert paper["paper"]["force"]["p50"] < small["paper"]["force"]["p50"]
    again = measure(tmp_path)
    assert "epoch" not in capsys.readouterr().out.replace("'epochs'", "")
    assert again["lstm"] == content["lstm"]
    shutil.rmtree(tmp_path / "runs")
    kept = measure(tmp_path, keep_lstms=True)
    assert (kept["lstm"], kept["paper"]) == (content["lstm"], content["paper"])
    assert not (tmp_path / "runs").exists()


def test_only_the_same_lstms_are_kept(tmp_path):
    with pytest.raises(ValueError, match=r"must hold LSTMs of \[3, 5\] units .*; received \[\] with"):
        measure(tmp_path, keep_lstms=True)


def test_trainings_on_other_data_are_refused(dataset, tmp_path):
    measure(tmp_path)
    object.__setattr__(dataset, "sha256", "1" * 64)
    with pytest.raises(ValueError, match=r"must be of the data set .*any\.h5; received one of another"):
        measure(tmp_path)


def test_errors_of_a_force_that_is_off_by_a_hundredth():
    hidden = DRAW(2, 0.1)
    true = [simulate(*common.problem(*hidden.row(row)), "draft") for row in range(2)]

    class Off:
        def __init__(self, one):
            self.one, self.time = one, one.time
            self.pull_off_force, self.hysteresis = 1.01 * one.pull_off_force, 0.98 * one.hysteresis

        def at(self, times):
            return self.one.at(times) + 0.01 * np.ptp(self.one.force)

    found = size_error.compared([Off(one) for one in true], true, hidden)
    assert found["pull_off"]["p50"] == pytest.approx(1.0)
    assert found["hysteresis"]["p90"] == pytest.approx(2.0)
    # The range of the force is that at the steps, which is a little less.
    assert 1.0 <= found["force"]["p50"] < 1.3

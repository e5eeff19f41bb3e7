"""An architecture of a user's own: trained, evaluated, exported and listed without touching the package."""

import hashlib
import json
import sys

import pytest
from typer.testing import CliRunner

from experiments.paper import architecture_graphs
from paper_figures.__main__ import save
from paper_figures.models import figure_architectures
from surrogate.architectures.naming import FAMILIES
from surrogate.cli import app as cli
from surrogate.onnx import keras_layers

OWN = '''
import keras

import surrogate
from surrogate.architectures.common import inputs
from surrogate.architectures.layers import AppendTabor


def own(conditioning, features, name):
    """One small layer.

    And more words.
    """
    sequence, tabor = inputs(features)
    hidden = keras.layers.LSTM(3, return_sequences=True)(AppendTabor()(sequence, tabor))
    return keras.Model([sequence, tabor], keras.layers.Dense(1)(hidden), name=name)


surrogate.register("Own-1", own, conditionings=["concat"])
'''


@pytest.fixture
def own(tmp_path, dataset_path, monkeypatch):
    """A user's file, and how a command of `surrogate` on it ends."""
    (tmp_path / "own.py").write_text(OWN)
    (tmp_path / "fast.toml").write_text('name = "f"\nseed = 0\nbatch_size = 24\nepochs = 2\nlearning_rate = 1e-2\n')
    monkeypatch.setattr("surrogate.training.stopping.signal.signal", lambda *_: None)
    monkeypatch.chdir(tmp_path)
    training = ["--dataset", str(dataset_path), "--recipe", "fast.toml", "--models", "models", "--runs", "runs"]
    places = {
        "train": training,
        "evaluate": ["--dataset", str(dataset_path), "--models", "models"],
    }

    def run(*words, fails=False):
        result = CliRunner().invoke(cli.app, [*words, *places.get(words[0], ["--models", "models"])])
        assert bool(result.exception) == fails, result.output + str(result.exception)
        return str(result.exception) if fails else result.output

    return run


def test_users_file_from_training_to_figure(own, tmp_path, monkeypatch):
    assert "name must be one of" in own("train", "Own-1-concat", fails=True)
    assert "published in" in own("train", "Own-1-concat", "--architecture", "own.py")
    described = json.loads((tmp_path / "models/Own-1-concat/run.json").read_text())
    digest = hashlib.sha256(OWN.encode()).hexdigest()
    assert described["architecture_file"] == {"name": "own.py", "sha256": digest}
    assert "already published" in own("train", "Own-1-concat", "--architecture", "own.py")

    del FAMILIES["Own-1"]
    assert not sys.modules.keys() & {"own"}
    wanted = (
        f"own.py ({digest[:12]}), which built Own-1-concat, must be given by --architecture or an import; received no "
    )
    assert own("evaluate", "Own-1-concat", fails=True).startswith(wanted)
    assert "hysteresis_percent" in own("evaluate", "Own-1-concat", "--architecture", "own.py")
    own("export", "Own-1-concat", "--architecture", "own.py")
    with monkeypatch.context() as patch:
        # A layer that computes otherwise than it is told, as far as the comparison with Keras can tell.
        dense = keras_layers._LAYERS["Dense"]
        patch.setitem(keras_layers._LAYERS, "Dense", lambda layer, source: dense(layer, source) + dense(layer, source))
        refused = own("export", "Own-1-concat", "--architecture", "own.py", fails=True)
        assert "the ONNX file must agree with Keras to 0.001 of the force's range" in refused
    listed = own("list", "--architecture", "own.py")
    assert "Own-1-concat" in listed.splitlines()[2]
    protocol = ["--tabor", "1", "--peak-indentation", "20", "--loading-rate", "10", "--dwell-time", "1"]
    del FAMILIES["Own-1"]
    own("predict", "Own-1-concat", *protocol, "--unloading-rate", "10")

    files = [str(tmp_path / "own.py")]
    graphs = architecture_graphs.study(architecture=files)
    save(figure_architectures.compose(graphs, family="Own-1"), tmp_path / "mine.pdf")
    assert (tmp_path / "figure-architecture-Own-1.pdf").stat().st_size > 1000
    with pytest.raises(ValueError, match=r"family must be one of Own-1; .*'M1'"):
        figure_architectures.compose(graphs, family="M1")
    left = {path.name for path in tmp_path.iterdir()}
    drawn = {f"figure-architecture-Own-1.{kind}" for kind in ("pdf", "png")}
    assert left == {"own.py", "fast.toml", "models", "runs", *drawn}


def test_changed_file_is_another_training(own, tmp_path):
    narrow = OWN.replace("LSTM(3, return_sequences=True)", "Dense(3)")  # which compiles sooner
    (tmp_path / "own.py").write_text(narrow)
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "STOP").touch()
    own("train", "Own-1-concat", "--architecture", "own.py", fails=True)  # it stops after an epoch
    (tmp_path / "runs" / "STOP").unlink()
    (tmp_path / "own.py").write_text(narrow.replace("Dense(3", "Dense(3, activation='tanh'"))
    refused = own("train", "Own-1-concat", "--architecture", "own.py", fails=True)
    assert "must be of the same training" in refused
    assert refused.endswith("received a checkpoint of another architecture file")
    (tmp_path / "own.py").write_text(narrow)
    own("train", "Own-1-concat", "--architecture", "own.py")
    (tmp_path / "own.py").write_text(narrow + "\n# Other words.\n")
    assert "received own.py (" in own("evaluate", "Own-1-concat", "--architecture", "own.py", fails=True)
    refused = own("train", "Own-1-concat", "--architecture", "own.py", fails=True)
    assert "a published model of another architecture file" in refused

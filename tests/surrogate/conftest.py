"""A small data set file with closed-form forces, test data only, no contact mechanics in it; and tiny models."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import bem.dataset.file
from bem import Scene, StandardLinearSolid
from bem.dataset.measurement_steps import measurement_grid
from bem.dataset.records import JUMP_QUANTITIES, SCALARS
from experiments.common import scenes as scenes

COUNTS = (50, 20, 50)


def write_dataset(path: Path, count: int, seed: int = 0) -> Path:
    rng = np.random.default_rng(seed)
    protocols = {
        "tabor": np.exp(rng.uniform(np.log(0.2), np.log(3.2), count)),
        "peak_indentation": np.exp(rng.uniform(np.log(2.0), np.log(100.0), count)),
        "loading_rate": np.exp(rng.uniform(np.log(0.1), np.log(1e3), count)),
        "dwell_time": np.exp(rng.uniform(np.log(1e-3), np.log(3.0), count)),
        "unloading_rate": np.exp(rng.uniform(np.log(0.1), np.log(1e3), count)),
    }
    _, indentations = measurement_grid(**protocols, counts=COUNTS)
    start = indentations[:, :1]
    progress = (indentations - start) / (indentations.max(axis=1, keepdims=True) - start)
    unloading = np.arange(sum(COUNTS)) >= COUNTS[0] + COUNTS[1]
    bump = 3.0 * protocols["tabor"][:, None] * np.exp(-(((progress - 0.2) / 0.1) ** 2)) * unloading
    force = 1.0 + bump - np.clip(indentations, 0.0, None) ** 1.5
    native = force[:, COUNTS[0] + COUNTS[1] - 1 :].max(axis=1) * 1.01
    columns = {
        "index": np.arange(count),
        "status": np.zeros(count, dtype=np.uint8),
        "reason": np.full(count, "", dtype=object),
        "fms/force": force.astype(np.float32),
        "jumps/trajectory": np.empty(0, dtype=np.int64),
        **{f"protocols/{name}": values for name, values in protocols.items()},
        **{f"scalars/{name}": np.ones(count, dtype=kind) for name, kind in SCALARS.items()},
        **{f"jumps/{name}": np.empty(0) for name in JUMP_QUANTITIES},
        "scalars/pull_off_force": native,
    }
    what = {"design": "test", "ranges": {}, "modulus_ratio": 0.1, "seed": seed, "count": count, "accuracy": "test"}
    identity = {**what, "counts": list(COUNTS), "native": False, "shard": "1/1", "solver": "a closed form"}
    cost = {"versions": {}, "host": "a machine", "wall_seconds": 1.0, "core_seconds": 1.0, "workers": 1}
    bem.dataset.file.write_file(path, columns, what | cost | {"shard": "1/1", "campaign": identity})
    return path


@pytest.fixture(scope="session")
def dataset_path(tmp_path_factory):
    return write_dataset(tmp_path_factory.mktemp("data") / "dataset.h5", 60)


@pytest.fixture(scope="session")
def dataset(dataset_path):
    from surrogate.data.dataset import TrajectoryDataset

    return TrajectoryDataset.load(dataset_path)


@pytest.fixture(scope="session")
def grid(dataset):
    return dataset.grid(np.arange(len(dataset)))


def scaling_of(dataset, features="D", split=None):
    """The scaling of a training on a data set."""
    from surrogate.training.identity import Run
    from surrogate.training.recipe import Recipe
    from surrogate.training.runs import training_examples

    run = Run("M1-concat", dataset, split or dataset.split(), Recipe.load("swift"), features=features)
    return training_examples(run)[0]


def trained_as(folder, dataset, recipe, split=None, **run):
    """What a model directory says of its training."""
    folder.mkdir(parents=True)
    content = {"dataset_sha256": dataset.sha256, "architecture": folder.name, "features": "D", "backend": "jax"}
    (folder / "run.json").write_text(json.dumps(content | {"recipe": recipe.as_dict()} | run))
    (split or dataset.split()).save(folder / "split.json")
    return folder


def write_onnx(path, network):
    """Export a Keras network to a file, as training does."""
    from surrogate.onnx.export import file_content

    path.write_bytes(file_content(network.model, network.scaling, name=network.name, architecture=network.name))
    return path


def build_by(patch, build):
    """Let trainings and predictions build this model, whatever name they ask for."""
    for module in ("surrogate.training.runs", "surrogate.networks"):
        patch.setattr(f"{module}.build", build)


def builder(hidden):
    """A function that builds a model of one hidden layer under any name, as `surrogate.build` does."""

    def build(name, features="D"):
        import keras

        from surrogate.architectures import common
        from surrogate.architectures.layers import AppendTabor

        sequence, tabor = common.inputs(features)
        force = keras.layers.Dense(1, name="force")(hidden(keras.layers)(AppendTabor(name="append")(sequence, tabor)))
        return keras.Model([sequence, tabor], force, name=name)

    return build


QUICK = ("M1-concat", "M1-gated", "M2-concat", "M3-FiLM", "M4-gated", "M5-FiLM", "M6-gated")
"""Models of all families and conditionings, and so of all layers."""


def every_model():
    """Parameters of a test: names and feature sets; models not in `QUICK` are slow."""
    from surrogate.architectures.naming import names

    found = [pytest.param(name, "D", marks=[] if name in QUICK else pytest.mark.slow) for name in names()]
    return [*found, *(("M3-concat", features) for features in "ABC")]


build_least = builder(lambda layers: layers.Dropout(0.1, name="dropout"))
build_lstm = builder(lambda layers: layers.LSTM(4, return_sequences=True, name="lstm"))


@pytest.fixture(scope="session")
def six(dataset, grid):
    """Six histories and their scenes."""
    return *(part[:6] for part in grid), scenes(dataset.protocols["tabor"][:6])


@pytest.fixture(scope="session")
def stirred(dataset, six):
    """Make an untrained model whose weights all differ from their initial values, once.

    Returns:
        A function of a name and a feature set; it returns a Keras backend and its scaled forces on the first six
        histories, shape `(6, steps)`.
    """
    import surrogate
    from surrogate.model import Surrogate
    from surrogate.networks import KerasNetwork

    made = {}

    def make(name, features="D"):
        if (name, features) not in made:
            model = surrogate.build(name, features=features)
            rng = np.random.default_rng(3)
            model.set_weights([weight + 0.05 * rng.standard_normal(weight.shape) for weight in model.get_weights()])
            backend = KerasNetwork(model, scaling_of(dataset, features), name=name)
            made[name, features] = backend, backend.scaling.scale_force(Surrogate(backend).predict_history(*six))
        return made[name, features]

    return make


@pytest.fixture
def least(monkeypatch):
    """Stand a model of one layer, with dropout, in for M1-concat: with few weights a step of training compiles soon."""
    build_by(monkeypatch, build_least)
    return build_least


@pytest.fixture(scope="session")
def trained_lstm(dataset, tmp_path_factory):
    """A directory with a model of a few weights, trained and published once, as M1-concat."""
    from surrogate.training.identity import Run
    from surrogate.training.model_directory import publish
    from surrogate.training.recipe import Recipe
    from surrogate.training.runs import execute

    folder = tmp_path_factory.mktemp("models")
    # The step of Adam compiles in a fraction of the time that SOAP's takes.
    recipe = Recipe.load("swift").with_overrides(epochs=1, optimizer="adam")
    with pytest.MonkeyPatch.context() as patch:
        build_by(patch, build_lstm)
        execute(Run("M1-concat", dataset, dataset.split(), recipe), folder / "run")
        publish(folder / "run", folder / "M1-concat")
    return folder


@pytest.fixture
def published(trained_lstm, monkeypatch):
    """The same directory, and M1-concat stands for that model as long as the test runs."""
    build_by(monkeypatch, build_lstm)
    return trained_lstm


@pytest.fixture
def folder(published, tmp_path):
    """A model directory of a test's own, to damage."""
    return shutil.copytree(published / "M1-concat", tmp_path / "models" / "M1-concat")


@pytest.fixture
def program(monkeypatch, capsys):
    """Run `surrogate` on the words given: exit status, output and errors."""
    from surrogate.cli import app as cli

    def run(*words):
        monkeypatch.setattr("sys.argv", ["surrogate", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            cli.app_main()
        result = capsys.readouterr()
        return end.value.code or 0, result.out, result.err

    return run


@pytest.fixture
def command(program, published):
    """The same with that model, trained for the test."""
    return lambda *words: program(*words, "--models", published)


PROTOCOL = {"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}
FLAGS = [word for key, value in PROTOCOL.items() for word in (f"--{key.replace('_', '-')}", str(value))]
SCENE = Scene(1.0, StandardLinearSolid(0.1))


def refused(command, words, *, folder):
    """The one sentence a mistake ends in; nothing may be left behind."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    code, out, err = command(*words)
    assert (code, out) == (2, ""), err
    # One sentence, and not one within another.
    assert re.match(r"surrogate: (.* must |Expected )", err)
    assert len(re.findall(r"\b[Rr]eceived\b", err)) == 1
    assert err.count("\n") == 1
    assert len(err) < 1000
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    return err

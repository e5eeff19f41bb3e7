"""Architectures of a user's own: registered, refused, trained, evaluated, exported, listed and drawn."""

import hashlib
import json
import sys
from pathlib import Path

import keras
import pytest
from keras import layers
from typer.testing import CliRunner

import surrogate
from experiments.paper import architecture_graphs
from paper_figures.__main__ import save
from paper_figures.figures import architectures
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor
from surrogate.architectures.naming import FAMILIES
from surrogate.architectures.registry import load_architectures, source_of
from surrogate.cli import app as cli
from surrogate.export import keras_layers


def build_narrow(conditioning, features, name):
    sequence, tabor = inputs(features)
    return keras.Model([sequence, tabor], readout(AppendTabor()(sequence, tabor)), name=name)


def build_otherwise(conditioning, channels):
    return None


def test_a_registered_family_stands_beside_the_eighteen():
    surrogate.register("M7", build_narrow)
    surrogate.register("My-own.2", build_narrow, conditionings=("gated",))
    assert surrogate.names()[18:] == ["M7-concat", "M7-FiLM", "M7-gated", "My-own.2-gated"]
    assert surrogate.build("My-own.2-gated", features="A").input_shape == [(None, None, 2), (None, 1)]
    assert source_of("M7-FiLM").name == Path(__file__).name
    assert source_of("M1-concat") is None
    with pytest.raises(ValueError, match=r"M6-gated, M7-concat, .*name='M8-concat'"):
        surrogate.build("M8-concat")


@pytest.mark.parametrize(
    ("family", "builder", "options", "words"),
    [
        ("M1", build_narrow, {}, "Expected a family other than M1, M2, .*family='M1'"),
        ("../M7", build_narrow, {}, r"FAMILY-CONDITIONING of at most 64 letters.*'\.\./M7-concat'"),
        ("M7", build_narrow, {"conditionings": ["none"]}, r"Expected conditionings of concat, FiLM, gated.*\['none'\]"),
        ("M7", build_narrow, {"conditionings": []}, r"Expected conditionings of concat.*\[\]"),
        (
            "M7",
            build_otherwise,
            {},
            r"builder\(conditioning=\.\.\., features=\.\.\., name=\.\.\.\)",
        ),
        ("M7", "lstm", {}, "Expected a builder .*'lstm'"),
    ],
)
def test_architectures_that_cannot_be_registered(family, builder, options, words):
    before = surrogate.names(), dict(FAMILIES)
    with pytest.raises(ValueError, match=words):
        surrogate.register(family, builder, **options)
    assert (surrogate.names(), FAMILIES) == before


@pytest.mark.parametrize(
    "build",
    [
        lambda **_: None,
        lambda features, **_: keras.Model(*[inputs(features)[0]] * 2),
        lambda features, **_: keras.Model(inputs(features)[::-1], layers.Dense(1)(keras.Input((None, 3)))),
        lambda features, **_: (lambda both: keras.Model([*both], layers.Dense(2)(both[0])))(inputs(features)),
    ],
    ids=["nothing", "one input", "other order", "two forces"],
)
def test_a_builder_of_something_else_is_refused(build):
    def builder(conditioning, features, name):
        try:
            return build(conditioning=conditioning, features=features, name=name)
        except ValueError:  # Keras refuses some of them itself
            return None

    surrogate.register("M7", builder)
    with pytest.raises(
        ValueError, match=r"^Expected a functional keras\.Model of the inputs .* Received as M7-concat: "
    ):
        surrogate.build("M7-concat")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "which does not$"),
        ('raise ValueError("\\0")'.replace("\\0", "\0"), "which fails: "),
        ("import surrogate\n\nsurrogate.register('M1', print)", "which fails in line 3: ValueError: Expected a family"),
        ("def (", "which fails in line 1: SyntaxError: "),
        ("import no_such_library", "which fails in line 1: ModuleNotFoundError: No module named 'no_such_library'"),
        ("raise KeyError('x' * 10_000)", "which fails in line 1: KeyError: "),
        ("import sys\nsys.exit()", "which fails in line 2: SystemExit"),
    ],
)
def test_a_file_that_registers_nothing_is_one_sentence(text, words, tmp_path):
    (tmp_path / "own.py").write_text(text)
    expected = rf"^Expected a Python file that calls surrogate\.register\. Received: .*own\.py, {words}"
    with pytest.raises(ValueError, match=expected) as refused:
        load_architectures([tmp_path / "own.py"])
    assert len(str(refused.value)) < 600
    with pytest.raises(FileNotFoundError, match=r"Received: .*none\.py, which does not exist"):
        load_architectures([tmp_path / "none.py"])


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
    monkeypatch.setattr("surrogate.training.queue.signal.signal", lambda *_: None)
    monkeypatch.chdir(tmp_path)
    training = ["--dataset", str(dataset_path), "--recipe", "fast.toml", "--models", "models", "--runs", "runs"]
    places = {
        "train": training,
        "train-all": training,
        "evaluate": ["--dataset", str(dataset_path), "--models", "models"],
    }

    def run(*words, fails=False):
        result = CliRunner().invoke(cli.app, [*words, *places.get(words[0], ["--models", "models"])])
        assert bool(result.exception) == fails, result.output + str(result.exception)
        return str(result.exception) if fails else result.output

    return run


def forget():
    from surrogate.architectures import naming, registry

    for table in (FAMILIES, naming.CONDITIONINGS_OF, registry.REGISTERED):
        table.pop("Own-1", None)


def test_a_users_file_is_trained_evaluated_exported_and_drawn(own, tmp_path, monkeypatch):
    assert "Unknown model name" in own("train", "Own-1-concat", fails=True)
    assert "published in" in own("train", "Own-1-concat", "--architecture", "own.py")
    described = json.loads((tmp_path / "models/Own-1-concat/run.json").read_text())
    digest = hashlib.sha256(OWN.encode()).hexdigest()
    assert described["architecture_file"] == {"name": "own.py", "sha256": digest}
    assert "already published" in own("train", "Own-1-concat", "--architecture", "own.py")

    forget()
    assert not sys.modules.keys() & {"own"}
    wanted = f"Expected own.py ({digest[:12]}), which built Own-1-concat, by --architecture or an import. Received: no "
    assert own("evaluate", "Own-1-concat", fails=True).startswith(wanted)
    assert "hysteresis_percent" in own("evaluate", "Own-1-concat", "--architecture", "own.py")
    own("export", "Own-1-concat", "--architecture", "own.py")
    with monkeypatch.context() as patch:
        # A layer that computes otherwise than it is told, as far as the comparison with Keras can tell.
        dense = keras_layers._LAYERS["Dense"]
        patch.setitem(
            keras_layers._LAYERS, "Dense", lambda graph, *given: graph.add("Add", *[dense(graph, *given)] * 2)
        )
        refused = own("export", "Own-1-concat", "--architecture", "own.py", fails=True)
        assert "Expected an ONNX file that agrees with Keras to 0.001 of the force's range" in refused
    listed = own("list", "--architecture", "own.py")
    assert "Own-1-concat" in listed.splitlines()[2]
    protocol = ["--tabor", "1", "--peak-indentation", "20", "--loading-rate", "10", "--dwell-time", "1"]
    forget()
    own("predict", "Own-1-concat", *protocol, "--unloading-rate", "10")

    files = [str(tmp_path / "own.py")]
    with pytest.raises(ValueError, match=r"--out must name another file for the graphs of .*own\.py; received"):
        architecture_graphs.study(tmp_path / "architecture_graphs.json", architecture=files)
    graphs = architecture_graphs.study(tmp_path / "own.json", architecture=files)
    save(architectures.figure_architectures(graphs, family="Own-1"), "", tmp_path, tmp_path)
    assert (tmp_path / "figure-architecture-Own-1.pdf").stat().st_size > 1000
    with pytest.raises(ValueError, match=r"family must be one of Own-1; .*'M1'"):
        architectures.figure_architectures(graphs, family="M1")
    left = {path.name for path in tmp_path.iterdir()}
    drawn = {f"figure-architecture-Own-1.{kind}" for kind in ("pdf", "png")}
    assert left == {"own.py", "fast.toml", "models", "runs", *drawn}


def test_another_version_of_the_file_neither_resumes_nor_loads(own, tmp_path):
    narrow = OWN.replace("LSTM(3, return_sequences=True)", "Dense(3)")  # which compiles sooner
    (tmp_path / "own.py").write_text(narrow)
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "STOP").touch()
    own("train", "Own-1-concat", "--architecture", "own.py", fails=True)  # it stops after an epoch
    (tmp_path / "runs" / "STOP").unlink()
    (tmp_path / "own.py").write_text(narrow.replace("Dense(3", "Dense(3, activation='tanh'"))
    refused = own("train", "Own-1-concat", "--architecture", "own.py", fails=True)
    assert "Expected a checkpoint of the same training" in refused
    assert refused.endswith("Received: a checkpoint of another architecture file")
    (tmp_path / "own.py").write_text(narrow)
    own("train", "Own-1-concat", "--architecture", "own.py")
    (tmp_path / "own.py").write_text(narrow + "\n# Other words.\n")
    assert "Received: own.py (" in own("evaluate", "Own-1-concat", "--architecture", "own.py", fails=True)
    refused = own("train", "Own-1-concat", "--architecture", "own.py", fails=True)
    assert "a model of another architecture file" in refused


def test_the_queue_passes_the_file_on(own, monkeypatch):
    asked = {}

    def queue(waiting, command, **_):
        asked.update({name: command(name) for name in waiting})
        return dict.fromkeys(waiting, 0)

    monkeypatch.setattr(cli, "run_queue", queue)
    own("train-all", "--architecture", "own.py", "--only", "Own-1-concat", "--only", "M1-concat")
    assert asked["Own-1-concat"][-2:] == asked["M1-concat"][-2:] == ["--architecture", "own.py"]

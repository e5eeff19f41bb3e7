"""Files of models against Keras: networks, channels of all feature sets, what they say, and where they are written."""

import json
import subprocess
import sys

import keras
import numpy as np
import onnx
import pytest

import surrogate
from surrogate.files import PUBLISHED
from surrogate.model import Surrogate
from surrogate.onnx.export import file_content
from surrogate.training.runs import folder_content
from tests.surrogate.conftest import every_model, scaling_of, scenes, write_onnx


@pytest.mark.filterwarnings("ignore:.*extrapolates")
@pytest.mark.parametrize(("name", "features"), every_model())
def test_file_agrees_with_keras(name, features, stirred, six, tmp_path):
    backend, expected = stirred(name, features)
    onnx_model = surrogate.load(write_onnx(tmp_path / "model.onnx", backend))
    found = backend.scaling.scale_force(onnx_model.predict_history(*six))
    assert np.abs(expected).max() > 1e-2
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-5)


def test_metadata_inputs_and_lstm_operator(dataset):
    scaling = scaling_of(dataset)
    content = file_content(surrogate.build("M1-gated"), scaling, name="mine", architecture="M1-gated")
    content = onnx.load_model_from_string(content)
    metadata = {entry.key: entry.value for entry in content.metadata_props}
    assert metadata["format"] == "viscoelastic-contact-surrogate-onnx"
    assert (metadata["format_version"], metadata["name"], metadata["features"]) == ("1", "mine", "D")
    assert json.loads(metadata["ranges"])["tabor"] == list(scaling.ranges["tabor"])
    inputs = {item.name: len(item.type.tensor_type.shape.dim) for item in content.graph.input}
    assert inputs == {"times": 2, "indentations": 2, "tabor": 1, "edge": 2}
    assert {item.type.tensor_type.elem_type for item in content.graph.input} == {onnx.TensorProto.DOUBLE}
    assert [item.name for item in content.graph.output] == ["force"]
    kinds = [node.op_type for node in content.graph.node]
    assert (kinds.count("LSTM"), "Loop" in kinds) == (2, False)


def test_training_leaves_a_file_that_loads(folder):
    assert (surrogate.load(folder / "model.onnx").name, surrogate.load(folder).name) == ("M1-concat",) * 2
    before = (folder / "model.onnx").read_bytes()
    (folder / "model.onnx").unlink()
    with pytest.raises(FileNotFoundError, match=r"surrogate export .*M1-concat.*the backend keras"):
        surrogate.load(folder)
    assert folder_content(folder) == before


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(PUBLISHED.glob("*/model.onnx")), ids=lambda path: path.parent.name)
def test_published_file_has_its_weights(path):
    contents = (folder_content(path.parent), path.read_bytes())
    models = [onnx.load_model_from_string(content) for content in contents]
    fresh, found = ([onnx.numpy_helper.to_array(one) for one in model.graph.initializer] for model in models)
    keys, known = ([one.key for one in model.metadata_props] for model in models)
    assert keys == known
    assert len(fresh) == len(found)
    for expected in fresh:
        assert any(one.shape == expected.shape and np.array_equal(one, expected) for one in found)


def test_runtime_error_is_one_sentence(folder, monkeypatch):
    class Full:
        def run(self, *_):
            raise MemoryError("no room\nfor a tensor of {" + 10**5 * "9," + "}")

    model = surrogate.load(folder)
    monkeypatch.setattr(model.network, "session", Full())
    times = np.linspace(0.0, 1.0, 9)[None]
    with pytest.raises(
        ValueError, match=r"must fit M1-concat and the memory; received shape \(1, 9\) \(no room"
    ) as caught:
        model.network.force(times, times, np.ones(1), np.zeros_like(times))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_a_backend_needs_its_files(folder):
    with pytest.raises(ValueError, match="a model directory for the backend keras"):
        surrogate.load(folder / "model.onnx", backend="keras")
    with pytest.raises(ValueError, match="backend='keras'"):
        _ = surrogate.load(folder).model


def test_prediction_imports_no_framework(folder):
    code = (
        "import sys, numpy, surrogate\n"
        f"model = surrogate.load({str(folder)!r})\n"
        "times = numpy.linspace(0, 1, 9)[None]\n"
        "import warnings; warnings.simplefilter('ignore')\n"
        "from bem import Scene, StandardLinearSolid\n"
        "model.predict_history(times, times, Scene(1.0, StandardLinearSolid(0.1)))\n"
        "print(sorted({'keras', 'tensorflow', 'onnx', 'h5py'} & set(sys.modules)))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_missing_keras_is_one_sentence(folder, monkeypatch):
    monkeypatch.setattr("surrogate.networks.importlib.util.find_spec", lambda _: None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install '\.\[train\]'.*backend='onnx'"):
        surrogate.load(folder, backend="keras")
    assert surrogate.load(folder).name == "M1-concat"


def test_export_beside_weights_or_elsewhere(command, published, tmp_path, monkeypatch):
    own = published / "M1-concat" / "model.onnx"
    before = own.read_bytes()
    # An up-to-date file is copied, which takes no Keras.
    with monkeypatch.context() as patch:
        patch.setattr("surrogate.training.runs.keras_network", None)
        code, out, _ = command("export", "M1-concat", "--out", tmp_path / "copy.onnx")
    assert (code, "copy.onnx" in out) == (0, True)
    assert (tmp_path / "copy.onnx").read_bytes() == before
    assert command("export", "M1-concat", "--out", tmp_path / "copy.keras")[0] == 0
    expected = surrogate.load(own.parent, backend="keras").model.get_weights()
    for found, weight in zip(keras.saving.load_model(tmp_path / "copy.keras").get_weights(), expected, strict=True):
        np.testing.assert_array_equal(found, weight)
    own.unlink()
    try:
        assert command("export", "M1-concat", "--out", tmp_path / "fresh.onnx")[0] == 0
        assert not own.exists()
        assert (tmp_path / "fresh.onnx").read_bytes() == before
        code, out, _ = command("export", "M1-concat")
        assert (code, "model.onnx" in out) == (0, True)
        assert own.read_bytes() == before
    finally:
        own.write_bytes(before)


@pytest.mark.filterwarnings("ignore:.*extrapolates")
@pytest.mark.parametrize(("name", "features"), [("M3-concat", "C"), ("M1-concat", "D")])
def test_short_long_and_late_steps(name, features, stirred, tmp_path):
    backend, _ = stirred(name, features)
    onnx_model = surrogate.load(write_onnx(tmp_path / "model.onnx", backend))
    # In single precision a step of 1e-3 at time 1e5 would be lost altogether.
    for times in (np.geomspace(1e-9, 1e6, 60), np.array([2.0]), 1e5 + 1e-3 * np.arange(60)):
        indentations = 20.0 * np.sin(np.arange(len(times)))[None] * min(1.0, np.ptp(times))
        forces = [
            model.predict_history(times[None], indentations, scenes([1.0])[0])
            for model in (onnx_model, Surrogate(backend))
        ]
        scaled = [backend.scaling.scale_force(force) for force in forces]
        np.testing.assert_allclose(*scaled, rtol=0.0, atol=1e-5)

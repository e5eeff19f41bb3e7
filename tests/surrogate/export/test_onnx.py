import json
import random
import shutil
import subprocess
import sys

import h5py
import numpy as np
import onnx
import pytest

import surrogate
from surrogate.export.onnx import build_graph, export_folder
from surrogate.inference.keras_backend import keras_model
from surrogate.inference.model_files import PUBLISHED, read_run
from surrogate.inference.onnx_backend import OnnxBackend
from surrogate.inference.predictor import Surrogate
from surrogate.network.lowering import NotExportableError, lower
from surrogate.network.onnx_file import sealed
from surrogate.training.recipe import Recipe
from surrogate.training.runs import Run, fit_scaling
from tests.data_files import damaged


@pytest.fixture(scope="module")
def protocols(dataset, grid):
    times, indentations = (part[:6] for part in grid)
    return times, indentations, dataset.protocols["tabor"][:6]


def scaling_of(dataset, features="D"):
    return fit_scaling(Run("M1-concat", dataset, dataset.split(), Recipe.load("swift"), features=features))


def write(path, backend):
    content = build_graph(backend.model, backend.scaling, name=backend.name, architecture=backend.name)
    path.write_bytes(sealed(content.SerializeToString()))
    return path


def save(graph, path):
    """Write a changed file as if it had been exported so."""
    kept = [entry for entry in graph.metadata_props if entry.key != "content_sha256"]
    del graph.metadata_props[:]
    graph.metadata_props.extend(kept)
    path.write_bytes(sealed(graph.SerializeToString()))


@pytest.mark.filterwarnings("ignore:.*extrapolates")
@pytest.mark.parametrize(
    ("name", "features"),
    [*((name, "D") for name in surrogate.names()), *(("M3-concat", features) for features in "ABCE")],
)
def test_file_agrees_with_keras(name, features, stirred, protocols, tmp_path):
    backend, expected = stirred(name, features)
    onnx_model = surrogate.load(write(tmp_path / "model.onnx", backend))
    times, indentations, tabor = protocols
    found = backend.scaling.scale_force(onnx_model.predict(times, indentations, tabor=tabor))
    assert np.abs(expected).max() > 1e-2
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-5)


@pytest.mark.filterwarnings("ignore:.*extrapolates")
def test_velocity_survives_large_times(stirred, tmp_path):
    # In single precision a step of 1e-3 at time 1e5 would be lost altogether.
    backend, _ = stirred("M1-concat")
    onnx_model = surrogate.load(write(tmp_path / "model.onnx", backend))
    times = 1e5 + 1e-3 * np.arange(60)[None]
    indentations = 0.4 * np.arange(60)[None]
    forces = [model.predict(times, indentations, tabor=1.0) for model in (onnx_model, Surrogate(backend))]
    scaled = [backend.scaling.scale_force(force) for force in forces]
    np.testing.assert_allclose(*scaled, rtol=0.0, atol=1e-5)


def test_the_lstm_is_one_operator(dataset):
    content = build_graph(surrogate.build("M1-concat"), scaling_of(dataset), name="M1-concat", architecture="M1-concat")
    kinds = [node.op_type for node in content.graph.node]
    assert kinds.count("LSTM") == 2
    assert "Loop" not in kinds


def test_metadata_and_interface(dataset):
    scaling = scaling_of(dataset)
    content = build_graph(surrogate.build("M1-gated"), scaling, name="mine", architecture="M1-gated")
    metadata = {entry.key: entry.value for entry in content.metadata_props}
    assert metadata["format"] == "viscoelastic-contact-surrogate-onnx"
    assert (metadata["format_version"], metadata["name"], metadata["features"]) == ("1", "mine", "D")
    assert json.loads(metadata["ranges"])["tabor"] == list(scaling.ranges["tabor"])
    inputs = {item.name: len(item.type.tensor_type.shape.dim) for item in content.graph.input}
    assert inputs == {"times": 2, "indentations": 2, "tabor": 1, "edge": 2}
    assert {item.type.tensor_type.elem_type for item in content.graph.input} == {onnx.TensorProto.DOUBLE}
    assert [item.name for item in content.graph.output] == ["force"]


def test_training_leaves_a_file_that_loads(folder):
    assert isinstance(surrogate.load(folder).backend, OnnxBackend)
    assert (surrogate.load(folder / "model.onnx").name, surrogate.load(folder).name) == ("M1-concat",) * 2
    before = (folder / "model.onnx").read_bytes()
    (folder / "model.onnx").unlink()
    with pytest.raises(FileNotFoundError, match=r"surrogate export .*M1-concat.*backend='keras'"):
        surrogate.load(folder)
    assert export_folder(folder).read_bytes() == before


def test_files_that_are_not_ours(folder, tmp_path, dataset):
    (tmp_path / "text.onnx").write_text("no graph")
    with pytest.raises(ValueError, match=r"ONNX file of `surrogate export`.*text\.onnx, which is not one, is damaged"):
        surrogate.load(tmp_path / "text.onnx")
    (tmp_path / "text.onnx").write_bytes(sealed(b"no graph"))
    with pytest.raises(ValueError, match=r"`surrogate export`.*text\.onnx, which ONNX Runtime cannot read"):
        surrogate.load(tmp_path / "text.onnx")
    with pytest.raises(FileNotFoundError, match="does not exist"):
        surrogate.load(tmp_path / "absent.onnx")
    graph = onnx.load(folder / "model.onnx")
    for entry in graph.metadata_props:
        if entry.key == "format_version":
            entry.value = "9"
    save(graph, tmp_path / "later.onnx")
    with pytest.raises(ValueError, match=r"version 1 .*Received: version 9"):
        surrogate.load(tmp_path / "later.onnx")
    del graph.metadata_props[:]
    save(graph, tmp_path / "foreign.onnx")
    with pytest.raises(ValueError, match=r"Received: .*foreign\.onnx, which is not one"):
        surrogate.load(tmp_path / "foreign.onnx")
    shutil.copy(tmp_path / "foreign.onnx", folder / "model.onnx")
    with pytest.raises(ValueError, match="which is not one"):
        surrogate.load(folder)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("scaling", None, "whose metadata lack scaling"),
        ("weights_sha256", None, "whose metadata lack weights_sha256"),
        ("scaling", "{}", "whose scaling is damaged"),
        ("plan", "[{}]", "whose operations are damaged"),
        ("plan", "[]", "whose operations are damaged"),
        ("plan", "no JSON", "whose operations are damaged"),
        ("plan", "[" * 100_000, "whose operations are damaged"),
    ],
)
def test_damaged_metadata(folder, tmp_path, key, value, words):
    graph = onnx.load(folder / "model.onnx")
    entry = next(entry for entry in graph.metadata_props if entry.key == key)
    if value is None:
        graph.metadata_props.remove(entry)
    else:
        entry.value = value
    save(graph, tmp_path / "damaged.onnx")
    with pytest.raises(ValueError, match=rf"ONNX file of `surrogate export`\. Received: .*damaged\.onnx, {words}"):
        surrogate.load(tmp_path / "damaged.onnx")


def test_foreign_inputs_under_our_tag(folder, tmp_path):
    graph = onnx.load(folder / "model.onnx")
    for node in graph.graph.node:
        node.input[:] = ["instants" if name == "times" else name for name in node.input]
    graph.graph.input[0].name = "instants"
    save(graph, tmp_path / "foreign.onnx")
    with pytest.raises(ValueError, match=r"foreign\.onnx, whose inputs and outputs \(instants, "):
        surrogate.load(tmp_path / "foreign.onnx")


def test_a_graph_that_lacks_weights_does_not_stream(folder, tmp_path):
    graph = onnx.load(folder / "model.onnx")
    entry = next(entry for entry in graph.metadata_props if entry.key == "plan")
    operations = json.loads(entry.value)
    operations[-1]["name"] = "elsewhere"
    entry.value = json.dumps(operations)
    save(graph, tmp_path / "damaged.onnx")
    with pytest.raises(ValueError, match="operations and weights that fit"):
        surrogate.load(tmp_path / "damaged.onnx").stream(tabor=1.0)


def zeroed(graph):
    weight = next(item for item in graph.graph.initializer if item.name.endswith("kernel"))
    weight.CopyFrom(onnx.numpy_helper.from_array(0.0 * onnx.numpy_helper.to_array(weight), weight.name))


def not_finite(graph):
    weight = next(item for item in graph.graph.initializer if item.name.endswith("kernel"))
    weight.CopyFrom(onnx.numpy_helper.from_array(np.nan * onnx.numpy_helper.to_array(weight), weight.name))


def subtracting(graph):
    next(node for node in graph.graph.node if node.op_type == "Add").op_type = "Sub"


def from_outside(graph):
    onnx.external_data_helper.set_external_data(graph.graph.initializer[0], "weights.bin")


@pytest.mark.parametrize("change", [zeroed, not_finite, subtracting, from_outside])
def test_a_file_changed_by_other_tools_is_refused(change, folder):
    graph = onnx.load(folder / "model.onnx")
    change(graph)
    onnx.save(graph, folder / "model.onnx")
    for place in (folder, folder / "model.onnx"):
        with pytest.raises(ValueError, match=r"model\.onnx, which is not one, is damaged"):
            surrogate.load(place)


def test_weights_that_are_not_finite_are_refused_everywhere(folder):
    with h5py.File(folder / "model.weights.h5", "r+") as file:
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        file[names[0]][...] = np.nan
    for backend in ("onnx", "keras"):
        with pytest.raises(ValueError, match=r"the weights that .* was exported from"):
            surrogate.load(folder, backend=backend)
    with pytest.raises(ValueError, match=r"all finite\. Received: .*model\.weights\.h5 \(NaN or infinity in "):
        export_folder(folder)
    (folder / "model.onnx").unlink()
    with pytest.raises(ValueError, match=r"all finite\. Received: .*model\.weights\.h5 \(NaN or infinity in "):
        surrogate.load(folder, backend="keras")


def test_weights_in_another_file_are_not_fetched(folder, tmp_path):
    (folder / "model.onnx").unlink()
    with h5py.File(folder / "model.weights.h5", "r+") as file:
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        with h5py.File(tmp_path / "elsewhere.h5", "w") as other:
            other["weights"] = file[names[0]][:]
        del file[names[0]]
        file[names[0]] = h5py.ExternalLink(str(tmp_path / "elsewhere.h5"), "weights")
    with pytest.raises(ValueError, match=r"model\.weights\.h5 \(/.* is a link to another place\)"):
        surrogate.load(folder, backend="keras")


@pytest.mark.slow
@pytest.mark.parametrize("folder", sorted(PUBLISHED.glob("*/")), ids=lambda folder: folder.name)
def test_a_published_file_holds_the_numbers_of_its_weights_file(folder):
    run, _ = read_run(folder)
    expected, found = lower(keras_model(folder, run)), surrogate.load(folder).backend.graph()
    assert found.operations == expected.operations
    assert found.weights.keys() == expected.weights.keys()
    for name, values in expected.weights.items():
        np.testing.assert_array_equal(found.weights[name], values, err_msg=name)


def test_a_model_that_is_not_finite_is_not_exported(dataset):
    model = surrogate.build("M4-concat")
    model.set_weights([np.full_like(weight, np.inf) for weight in model.get_weights()])
    with pytest.raises(ValueError, match=r"Expected finite weights\. Received: NaN or infinity in"):
        build_graph(model, scaling_of(dataset), name="mine", architecture="M4-concat")


@pytest.mark.parametrize("count", [100, pytest.param(2000, marks=pytest.mark.slow)])
def test_random_damage_is_refused_in_one_sentence(count, folder, tmp_path):
    content, rng = (folder / "model.onnx").read_bytes(), random.Random(count)
    for number in range(count):
        found = damaged(content, rng)
        # What a file of a directory is compared with is told apart by the tests above.
        path = (folder if number % 2 else tmp_path) / "model.onnx"
        path.write_bytes(found)
        if found != content:
            with pytest.raises(ValueError, match=r"model\.onnx, which is not one, is damaged") as caught:
                surrogate.load(path.parent if number % 2 else path)
            assert "\n" not in str(caught.value)
            assert len(str(caught.value)) < 1000


def test_what_the_runtime_cannot_compute_ends_in_one_sentence(folder, monkeypatch):
    class Full:
        def run(self, *_):
            raise MemoryError("no room\nfor a tensor of {" + 10**5 * "9," + "}")

    model = surrogate.load(folder)
    monkeypatch.setattr(model.backend, "session", Full())
    times = np.linspace(0.0, 1.0, 9)[None]
    with pytest.raises(ValueError, match=r"that M1-concat can compute\. Received: shape \(1, 9\) \(no room") as caught:
        model.backend.force(times, times, np.ones(1), np.zeros_like(times))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_unknown_backend(folder):
    with pytest.raises(ValueError, match=r"onnx, keras\. Received: backend='torch'"):
        surrogate.load(folder, backend="torch")
    with pytest.raises(ValueError, match="model directory for the keras backend"):
        surrogate.load(folder / "model.onnx", backend="keras")
    with pytest.raises(ValueError, match="backend='keras'"):
        _ = surrogate.load(folder).model
    with pytest.raises(ValueError, match="backend='keras'"):
        surrogate.load(folder).predict_channels(np.zeros((1, 5, 4)), np.zeros((1, 1)))


def test_prediction_needs_no_learning_framework(folder):
    code = (
        "import sys, numpy, surrogate\n"
        f"model = surrogate.load({str(folder)!r})\n"
        "times = numpy.linspace(0, 1, 9)[None]\n"
        "import warnings; warnings.simplefilter('ignore')\n"
        "model.predict(times, times, tabor=1.0)\n"
        "print(sorted({'keras', 'tensorflow', 'onnx', 'numba', 'h5py'} & set(sys.modules)))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_without_keras_one_sentence_says_what_to_install(folder, monkeypatch):
    monkeypatch.setattr("surrogate.inference.keras_backend.importlib.util.find_spec", lambda _: None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'contact-trajectories\[train\]'.*backend='onnx'"):
        surrogate.load(folder, backend="keras")
    assert surrogate.load(folder).name == "M1-concat"


def test_export_writes_beside_the_weights_or_where_told(command, published, tmp_path, monkeypatch):
    own = published / "M1-concat" / "model.onnx"
    before = own.read_bytes()
    # An up-to-date file is copied, which takes no Keras.
    with monkeypatch.context() as patch:
        patch.setattr("surrogate.export.onnx.keras_model", None)
        code, out, _ = command("export", "M1-concat", "--out", tmp_path / "copy.onnx")
    assert (code, "copy.onnx" in out) == (0, True)
    assert (tmp_path / "copy.onnx").read_bytes() == before
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


def test_inputs_of_the_material_are_left_to_keras(dataset):
    scaling = scaling_of(dataset, "F")
    with pytest.raises(NotExportableError, match=r"Expected a feature set of times and indentations. Received: F"):
        build_graph(surrogate.build("M1-concat", "F"), scaling, name="mine", architecture="M1-concat")

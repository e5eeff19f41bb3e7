"""ONNX files and weights that are damaged, foreign or changed by other tools."""

import json
import random
import shutil

import h5py
import numpy as np
import onnx
import pytest

import surrogate
from surrogate.export.onnx import export_folder
from surrogate.network.onnx_file import sealed
from tests.data_files import damaged


def save(graph, path):
    """Write a changed file as if it had been exported so."""
    kept = [entry for entry in graph.metadata_props if entry.key != "content_sha256"]
    del graph.metadata_props[:]
    graph.metadata_props.extend(kept)
    path.write_bytes(sealed(graph.SerializeToString()))


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

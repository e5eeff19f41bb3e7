"""ONNX files and weights that are damaged, foreign or changed by other tools."""

import random

import h5py
import numpy as np
import onnx
import pytest

import surrogate
from surrogate.export.onnx_file import sealed
from surrogate.training.exporting import folder_content
from tests.data_files import damaged


def save(graph, path):
    """Write a changed file as if it had been exported so."""
    kept = [entry for entry in graph.metadata_props if entry.key != "content_sha256"]
    del graph.metadata_props[:]
    graph.metadata_props.extend(kept)
    path.write_bytes(sealed(graph.SerializeToString()))


def test_files_that_are_not_ours(folder, tmp_path):
    for content, words in (
        (b"no graph", "which is not one, is damaged"),
        (sealed(b"no graph"), "which ONNX Runtime cannot read"),
    ):
        (tmp_path / "text.onnx").write_bytes(content)
        with pytest.raises(ValueError, match=rf"ONNX file of `surrogate export`.*text\.onnx, {words}"):
            surrogate.load(tmp_path / "text.onnx")
    with pytest.raises(FileNotFoundError, match="does not exist"):
        surrogate.load(tmp_path / "absent.onnx")


def metadata(key, value):
    """A change of one entry, or its removal."""

    def change(graph):
        kept = [entry for entry in graph.metadata_props if entry.key != key]
        del graph.metadata_props[:]
        graph.metadata_props.extend(kept)
        if value is not None:
            graph.metadata_props.add(key=key, value=value)

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (metadata("format", None), "which is not one"),
        (metadata("format_version", "9"), "which is of version 9, not 1"),
        (metadata("scaling", None), "which another program wrote"),
        (metadata("scaling", "{}"), "which another program wrote"),
    ],
)
def test_files_of_another_export(folder, change, words):
    graph = onnx.load(folder / "model.onnx")
    change(graph)
    save(graph, folder / "model.onnx")
    for place in (folder, folder / "model.onnx"):
        with pytest.raises(ValueError, match=rf"ONNX file of `surrogate export`\. Received: .*model\.onnx, {words}"):
            surrogate.load(place)


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
        with pytest.raises(ValueError, match=r"the model\.weights\.h5 that .*model\.onnx was written with"):
            surrogate.load(folder, backend=backend)
    with pytest.raises(ValueError, match=r"all finite\. Received: .*model\.weights\.h5 \(NaN or infinity in "):
        folder_content(folder)
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

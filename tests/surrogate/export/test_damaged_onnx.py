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


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("format", None, "which is not one"),
        ("format_version", "9", "which is of version 9, not 1"),
        ("scaling", None, "which another program wrote"),
        ("scaling", "{}", "which another program wrote"),
    ],
)
def test_files_of_another_export(folder, key, value, words):
    path = folder / "model.onnx"
    graph = onnx.load(path)
    found = {entry.key: entry.value for entry in graph.metadata_props} | {key: value}
    del found["content_sha256"]
    onnx.helper.set_model_props(graph, {key: value for key, value in found.items() if value is not None})
    path.write_bytes(sealed(graph.SerializeToString()))
    for place in (folder, path):
        with pytest.raises(ValueError, match=rf"ONNX file of `surrogate export`\. Received: .*model\.onnx, {words}"):
            surrogate.load(place)


def test_a_file_changed_by_other_tools_is_refused(folder):
    graph = onnx.load(folder / "model.onnx")
    next(node for node in graph.graph.node if node.op_type == "Add").op_type = "Sub"
    onnx.save(graph, folder / "model.onnx")
    for place in (folder, folder / "model.onnx"):
        with pytest.raises(ValueError, match=r"model\.onnx, which is not one, is damaged"):
            surrogate.load(place)


def first_weights(file):
    """The path of the first data set of an HDF5 file."""
    names = []
    file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    return names[0]


def test_weights_that_are_not_finite_are_refused_everywhere(folder):
    with h5py.File(folder / "model.weights.h5", "r+") as file:
        file[first_weights(file)][...] = np.nan
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
        name = first_weights(file)
        with h5py.File(tmp_path / "elsewhere.h5", "w") as other:
            other["weights"] = file[name][:]
        del file[name]
        file[name] = h5py.ExternalLink(str(tmp_path / "elsewhere.h5"), "weights")
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

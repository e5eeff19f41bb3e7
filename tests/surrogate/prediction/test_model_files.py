"""Files of models: found by name, and refused in one sentence where they are incomplete, damaged or another model's."""

import json
import random
import shutil
from pathlib import Path

import h5py
import numpy as np
import onnx
import pytest

import surrogate
from surrogate.export.onnx_file import sealed
from surrogate.prediction.networks import load_weights
from surrogate.training.runs import folder_content
from tests.data_files import damaged

NO_RUN = r"a run\.json that `surrogate train` wrote"
UNLIKE = json.dumps({"dataset_sha256": 5, "features": "D", "name": "a", "architecture": "b"})


def test_names_of_any_length_end_in_one_short_sentence(tmp_path):
    for name in ("x" * 10**5, "y" * 10**5 + "/z", "a\0b"):
        with pytest.raises(ValueError, match=r"Received: .*(xxx|yyy|a)") as caught:
            surrogate.load(name, root=tmp_path)
        assert len(str(caught.value)) < 1500


@pytest.mark.parametrize(
    ("name", "threads", "message"),
    [
        *((name, 1, r"Expected a model's name or path\. Received: ") for name in (None, 1, b"fast", ["fast"])),
        *(("fast", threads, "threads must be a whole number") for threads in (0, None, "2", 1.5, 10**9)),
    ],
)
def test_names_and_threads_of_other_types_are_refused_in_one_sentence(name, threads, message):
    with pytest.raises(ValueError, match=message):
        surrogate.load(name, threads=threads)


def test_unknown_and_untrained_names(folder):
    with pytest.raises(ValueError, match=r"M1-concat, .*, accurate, fast\. .*name='M9'"):
        surrogate.load("M9", root=folder.parent)
    with pytest.raises(FileNotFoundError, match=r"surrogate train M2-FiLM.*Trained there: M1-concat"):
        surrogate.load("M2-FiLM", root=folder.parent)
    with pytest.raises(FileNotFoundError, match=r"M1-concat-8-epochs, of which only the errors are .*README"):
        surrogate.load("M1-concat-8-epochs")
    assert surrogate.load("M1-concat", root=folder.parent).name == surrogate.load(folder).name == "M1-concat"
    (folder / "scaling.json").unlink()
    with pytest.raises(FileNotFoundError, match=r"scaling\.json"):
        surrogate.load(folder)


def test_a_name_is_no_folder(folder, tmp_path, monkeypatch):
    shutil.copytree(folder, tmp_path / "M1-concat")
    (tmp_path / "M1-concat" / "run.json").write_text("{}")
    monkeypatch.chdir(tmp_path)
    assert surrogate.load("M1-concat", root=folder.parent).name == "M1-concat"
    for path in ("./M1-concat", Path("M1-concat")):
        with pytest.raises(ValueError, match=NO_RUN):
            surrogate.load(path, root=folder.parent)
    (tmp_path / "M1-concat").rename("mine")
    with pytest.raises(ValueError, match=r"\./NAME for a folder, or one of .*name='mine'"):
        surrogate.load("mine", root=folder.parent)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        *(("run.json", lambda _, text=text: text, NO_RUN) for text in (b"\xff\xfe{}", b"[" * 100_000, UNLIKE.encode())),
        ("scaling.json", lambda content: content | {"dataset_sha256": "0" * 64}, "scaling of data set"),
        (
            "scaling.json",
            lambda content: content | {"force": [0.1, 1.0]},
            r"the scaling that .*model\.onnx was exported",
        ),
    ],
)
def test_other_files_in_a_folder(folder, name, change, message):
    content = change(json.loads((folder / name).read_text()))
    (folder / name).write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
    for backend in ("onnx", "keras"):
        with pytest.raises(ValueError, match=message):
            surrogate.load(folder, backend=backend)


def test_files_that_are_not_ours(tmp_path):
    (tmp_path / "x.onnx").mkdir()
    for name, words in (("x.onnx", "which is a directory"), ("absent.onnx", "does not exist")):
        with pytest.raises(FileNotFoundError, match=rf"{name}, which {words.removeprefix('which ')}"):
            surrogate.load(tmp_path / name)
    for content, words in (
        (b"no graph", "which is not one, is damaged"),
        (sealed(b"no graph"), "which ONNX Runtime cannot read"),
    ):
        (tmp_path / "text.onnx").write_bytes(content)
        with pytest.raises(ValueError, match=rf"ONNX file of `surrogate export`.*text\.onnx, {words}"):
            surrogate.load(tmp_path / "text.onnx")


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("format", None, "which is not one"),
        ("format_version", "9", "which is of version 9, not 1"),
        ("scaling", None, "which another program wrote"),
        ("scaling", "{}", "which another program wrote"),
        ("content_sha256", None, "which is not one, is damaged"),
    ],
)
def test_files_of_another_export_or_changed_by_other_tools(folder, key, value, words):
    path, graph = folder / "model.onnx", onnx.load(folder / "model.onnx")
    found = {entry.key: entry.value for entry in graph.metadata_props} | {key: value, "content_sha256": None}
    onnx.helper.set_model_props(graph, {name: text for name, text in found.items() if text is not None})
    content = graph.SerializeToString()
    path.write_bytes(content if key == "content_sha256" else sealed(content))
    for place in (folder, path):
        with pytest.raises(ValueError, match=rf"ONNX file of `surrogate export`\. Received: .*model\.onnx, {words}"):
            surrogate.load(place)


@pytest.fixture
def weights(folder):
    """The weights of a folder, open for changes, and the path of the first of them."""
    with h5py.File(folder / "model.weights.h5", "r+") as file:
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        yield file, names[0]


def refused_by_keras(folder, words):
    (folder / "model.onnx").unlink(missing_ok=True)
    with pytest.raises(ValueError, match=words):
        surrogate.load(folder, backend="keras")


def test_weights_that_are_not_finite_are_refused_everywhere(folder, weights):
    weights[0][weights[1]][...] = np.nan
    weights[0].close()
    for backend in ("onnx", "keras"):
        with pytest.raises(ValueError, match=r"the model\.weights\.h5 that .*model\.onnx was written with; restore it"):
            surrogate.load(folder, backend=backend)
    words = r"all finite\. Received: .*model\.weights\.h5 \(NaN or infinity in "
    with pytest.raises(ValueError, match=words):
        folder_content(folder)
    refused_by_keras(folder, words)


def test_weights_in_another_file_are_not_fetched(folder, weights, tmp_path):
    file, name = weights
    with h5py.File(tmp_path / "elsewhere.h5", "w") as other:
        other["weights"] = file[name][:]
    del file[name]
    file[name] = h5py.ExternalLink(str(tmp_path / "elsewhere.h5"), "weights")
    file.close()
    refused_by_keras(folder, r"model\.weights\.h5 \(/.* is a link to another place\)")


def test_weights_of_another_model(folder, tmp_path):
    # Keras itself would read M2's weights into M1 without a word: the layers M1 lacks stay unread.
    path = tmp_path / "m2.weights.h5"
    surrogate.build("M2-concat").save_weights(path)
    with pytest.raises(ValueError, match=r"M1-concat with 473729 parameters.*474497"):
        load_weights(surrogate.build("M1-concat"), path)
    for content in (path.read_bytes(), b"no"):
        (folder / "model.weights.h5").write_bytes(content)
        refused_by_keras(folder, "Expected weights")


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

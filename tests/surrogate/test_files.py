"""Files of models: found by name, and refused in one sentence where they are incomplete, damaged or another model's."""

import random
import shutil
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import onnx
import pytest

import surrogate
from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.scaling import PUBLISHED_MATERIALS
from surrogate.files import PUBLISHED, PUBLISHED_PRETRAINED, SUMMED, read_intact, read_record, read_run, write_run
from surrogate.networks import load_weights
from surrogate.onnx.file import sealed
from surrogate.training.runs import folder_content
from tests.data_files import damaged
from tests.surrogate.conftest import scaling_of


@pytest.mark.parametrize("threads", [0, None, "2", 1.5, 10**9])
def test_bad_numbers_of_threads_are_refused(threads):
    with pytest.raises(ValueError, match="threads must be a whole number"):
        surrogate.load("fast", threads=threads)


def test_unknown_and_untrained_names(folder):
    with pytest.raises(ValueError, match=r"M1-concat, .*, accurate, fast; received 'M9'"):
        surrogate.load("M9", root=folder.parent)
    with pytest.raises(FileNotFoundError, match=r"surrogate train M2-FiLM.*trained there: M1-concat"):
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
        with pytest.raises(ValueError, match=r"run\.json, which is damaged"):
            surrogate.load(path, root=folder.parent)
    (tmp_path / "M1-concat").rename("mine")
    with pytest.raises(ValueError, match=r"\./NAME for a folder, or one of .*'mine'"):
        surrogate.load("mine", root=folder.parent)


@pytest.mark.parametrize("name", ["run.json", "scaling.json", "model.onnx", "model.weights.h5"])
def test_a_flipped_bit_is_refused(name, folder):
    content, rng = (folder / name).read_bytes(), random.Random(0)
    for _ in range(20):
        flipped = bytearray(content)
        flipped[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        (folder / name).write_bytes(flipped)
        with pytest.raises(ValueError, match=rf"SHA-256 sums in run\.json; .*{name}, which is damaged") as caught:
            surrogate.load(folder, backend="keras" if name.endswith("h5") else "onnx")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["\xff{}", "[" * 100_000, "[]", '{"sha256": {}}', '{"sha256": "run.json"}'])
def test_a_run_without_sums_is_refused(folder, text):
    (folder / "run.json").write_bytes(text.encode("latin-1"))
    for backend in ("onnx", "keras"):
        with pytest.raises(ValueError, match=r"run\.json, which is damaged or another file"):
            surrogate.load(folder, backend=backend)


def test_files_of_another_model_are_refused(folder):
    for name in ("model.onnx", "scaling.json"):
        content = (folder / name).read_bytes()
        shutil.copy(PUBLISHED / "M1-concat" / name, folder / name)
        with pytest.raises(ValueError, match=rf"{name}, which is damaged or another file"):
            surrogate.load(folder)
        (folder / name).write_bytes(content)
    assert surrogate.load(folder).name == "M1-concat"


def test_every_published_file_has_its_sum():
    for path in [*PUBLISHED.glob("*/run.json"), *PUBLISHED_PRETRAINED.glob("*/run.json")]:
        run = read_record(path.parent)
        present = {name for name in SUMMED if (path.parent / name).is_file()}
        assert run["sha256"].keys() == present
        for name in present:
            read_intact(path.parent / name, run)


def test_files_that_are_not_ours(tmp_path):
    (tmp_path / "x.onnx").mkdir()
    for name, words in (("x.onnx", "which is a directory"), ("absent.onnx", "does not exist")):
        with pytest.raises(FileNotFoundError, match=rf"{name}, which {words.removeprefix('which ')}"):
            surrogate.load(tmp_path / name)
    (tmp_path / "text.onnx").write_bytes(b"no graph")
    with pytest.raises(ValueError, match=r"ONNX file of `surrogate export`.*text\.onnx, which is not one, is damaged"):
        surrogate.load(tmp_path / "text.onnx")


@pytest.mark.parametrize(("key", "value"), [("format", None), ("format_version", "9"), ("content_sha256", None)])
def test_changed_exports_are_refused(folder, key, value):
    path, graph = folder / "model.onnx", onnx.load(folder / "model.onnx")
    found = {entry.key: entry.value for entry in graph.metadata_props} | {key: value, "content_sha256": None}
    onnx.helper.set_model_props(graph, {name: text for name, text in found.items() if text is not None})
    content = graph.SerializeToString()
    path.write_bytes(content if key == "content_sha256" else sealed(content))
    with pytest.raises(ValueError, match=r"ONNX file of `surrogate export`; received .*model\.onnx, which is not one"):
        surrogate.load(path)


@pytest.fixture
def weights(folder):
    """The weights of a folder, open for changes, and the path of the first of them."""
    with h5py.File(folder / "model.weights.h5", "r+") as file:
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        yield file, names[0]


def refused_by_keras(folder, words):
    """Whatever the sums say, which are those of the present files."""
    write_run(folder, read_run(folder)[0])
    with pytest.raises(ValueError, match=words):
        surrogate.load(folder, backend="keras")


def test_infinite_weights_are_refused(folder, weights):
    weights[0][weights[1]][...] = np.nan
    weights[0].close()
    words = r"finite numbers; received .*model\.weights\.h5 \(NaN or infinity in "
    refused_by_keras(folder, words)
    with pytest.raises(ValueError, match=words):
        folder_content(folder)


def test_linked_weights_are_not_fetched(folder, weights, tmp_path):
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
    with pytest.raises(ValueError, match=r"M1-concat must be 473729 finite numbers.*474497"):
        load_weights(surrogate.build("M1-concat"), path)
    for content in (path.read_bytes(), b"no"):
        (folder / "model.weights.h5").write_bytes(content)
        refused_by_keras(folder, "weights of .* must be")


@pytest.mark.parametrize("name", ["M4-gated", "M5-FiLM"])
def test_published_blocks_load_into_layers(name, six):
    expected = surrogate.load(name).predict_history(*six)
    force = surrogate.load(name, backend="keras").predict_history(*six)
    np.testing.assert_allclose(force, expected, rtol=1e-3, atol=1e-3 * np.ptp(expected))


@pytest.mark.parametrize("count", [100, pytest.param(2000, marks=pytest.mark.slow)])
def test_random_damage_is_refused(count, folder, tmp_path):
    content, rng = (folder / "model.onnx").read_bytes(), random.Random(count)
    for number in range(count):
        found = damaged(content, rng)
        path = (folder if number % 2 else tmp_path) / "model.onnx"
        path.write_bytes(found)
        if found != content:
            with pytest.raises(ValueError, match=r"model\.onnx, which is (not one, is )?damaged") as caught:
                surrogate.load(path.parent if number % 2 else path)
            assert "\n" not in str(caught.value)
            assert len(str(caught.value)) < 1000


def test_published_model_knows_its_material():
    data = TrajectoryDataset.load(PUBLISHED.parent / "dataset.h5")
    assert {data.sha256: data.modulus_ratio} == PUBLISHED_MATERIALS
    for folder in PUBLISHED.glob("*/model.onnx"):
        assert surrogate.load(folder).modulus_ratio == 0.1


def test_a_training_records_its_material(dataset):
    assert scaling_of(replace(dataset, modulus_ratio=None)).modulus_ratio is None
    scaling = scaling_of(replace(dataset, modulus_ratio=0.25))
    assert type(scaling).from_json(scaling.to_json(), "here").modulus_ratio == 0.25
    assert scaling.ranges["modulus_ratio"] == (0.25, 0.25)

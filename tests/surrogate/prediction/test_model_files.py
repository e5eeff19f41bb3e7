"""Model directories: found by name, and refused where they are incomplete or of another model."""

import json
import shutil

import pytest

import surrogate


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
    assert surrogate.load("M1-concat", root=folder.parent).name == surrogate.load(folder).name == "M1-concat"
    (folder / "scaling.json").unlink()
    with pytest.raises(FileNotFoundError, match=r"scaling\.json"):
        surrogate.load(folder)


def test_scaling_of_another_data_set(folder):
    content = json.loads((folder / "scaling.json").read_text())
    content["dataset_sha256"] = "0" * 64
    (folder / "scaling.json").write_text(json.dumps(content))
    with pytest.raises(ValueError, match="scaling of data set"):
        surrogate.load(folder)


def test_another_scaling_than_the_exported_one(folder):
    content = json.loads((folder / "scaling.json").read_text())
    content["force"][0] += 0.1
    (folder / "scaling.json").write_text(json.dumps(content))
    for backend in ("onnx", "keras"):
        with pytest.raises(ValueError, match=r"the scaling that .*model\.onnx was exported with"):
            surrogate.load(folder, backend=backend)


def test_damaged_directories(folder, tmp_path):
    unlike = json.dumps({"dataset_sha256": 5, "features": "D", "name": "a", "architecture": "b"})
    for content in (b"\xff\xfe{}", b"[" * 100_000, unlike.encode()):
        (folder / "run.json").write_bytes(content)
        with pytest.raises(ValueError, match=r"a run\.json that `surrogate train` wrote"):
            surrogate.load(folder)
    (tmp_path / "x.onnx").mkdir()
    with pytest.raises(FileNotFoundError, match=r"x\.onnx, which is a directory"):
        surrogate.load(tmp_path / "x.onnx")


def test_weights_of_another_model(folder, tmp_path):
    # Keras itself would read M2's weights into M1 without a word: the layers M1 lacks stay unread.
    from surrogate.prediction.networks import load_weights

    path = tmp_path / "m2.weights.h5"
    surrogate.build("M2-concat").save_weights(path)
    with pytest.raises(ValueError, match=r"M1-concat with 473729 parameters.*474497"):
        load_weights(surrogate.build("M1-concat"), path)
    shutil.copy(path, folder / "model.weights.h5")
    for backend in ("onnx", "keras"):
        with pytest.raises(ValueError, match=r"the model\.weights\.h5 that .*model\.onnx was written with; restore it"):
            surrogate.load(folder, backend=backend)
    (folder / "model.onnx").unlink()
    with pytest.raises(ValueError, match="Expected weights"):
        surrogate.load(folder, backend="keras")
    (folder / "model.weights.h5").write_text("no")
    with pytest.raises(ValueError, match="Expected weights"):
        surrogate.load(folder, backend="keras")


def test_a_model_of_which_only_errors_are_published_says_so():
    with pytest.raises(FileNotFoundError, match=r"M1-concat-8-epochs, of which only the errors are .*README"):
        surrogate.load("M1-concat-8-epochs")

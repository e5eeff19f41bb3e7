import json
import shutil
import warnings

import numpy as np
import pytest

import surrogate
from surrogate.backends import KerasBackend
from surrogate.predictor import ExtrapolationWarning, Surrogate
from surrogate.recipe import Recipe
from surrogate.runs import Run, execute, fit_scaling, publish


@pytest.fixture(scope="module")
def predictor(dataset):
    scaling = fit_scaling(Run("M3-concat", dataset, dataset.split(), Recipe.load("swift")))
    return Surrogate(KerasBackend(surrogate.build("M3-concat"), scaling, name="M3-concat"))


@pytest.fixture(scope="module")
def inside(dataset):
    """Protocols of the training part, which no range excludes."""
    indices = dataset.split().train[:5]
    return *dataset.grid(indices), dataset.protocols["tabor"][indices]


@pytest.fixture
def folder(tiny, dataset, tmp_path):
    run = Run("M1-concat", dataset, dataset.split(), Recipe.load("swift").with_overrides(epochs=1))
    execute(run, tmp_path / "run")
    publish(tmp_path / "run", tmp_path / "models" / "M1-concat")
    return tmp_path / "models" / "M1-concat"


def test_prediction_inside_the_ranges_is_silent(predictor, inside):
    times, indentations, tabor = inside
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        force = predictor.predict(times, indentations, tabor=tabor)
    assert force.shape == times.shape
    assert force.dtype == np.float64
    assert np.isfinite(force).all()


def test_batch_and_single_agree(predictor, inside):
    times, indentations, tabor = inside
    batch = predictor.predict(times, indentations, tabor=tabor)
    single = predictor.predict(times[2:3], indentations[2:3], tabor=tabor[2])
    np.testing.assert_allclose(single[0], batch[2], rtol=1e-4, atol=1e-5)


def test_edge_override(predictor, inside):
    times, indentations, tabor = inside
    found = np.zeros_like(times)
    found[:, [49, 69]] = 1.0
    base = predictor.predict(times, indentations, tabor=tabor)
    np.testing.assert_array_equal(predictor.predict(times, indentations, tabor=tabor, edge=found), base)
    assert np.abs(predictor.predict(times, indentations, tabor=tabor, edge=0 * found) - base).max() > 1e-4
    with pytest.raises(ValueError, match="edge marks of shape"):
        predictor.predict(times, indentations, tabor=tabor, edge=found[:, 1:])


def test_extrapolation_warns_once_by_name(predictor, inside):
    times, indentations, tabor = inside
    with pytest.warns(ExtrapolationWarning, match=r"tabor = 9 lies outside \[0\.\d+, \d.*\]") as caught:
        predictor.predict(times, indentations, tabor=np.full_like(tabor, 9.0))
    assert len(caught) == 1
    with pytest.warns(ExtrapolationWarning, match=r"peak_indentation = 1000") as caught:
        predictor.predict(times, 1000.0 * indentations / indentations.max(axis=1, keepdims=True), tabor=tabor)
    assert len(caught) == 1
    with pytest.warns(ExtrapolationWarning, match="rate"):
        predictor.predict(times * 1e6, indentations, tabor=tabor)


def test_history_without_plateau_works(predictor):
    times = np.linspace(0.0, 4.0, 51)[None]
    with pytest.warns(ExtrapolationWarning, match="dwell_time = 0 lies outside"):
        force = predictor.predict(times, 10.0 - 6.0 * np.abs(times - 2.0), tabor=[1.0])
    assert np.isfinite(force).all()


def test_bad_input(predictor, inside):
    times, indentations, tabor = inside
    hole = indentations.copy()
    hole[1, 7] = np.nan
    backwards = times.copy()
    backwards[2, 5] = backwards[2, 4]
    for arguments, words in (
        ((times, hole, tabor), "finite indentations.*history 1"),
        ((backwards, indentations, tabor), "increase strictly.*history 2"),
        ((times, indentations[:, 1:], tabor), "one shape"),
        ((times[0], indentations[0], tabor), "one shape"),
        ((times, indentations, tabor[:2]), "one Tabor parameter per history"),
        ((times, indentations, -tabor), "above zero"),
        ((times, indentations, tabor * np.nan), "above zero"),
    ):
        with pytest.raises(ValueError, match=words):
            predictor.predict(*arguments[:2], tabor=arguments[2])
    with pytest.raises(ValueError, match=r"\(batch, steps, 4\).*\(1, 5, 3\)"):
        predictor.predict_channels(np.zeros((1, 5, 3)), np.zeros((1, 1)))
    with pytest.raises(ValueError, match="finite channels"):
        predictor.predict_channels(np.full((1, 5, 4), np.nan), np.zeros((1, 1)))


def test_load_by_name_and_by_path(folder):
    by_name = surrogate.load("M1-concat", root=folder.parent)
    assert by_name.name == surrogate.load(folder).name == "M1-concat"


def test_unknown_and_untrained_names(folder):
    with pytest.raises(ValueError, match=r"M1-concat, .*name='M9'"):
        surrogate.load("M9", root=folder.parent)
    with pytest.raises(FileNotFoundError, match=r"surrogate train M2-FiLM.*Trained there: M1-concat"):
        surrogate.load("M2-FiLM", root=folder.parent)
    (folder / "scaling.json").unlink()
    with pytest.raises(FileNotFoundError, match=r"scaling\.json"):
        surrogate.load(folder)


def test_scaling_of_another_data_set(folder):
    content = json.loads((folder / "scaling.json").read_text())
    content["dataset_sha256"] = "0" * 64
    (folder / "scaling.json").write_text(json.dumps(content))
    with pytest.raises(ValueError, match="scaling of data set"):
        surrogate.load(folder)


def test_weights_of_another_model(folder, tmp_path):
    # Keras itself would read M2's weights into M1 without a word: the layers M1 lacks stay unread.
    from surrogate.weights import load_weights

    path = tmp_path / "m2.weights.h5"
    surrogate.build("M2-concat").save_weights(path)
    with pytest.raises(ValueError, match=r"M1-concat with 473729 parameters.*474497"):
        load_weights(surrogate.build("M1-concat"), path)
    shutil.copy(path, folder / "model.weights.h5")
    with pytest.raises(ValueError, match="Expected weights"):
        surrogate.load(folder, backend="keras")
    with pytest.raises(ValueError, match="exported from other weights"):
        surrogate.load(folder)
    (folder / "model.weights.h5").write_text("no")
    with pytest.raises(ValueError, match="Expected weights"):
        surrogate.load(folder, backend="keras")

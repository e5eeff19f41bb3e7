import pickle
import shutil
import warnings

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from bem.dataset.measurement_steps import FMS, proportional_counts
from surrogate.prediction.networks import KerasNetwork
from surrogate.prediction.predictor import ExtrapolationWarning, Surrogate
from tests.surrogate.conftest import scaling_of, scenes
from tests.surrogate.prediction.predicting import SCENE


@pytest.fixture(scope="module")
def predictor(dataset):
    return Surrogate(KerasNetwork(surrogate.build("M3-concat"), scaling_of(dataset), name="M3-concat"))


@pytest.fixture(scope="module")
def inside(dataset):
    """Protocols of the training part, which no range excludes."""
    indices = dataset.split().train[:5]
    return *dataset.grid(indices), dataset.protocols["tabor"][indices]


def test_prediction_inside_the_ranges_is_silent_alone_and_in_a_batch_at_any_time(predictor, inside):
    times, indentations, tabor = inside
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        force = predictor.predict_history(times, indentations, scenes(tabor))
    assert force.shape == times.shape
    assert force.dtype == np.float64
    assert np.isfinite(force).all()
    single = predictor.predict_history(times[2], indentations[2], scenes(tabor)[2])
    np.testing.assert_allclose(single, force[2], rtol=1e-4, atol=1e-5)
    for shift in (-5.0, 1e3):
        found = predictor.predict_history(times + shift, indentations, scenes(tabor))
        np.testing.assert_allclose(found, force, rtol=1e-6, atol=1e-5)


def test_edge_override(predictor, inside):
    times, indentations, tabor = inside
    found = np.zeros_like(times)
    found[:, [49, 69]] = 1.0
    base = predictor.predict_history(times, indentations, scenes(tabor))
    np.testing.assert_array_equal(predictor.predict_history(times, indentations, scenes(tabor), found), base)
    assert np.abs(predictor.predict_history(times, indentations, scenes(tabor), 0 * found) - base).max() > 1e-4
    with pytest.raises(ValueError, match="edge marks of shape"):
        predictor.predict_history(times, indentations, scenes(tabor), found[:, 1:])
    for wrong in (0.5, -1.0, 2.0, np.nan):
        with pytest.raises(ValueError, match="edge marks of zero or one"):
            predictor.predict_history(times, indentations, scenes(tabor), wrong * found)


def test_extrapolation_warns_once_by_name(predictor, inside):
    times, indentations, tabor = inside
    with pytest.warns(ExtrapolationWarning, match=r"tabor = 9 lies outside \[0\.\d+, \d.*\]") as caught:
        predictor.predict_history(times, indentations, scenes([9.0])[0])
    assert len(caught) == 1
    far = 1000.0 * indentations / indentations.max(axis=1, keepdims=True)
    with pytest.warns(ExtrapolationWarning, match=r"peak_indentation = 1000") as caught:
        predictor.predict_history(times, far, scenes(tabor))
    assert len(caught) == 1
    with pytest.warns(ExtrapolationWarning, match="rate"):
        predictor.predict_history(times * 1e6, indentations, scenes(tabor))


def resampled(times, indentations, total):
    """The first history on another number of measurement steps."""
    ends, wanted = ([0, *(np.cumsum(one) - 1)] for one in (FMS, proportional_counts(total)))
    places = np.interp(np.arange(total), wanted, ends)
    corners, levels = (values[0, ends] for values in (times, indentations))
    return np.interp(places, ends, corners)[None], np.interp(places, ends, levels)[None]


@pytest.mark.parametrize("total", [24, 30, 90, 150, 2000])
def test_other_numbers_of_points_warn(predictor, inside, total):
    times, indentations, tabor = inside
    arguments = resampled(times, indentations, total)
    words = (
        rf"loading_points = {proportional_counts(total)[0]} lies outside \[42, 58\]; dwell_points = .*; unloading_po"
    )
    with pytest.warns(ExtrapolationWarning, match=words) as caught:
        predictor.predict_history(*arguments, scenes(tabor[:1]))
    assert len(caught) == 1


def test_other_shapes_warn(predictor, inside):
    times, indentations, tabor = (part[:1] for part in inside)
    peak = indentations.max()

    def said(new_times=times, new_indentations=indentations):
        (words,) = predictor.extrapolated(new_times, new_indentations, scenes(tabor))
        return "; ".join(words)

    assert said() == ""
    shallow = indentations + 0.5 * (peak - indentations)
    assert "start_indentation" in said(new_indentations=shallow)
    assert "end_indentation" in said(new_indentations=shallow)
    bump = np.zeros_like(times)
    bump[0, :50] = 0.05 * peak * np.sin(np.linspace(0.0, np.pi, 50))
    assert "bend = " in said(new_indentations=indentations + bump)
    assert "lies outside [0, 0.005]" in said(new_indentations=indentations + bump)
    # The same path at instants that crowd at its start.
    crowded = times.copy()
    crowded[0, :50] = times[0, 49] * np.linspace(0.0, 1.0, 50) ** 2
    assert "step_ratio = " in said(crowded, np.interp(crowded, times[0], indentations[0]))


def test_history_without_plateau_works(predictor):
    times = np.linspace(0.0, 4.0, 51)[None]
    with pytest.warns(ExtrapolationWarning, match=r"dwell_time = 0 lies outside.*Advice: .*the model counts points"):
        force = predictor.predict_history(times, 10.0 - 6.0 * np.abs(times - 2.0), SCENE)
    assert np.isfinite(force).all()


def test_bad_input(predictor, inside):
    times, indentations, tabor = inside
    hole = indentations.copy()
    hole[1, 7] = np.nan
    backwards = times.copy()
    backwards[2, 5] = backwards[2, 4]
    given = scenes(tabor)
    for arguments, words in (
        ((times, hole, given), "finite indentations.*history 1"),
        ((backwards, indentations, given), "increase strictly.*history 2"),
        ((times, indentations[:, 1:], given), "of the same shape"),
        ((times[0], indentations, given), "of the same shape"),
        ((times, indentations, given[:2]), "one scene, or one for each of 5 histories. Received: 2"),
        ((times, indentations, scenes(tabor, 0.3)), r"the modulus ratio 0\.1, the only one.*modulus_ratio=0\.3"),
        ((times, indentations, 1.0), r"Expected a bem\.Scene"),
        ((times + 0j, indentations, given), "times must be real numbers"),
        ((times, (indentations + 1j).tolist(), given), "indentations must be real numbers"),
        ((times, [[1.0], [2.0, 3.0]], given), "indentations must be real numbers"),
        ((None, indentations, given), "of the same shape"),
        ((times * 1e-320, indentations, given), "time steps within|increase strictly"),
        ((times * 1e-16, indentations, given), "rates within -1e"),
        ((times * 1e30, indentations, given), "times after the first within 0 and"),
        ((times, 1e9 * indentations, given), "indentations within -1e"),
        (((times - 1e18)[:, :3], indentations[:, :3], given), "increase strictly"),
    ):
        with pytest.raises(ValueError, match=words):
            predictor.predict_history(*arguments)


def test_a_loaded_model_can_be_pickled_to_where_its_files_are_not(folder, inside):
    times, indentations, tabor = inside
    loaded = {"onnx": surrogate.load(folder, threads=2), "keras": surrogate.load(folder, backend="keras")}
    forces = {backend: model.predict_history(times, indentations, scenes(tabor)) for backend, model in loaded.items()}
    content = pickle.dumps(loaded)
    shutil.rmtree(folder)
    for backend, model in pickle.loads(content).items():
        np.testing.assert_array_equal(model.predict_history(times, indentations, scenes(tabor)), forces[backend])
        assert (model.name, model.scaling) == ("M1-concat", loaded[backend].scaling)
        assert model.stream(SCENE).step(0.0, -2.15) == loaded[backend].stream(SCENE).step(0.0, -2.15)
    assert pickle.loads(content)["onnx"].network.threads == 2


@pytest.mark.slow
def test_a_published_model_predicts_in_other_processes():
    from joblib import Parallel, delayed

    model = surrogate.load("M1-concat")
    protocol = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
    here = model.predict(SCENE, protocol)
    for there in Parallel(n_jobs=2)(delayed(model.predict)(SCENE, protocol) for _ in range(2)):
        np.testing.assert_array_equal(there.force, here.force)

"""The inputs F of an exported model; `test_onnx` compares files of all feature sets with Keras."""

import dataclasses

import numpy as np
import onnx
import pytest

import surrogate
from surrogate.prediction.networks import KerasNetwork
from surrogate.prediction.predictor import Surrogate
from surrogate.training.recipe import Recipe
from surrogate.training.runs import Run, execute
from tests.surrogate.conftest import scenes, write_onnx


@pytest.mark.filterwarnings("ignore:.*extrapolates")
def test_inputs_of_the_material_know_that_of_the_training(stirred, dataset, grid, tmp_path):
    backend, expected = stirred("M3-concat", "F")
    path = write_onnx(tmp_path / "model.onnx", backend)
    (ratio,) = [item for item in onnx.load(path).graph.initializer if item.name == "modulus_ratio"]
    assert onnx.numpy_helper.to_array(ratio).tolist() == [0.1]
    other = dataclasses.replace(backend.scaling, ranges=backend.scaling.ranges | {"modulus_ratio": (0.5, 0.5)})
    write_onnx(path, KerasNetwork(backend.model, other, name="M3-concat"))
    times, indentations = (part[:6] for part in grid)
    tabor = dataset.protocols["tabor"][:6]
    found = other.scale_force(surrogate.load(path).predict_history(times, indentations, scenes(tabor, 0.5)))
    assert np.abs(found - expected).max() > 1e-2
    unknown = dataclasses.replace(other, ranges={})
    with pytest.raises(ValueError, match=r"one known modulus ratio for features F\. Received: none"):
        write_onnx(path, KerasNetwork(backend.model, unknown))


@pytest.mark.filterwarnings("ignore:.*extrapolates")
@pytest.mark.parametrize(("name", "features"), [("M3-concat", "F"), ("M1-concat", "D")])
def test_inputs_on_short_and_long_steps_and_at_large_times(name, features, stirred, tmp_path):
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


def test_a_training_with_inputs_of_the_material_leaves_a_file(least, dataset, tmp_path):
    recipe = Recipe.load("swift").with_overrides(epochs=1, optimizer="adam")
    execute(Run("M1-concat", dataset, dataset.split(), recipe, features="F"), tmp_path)
    model = surrogate.load(tmp_path / "model")
    assert (model.network.complete, model.scaling.features, model.modulus_ratio) == (True, "F", 0.1)
    times, indentations = (part[:1] for part in dataset.grid(np.arange(1)))
    (scene,) = scenes(dataset.protocols["tabor"][:1])
    expected = surrogate.load(tmp_path / "model", backend="keras").predict_history(times, indentations, scene)
    atol = 1e-5 * np.ptp(expected)
    np.testing.assert_allclose(model.predict_history(times, indentations, scene), expected, rtol=0.0, atol=atol)
    edge = np.isin(np.arange(times.shape[1]), [49, 69])
    streamed = model.stream(scene).run(times[0], indentations[0], edge)
    np.testing.assert_allclose(streamed, expected[0], rtol=0.0, atol=atol)

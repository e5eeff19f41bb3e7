import json
import os
import subprocess
import sys

import numpy as np
import pytest

import surrogate

OTHER_BACKEND = """
import sys
import warnings
from pathlib import Path

import keras
import numpy as np
import surrogate
from bem import Scene, StandardLinearSolid
from surrogate.training import runs
from surrogate.data.dataset import TrajectoryDataset
from surrogate.training.recipe import Recipe

folder, dataset = Path(sys.argv[1]), TrajectoryDataset.load(sys.argv[2])


def started(name, features):
    # Every backend draws its own first weights.
    model = surrogate.build(name, features=features)
    model.load_weights(folder / "start.weights.h5")
    return model


runs.build = started
warnings.simplefilter("ignore")
solids = [Scene(mu, StandardLinearSolid(0.1)) for mu in dataset.protocols["tabor"][dataset.split().test].tolist()]
for optimizer in ("adam", "soap"):
    recipe = Recipe.load("swift").with_overrides(epochs=1, batch_size=24, optimizer=optimizer)
    run = runs.Run("M3-FiLM", dataset, dataset.split(), recipe)
    place = folder / keras.backend.backend() / optimizer
    place.parent.mkdir(exist_ok=True)
    assert runs.execute(run, place).finished
    model = surrogate.load(place / "model", backend="keras")
    force = model.predict_history(*dataset.grid(run.split.test), solids)
    np.save(place / "scaled.npy", model.scaling.scale_force(force))
"""


@pytest.mark.parametrize("backend", ["torch", "jax"])
def test_two_steps_under_another_backend(backend, dataset, dataset_path, tmp_path):
    pytest.importorskip(backend)
    surrogate.build("M3-FiLM").save_weights(tmp_path / "start.weights.h5")
    names = (backend, "tensorflow")
    for name in names:
        subprocess.run(
            [sys.executable, "-c", OTHER_BACKEND, str(tmp_path), str(dataset_path)],
            env={**os.environ, "KERAS_BACKEND": name},
            check=True,
        )
    forces = {(name, how): np.load(tmp_path / name / how / "scaled.npy") for name in names for how in ("adam", "soap")}
    np.testing.assert_allclose(forces[backend, "adam"], forces["tensorflow", "adam"], rtol=0.0, atol=1e-5)
    # SOAP's second step is taken in bases of the first one's gradients alone, which span a part of the space only;
    # rounding decides the others' directions, so the steps have the same size but not the same digits.
    moved = np.abs(forces["tensorflow", "soap"] - forces["tensorflow", "adam"]).max()
    assert np.abs(forces[backend, "soap"] - forces["tensorflow", "soap"]).max() < 0.5 * moved
    runs = [json.loads((tmp_path / name / "soap" / "model" / "run.json").read_text()) for name in names]
    assert [run["backend"] for run in runs] == [*names]


COMPARED = """
import keras, numpy as np
import surrogate
from surrogate.training.torch_lstm import TorchLSTM, with_fused_lstm

draw = np.random.default_rng(0)
sequence, tabor, force = (draw.normal(size=shape).astype("float32") for shape in ((4, 30, 4), (4, 1), (4, 30, 1)))
for name in surrogate.names():
    keras.utils.set_random_seed(0)
    model = surrogate.build(name)
    fused = with_fused_lstm(model)
    lstms = [sum(isinstance(layer, kind) for layer in one.layers)
             for one, kind in ((model, keras.layers.LSTM), (fused, TorchLSTM))]
    assert lstms[0] == lstms[1]
    assert [weight.path for weight in fused.weights] == [weight.path for weight in model.weights]
    for one in (model, fused):
        one.compile(keras.optimizers.SGD(0.1), loss="mse")
    for _ in range(2):
        np.testing.assert_allclose(*(one.predict_on_batch([sequence, tabor]) for one in (fused, model)), atol=1e-5)
        for one in (model, fused):
            keras.utils.set_random_seed(1)  # of the dropout
            one.train_on_batch([sequence, tabor], force)
    for one, other in zip(fused.get_weights(), model.get_weights(), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)
"""


UNUSUAL = """
import keras, numpy as np
from surrogate.training.torch_lstm import with_fused_lstm

sequence = keras.Input((9, 2))
reverse = keras.layers.LSTM(3, go_backwards=True, return_sequences=True)(sequence)
model = keras.Model(sequence, keras.layers.LSTM(3, activation="relu")(reverse))
data = np.random.default_rng(0).normal(size=(4, 9, 2)).astype("float32")
np.testing.assert_allclose(*(one.predict_on_batch(data) for one in (with_fused_lstm(model), model)), atol=1e-6)
"""


@pytest.mark.parametrize("code", [COMPARED, UNUSUAL], ids=["the paper's", "other layers"])
def test_fused_lstm_learns_as_keras_does(code):
    pytest.importorskip("torch")
    subprocess.run([sys.executable, "-c", code], env={**os.environ, "KERAS_BACKEND": "torch"}, check=True)

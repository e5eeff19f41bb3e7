"""Under PyTorch the trained copy of a model computes what Keras's layers do. Skipped where PyTorch is not installed."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("torch")

COMPARED = """
import keras, numpy as np
import surrogate
from surrogate.training.torch_lstm import TorchLSTM
from surrogate.training.fitting import with_fused_lstm

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


def test_a_fused_copy_predicts_and_learns_as_its_model():
    subprocess.run([sys.executable, "-c", COMPARED], env={**os.environ, "KERAS_BACKEND": "torch"}, check=True)


UNUSUAL = """
import keras, numpy as np
from surrogate.training.torch_lstm import with_torch_lstm

sequence = keras.Input((9, 2))
reverse = keras.layers.LSTM(3, go_backwards=True, return_sequences=True)(sequence)
model = keras.Model(sequence, keras.layers.LSTM(3, activation="relu")(reverse))
data = np.random.default_rng(0).normal(size=(4, 9, 2)).astype("float32")
np.testing.assert_allclose(*(one.predict_on_batch(data) for one in (with_torch_lstm(model), model)), atol=1e-6)
"""


def test_an_lstm_of_another_kind_is_left_to_keras():
    subprocess.run([sys.executable, "-c", UNUSUAL], env={**os.environ, "KERAS_BACKEND": "torch"}, check=True)

"""Layers of a user's own that are exported, and those that only Keras computes."""

import keras
import numpy as np
import pytest
from keras import layers
from typer.testing import CliRunner

import surrogate
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.cli import app as cli
from surrogate.data.features import edge_from_counts
from surrogate.networks import KerasNetwork
from surrogate.onnx.export import file_content
from surrogate.onnx.graph import OnnxGraph
from surrogate.onnx.keras_layers import NotExportableError, add_network
from surrogate.training.identity import Run
from surrogate.training.recipe import Recipe
from surrogate.training.runs import execute
from tests.surrogate.conftest import scaling_of, scenes


def test_unknown_layer_leaves_keras_only(dataset, tmp_path):
    def noisy(conditioning, features, name):
        sequence, tabor = inputs(features)
        hidden = layers.GaussianNoise(0.1, name="noise")(AppendTabor()(sequence, tabor))
        return keras.Model([sequence, tabor], layers.Dense(1)(hidden), name=name)

    surrogate.register("M7", noisy)
    run = Run("M7-concat", dataset, dataset.split(), Recipe.load("swift").with_overrides(epochs=1, optimizer="adam"))
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "model.onnx").write_text("of an earlier attempt")
    said = []
    assert execute(run, tmp_path, log=said.append).finished
    assert said[-1].startswith(
        "M7-concat: no model.onnx is written, so the model predicts with backend='keras' only. layers must be "
    )
    assert said[-1].endswith("received GaussianNoise 'noise'")
    assert not (tmp_path / "model" / "model.onnx").exists()
    times, indentations = dataset.grid(run.split.train[:2])
    trained = surrogate.load(tmp_path / "model", backend="keras")
    force = trained.predict_history(times, indentations, scenes(dataset.protocols["tabor"][run.split.train[:2]]))
    assert force.shape == times.shape
    assert np.isfinite(force).all()
    result = CliRunner().invoke(cli.app, ["export", str(tmp_path / "model")])
    assert isinstance(result.exception, NotExportableError)


class Twice(layers.Dense):
    """A user's layer of the name of a known one."""


Twice.__name__ = "Dense"


def shared(sequence):
    layer = layers.Dense(5, name="shared")
    return layer(layer(layers.Dense(5)(sequence)))


@pytest.mark.parametrize(
    ("wiring", "words"),
    [
        (lambda s, _: layers.LSTM(5, return_sequences=True, activation="relu")(s), "LSTM of tanh and sigmoid"),
        (lambda s, _: layers.LSTM(5, return_sequences=True, go_backwards=True)(s), "forward LSTM"),
        (lambda s, _: layers.Dense(5, activation="selu")(s), "received selu"),
        (lambda s, _: layers.Dense(5, activation=layers.LeakyReLU())(s), "received LeakyReLU"),
        (lambda s, _: layers.Conv1D(5, 3, padding="same")(s), "causal convolution"),
        (lambda s, _: layers.Conv1D(4, 3, padding="causal", groups=2)(s), "of one group"),
        (lambda s, _: layers.LayerNormalization(scale=False)(s), "scales and shifts"),
        (lambda s, _: layers.LayerNormalization(rms_scaling=True)(s), "scales and shifts"),
        (lambda s, _: layers.Add()([s, s, s]), "a sum of two"),
        (lambda s, _: layers.Add()([s, layers.Dense(1)(s)]), "a sum of two of one shape"),
        (lambda s, _: s + 1.0, "received Add 'add"),
        (lambda s, _: keras.ops.tanh(s), "received Tanh"),
        (lambda s, _: shared(s), "received Dense 'shared', called 2 times"),
        (lambda s, t: FiLM(name="film")(s, tabor=t), "received FiLM 'film', called with named inputs or options"),
        (lambda s, _: layers.Dropout(0.5, name="on")(s, training=True), "received Dropout 'on', called with named in"),
        (lambda s, _: layers.MultiHeadAttention(2, 3)(s, s, use_causal_mask=True), "called with named inputs or opt"),
        (lambda s, _: layers.MultiHeadAttention(2, 3)(s, layers.Dense(4)(s)), "attention of one sequence to itself"),
        (lambda s, _: layers.MultiHeadAttention(2, 3, use_bias=False)(s, s), "with bias"),
        (lambda s, _: layers.MultiHeadAttention(2, 3, output_shape=5)(s, s), "to the width of its input"),
        (lambda s, _: layers.ReLU(max_value=6.0)(s), "a ReLU without options"),
        (lambda s, _: Twice(5)(s), "layers must be of the kinds"),
        (lambda s, t: FiLM()(s, layers.LayerNormalization(name="of_tabor")(t)), "'of_tabor' on the Tabor parameter"),
    ],
)
def test_what_cannot_be_exported_is_named(wiring, words):
    sequence, tabor = inputs("D")
    hidden = AppendTabor()(wiring(sequence, tabor), tabor)
    graph = OnnxGraph()
    with pytest.raises(NotExportableError, match=words):
        add_network(keras.Model([sequence, tabor], readout(hidden)), *map(graph.named, ("sequence", "tabor")))


def test_rare_settings_are_exported(dataset, tmp_path):
    sequence, tabor = inputs("D")
    hidden = layers.Dense(6, use_bias=False, activation="relu")(sequence)
    hidden = layers.Conv1D(6, 3, padding="causal", dilation_rate=2, use_bias=False)(layers.Dropout(0.5)(hidden))
    hidden = layers.Add()([hidden, layers.LayerNormalization()(hidden)])
    hidden = layers.MultiHeadAttention(2, 3, value_dim=5)(hidden, hidden)
    hidden = FiLM()(hidden, layers.Dense(3)(tabor))
    hidden = layers.Dropout(0.1)(readout(TaborGate()(hidden, layers.Dense(6)(hidden), tabor)))
    model = keras.Model([sequence, tabor], hidden)
    scaling = scaling_of(dataset)
    (tmp_path / "m.onnx").write_bytes(file_content(model, scaling, name="m", architecture="m"))
    rows = np.arange(5)
    edge = edge_from_counts(dataset.points_per_phase, 5)
    arguments = (*dataset.grid(rows), dataset.protocols["tabor"][rows], edge)
    expected = KerasNetwork(model, scaling).force(*arguments)
    found = surrogate.load(tmp_path / "m.onnx").network.force(*arguments)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)

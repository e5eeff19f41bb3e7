import re
import subprocess
import sys
from pathlib import Path

import keras
import numpy as np
import pytest

import surrogate
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.m1_lstm import m1_lstm
from surrogate.architectures.m5_encoder import m5_encoder
from surrogate.architectures.naming import FAMILIES, PARAMETER_COUNTS, Family, paper_names
from tests.surrogate.conftest import QUICK


@pytest.fixture(scope="module")
def models():
    keras.utils.set_random_seed(0)
    return {name: surrogate.build(name) for name in surrogate.names()}


# Without compilation a recurrent network takes its seconds by the step.
def inputs(steps=9, batch=2, channels=4):
    rng = np.random.default_rng(1)
    return rng.normal(size=(batch, steps, channels)).astype("float32"), rng.normal(size=(batch, 1)).astype("float32")


# NumPy itself refuses PyTorch's tensors with gradients.
numpy_of = keras.ops.convert_to_numpy


def run(model, sequence, tabor):
    return numpy_of(model([sequence, tabor], training=False))


def set_all(layer, value):
    for weight in layer.trainable_weights:
        weight.assign(keras.ops.full(weight.shape, value))


def test_trainable_parameters(models):
    counts = {name: sum(map(np.size, map(numpy_of, model.trainable_weights))) for name, model in models.items()}
    assert counts == PARAMETER_COUNTS
    assert set(paper_names()) <= counts.keys()


@pytest.mark.parametrize("name", surrogate.names())
def test_names_inputs_and_causality(models, name, tmp_path):
    model = models[name]
    assert not [
        layer.name
        for layer in model.layers
        if re.fullmatch(r"(dense|lstm|conv1d|add)(_\d+)?", layer.name)
        and layer.name not in ("lstm", "lstm_1", "lstm_2", "lstm_3", "add")
    ]
    (sequence,), (tabor,) = inputs(batch=1)
    changed = sequence.copy()
    changed[5] += 1.0
    three = np.stack([sequence, sequence, changed]), np.stack([tabor, tabor + 1.0, tabor])
    base, of_tabor, of_step = run(model, *three)
    assert np.abs(of_tabor - base).max() > 1e-6
    difference = np.abs(of_step - base)[:, 0]
    assert difference[5:].max() > 1e-4
    if name.startswith("M5"):
        assert difference[:5].max() > 0, "an encoder attends both ways"
    else:
        assert difference[:5].max() < 1e-6
    # Any number of steps works.
    assert run(model, *inputs(3)).shape == (2, 3, 1)
    if name in QUICK:
        model.save(tmp_path / "model.keras")
        again = run(keras.saving.load_model(tmp_path / "model.keras"), *three)
        np.testing.assert_allclose(again, [base, of_tabor, of_step], atol=1e-6)


@pytest.mark.parametrize("name", [name for name in surrogate.names() if name.startswith("M4")])
def test_receptive_field_of_m4_is_61_steps(models, name):
    sequence, tabor = inputs(140, batch=1)
    changed = sequence.copy()
    changed[:, 40] += 10.0
    difference = np.abs(run(models[name], changed, tabor) - run(models[name], sequence, tabor))[0, :, 0]
    # Output j sees inputs j - 60 to j.
    assert set(np.flatnonzero(difference > 1e-6)) <= set(range(40, 101))
    assert difference[100] > 0
    assert difference[101:].max() < 1e-6


@pytest.mark.parametrize("features", ["A", "B", "C", "D"])
def test_feature_sets_change_the_input_only(features):
    model = surrogate.build("M3-concat", features=features)
    channels = {"A": 2, "B": 3, "C": 4, "D": 4}[features]
    assert model.input_shape == [(None, None, channels), (None, 1)]
    assert model.count_params() == 165_633 - 3 * 64 * (4 - channels)


def test_unknown_names_list_those_alike():
    with pytest.raises(ValueError, match=r"must be one of M\d-concat, .* or 15 others; received 'M99-concat'"):
        surrogate.build("M99-concat")
    with pytest.raises(ValueError, match=r"A, B, C, D; received 'G'"):
        surrogate.build("M1-concat", features="G")


@pytest.mark.parametrize(
    "layer",
    [
        AppendTabor(),
        FiLM(hidden=5),
        TaborGate(hidden=7),
    ],
    ids=lambda layer: type(layer).__name__,
)
def test_layers_survive_serialisation(layer):
    config = keras.saving.serialize_keras_object(layer)
    again = keras.saving.deserialize_keras_object(config)
    assert type(again) is type(layer)
    assert again.get_config() == layer.get_config()


def test_layers_module_registers_with_keras(models, tmp_path):
    models["M5-FiLM"].save(tmp_path / "model.keras")
    load = f"keras.saving.load_model({str(tmp_path / 'model.keras')!r})"
    subprocess.run([sys.executable, "-c", f"import keras, surrogate.architectures.layers; {load}"], check=True)


def test_film_golden_values():
    film = FiLM(hidden=1)
    sequence, tabor = np.array([[[1.0, 2.0]]]), np.array([[3.0]])
    np.testing.assert_allclose(numpy_of(FiLM()(sequence, np.zeros((1, 1)))), sequence)
    film(sequence, tabor)
    set_all(film, 0.5)
    # Context 3 * 0.5 + 0.5 = 2; scale and shift 2 * 0.5 + 0.5 = 1.5.
    np.testing.assert_allclose(numpy_of(film(sequence, tabor)), [[[3.0, 4.5]]])


def test_gate_golden_values():
    gate = TaborGate(hidden=2)
    first, second, tabor = np.full((1, 3, 2), 4.0), np.full((1, 3, 2), 1.0), np.ones((1, 1))
    gate(first, second, tabor)
    set_all(gate, 0.0)
    gate.weighting.bias.assign(np.log([2.0, 1.0]))
    np.testing.assert_allclose(numpy_of(gate(first, second, tabor)), np.full((1, 3, 2), 3.0), rtol=1e-6)
    with pytest.raises(ValueError, match="one width"):
        TaborGate()(np.ones((1, 3, 2)), np.ones((1, 3, 4)), tabor)


def test_tcn_block_keeps_its_skip_path(models):
    model = keras.models.clone_model(models["M4-concat"])
    sequence, tabor = inputs()
    for name in ("first", "second"):
        set_all(model.get_layer(f"block_2_{name}_normalisation"), 0.0)
    ends = [model.get_layer(f"block_{number}_add").output for number in (1, 2)]
    before, after = keras.Model(model.inputs, ends)([sequence, tabor])
    # Zero weights silence both stages.
    np.testing.assert_array_equal(numpy_of(before), numpy_of(after))


def test_builders_return_named_models(monkeypatch):
    model = m1_lstm("FiLM", features="C")
    assert (model.name, model.count_params()) == ("M1-FiLM", PARAMETER_COUNTS["M1-FiLM"])
    assert m1_lstm(name="mine").name == "mine"
    with pytest.raises(ValueError, match="conditioning must be one of concat, FiLM, gated; received 'film'"):
        m1_lstm("film")
    kinds = [type(layer).__name__ for layer in m5_encoder().layers]
    assert kinds.count("MultiHeadAttention") == 2
    monkeypatch.setitem(FAMILIES, "M7", Family("a line of the table", "m1_lstm", (473_729,), ("concat",)))
    assert surrogate.names()[-1] == surrogate.build("M7-concat").name == "M7-concat"


def test_documented_table_is_generated():
    from surrogate.cli.tables import parameter_table

    document = Path(__file__).parents[3] / "docs" / "surrogate-models.md"
    assert parameter_table() in document.read_text(encoding="utf-8")

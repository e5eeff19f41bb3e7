import keras
import numpy as np
import pytest
from keras import ops

from surrogate.architectures import build
from surrogate.training.soap import Soap, _Blocks


def minimise(optimizer, start, gradient, steps):
    variable = keras.Variable(start, dtype="float32")
    optimizer.build([variable])
    for _ in range(steps):
        optimizer.apply([ops.convert_to_tensor(gradient(ops.convert_to_numpy(variable)))])
    return ops.convert_to_numpy(variable)


def test_a_vector_moves_as_under_adam():
    start, target = np.array([1.0, -2.0, 3.0], np.float32), np.array([0.5, 0.5, 0.0], np.float32)
    same = {"learning_rate": 1e-2, "beta_1": 0.9, "beta_2": 0.99}
    ours = minimise(Soap(**same), start, lambda x: x - target, 20)
    theirs = minimise(keras.optimizers.Adam(epsilon=1e-8, **same), start, lambda x: x - target, 20)
    np.testing.assert_allclose(ours, theirs, rtol=1e-5)


def test_scaled_problem_needs_fewer_steps():
    rng = np.random.default_rng(0)
    left, right = (np.linalg.qr(rng.normal(size=(8, 8)))[0].astype(np.float32) for _ in range(2))
    left_scale, right_scale = (np.geomspace(1, 30, 8, dtype=np.float32) for _ in range(2))
    target = rng.normal(size=(8, 8)).astype(np.float32)
    scale = left_scale[:, None] * right_scale

    def gradient(x):
        return left @ (scale**2 * (left.T @ (x - target) @ right)) @ right.T

    def loss(x):
        return float(np.sum((scale * (left.T @ (x - target) @ right)) ** 2))

    start = np.zeros((8, 8), np.float32)
    ours = minimise(Soap(3e-2, beta_1=0.9), start, gradient, 150)
    theirs = minimise(keras.optimizers.Adam(3e-2, beta_2=0.95), start, gradient, 150)
    assert loss(ours) < 0.2 * loss(theirs) < 0.2 * loss(start)


def test_bases_are_orthogonal_eigenvectors():
    rng = np.random.default_rng(1)
    turn = np.linalg.qr(rng.normal(size=(6, 6)))[0].astype(np.float32)
    draws = iter(turn @ np.diag([8, 4, 2, 1, 0.5, 0.25]) @ rng.normal(size=(6, 200)) for _ in range(150))
    optimizer = Soap(0.0, beta_2=0.9, basis_every=2)
    minimise(optimizer, np.zeros((6, 200), np.float32), lambda _: next(draws).astype(np.float32), 150)
    vectors = ops.convert_to_numpy(optimizer._bases[0][0].vectors)[0]
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(6), atol=1e-5)
    assert np.all(np.abs(np.sum(vectors * turn, axis=0))[:3] > 0.98)


@pytest.mark.parametrize(
    ("model", "layer", "count"),
    [
        ("M1-concat", "lstm_1", 4),
        ("M4-concat", "block_1_first_convolution", 1),
        ("M5-concat", "block_1_attention", 4),
        ("M1-FiLM", "film", 1),
    ],
)
def test_kernels_split_into_gates_and_heads(model, layer, count):
    found = [v for v in build(model).get_layer(layer).trainable_variables if len(v.shape) > 1]
    blocks = [_Blocks.of(variable) for variable in found]
    assert max(part.count for part in blocks) == count
    for variable, part in zip(found, blocks, strict=True):
        stack = part.split(variable.value)
        assert tuple(stack.shape) == (part.count, part.rows, part.columns)
        np.testing.assert_array_equal(part.join(stack), variable.value)
    if layer == "lstm_1":
        recurrent = ops.convert_to_numpy(found[1])
        np.testing.assert_array_equal(blocks[1].split(found[1].value)[2], recurrent[:, 512:768])


def test_configuration_round_trip():
    optimizer = Soap(1e-3, beta_1=0.8, basis_every=7, global_clipnorm=1.0)
    again = keras.optimizers.deserialize(keras.optimizers.serialize(optimizer))
    assert isinstance(again, Soap)
    assert again.get_config() == optimizer.get_config()

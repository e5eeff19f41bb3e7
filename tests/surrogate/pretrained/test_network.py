import numpy as np
import pytest

from surrogate.pretrained.network import CHANNELS, Network, onnx_file


def sigmoid(values):
    return 1.0 / (1.0 + np.exp(-values))


def by_hand(weights, inputs):
    """LSTMs of Keras's gates i, f, c, o, then two dense layers; of inputs (steps, batch, channels)."""
    *lstms, kernel, bias, last, offset = weights
    sequence = inputs
    for number in range(len(lstms) // 3):
        w, r, b = lstms[3 * number : 3 * number + 3]
        hidden = cell = np.zeros((inputs.shape[1], len(r)))
        outputs = []
        for step in sequence:
            i, f, c, o = np.split(step @ w + hidden @ r + b, 4, axis=1)
            cell = sigmoid(f) * cell + sigmoid(i) * np.tanh(c)
            hidden = sigmoid(o) * np.tanh(cell)
            outputs.append(hidden)
        sequence = np.stack(outputs)
    return (np.maximum(sequence @ kernel + bias, 0.0) @ last + offset)[..., 0].T


def weights(units, seed=0):
    rng = np.random.default_rng(seed)
    shapes, width = [], CHANNELS
    for size in units:
        shapes += [(width, 4 * size), (size, 4 * size), (4 * size,)]
        width = size
    shapes += [(width, 6), (6,), (6, 1), (1,)]
    return [rng.normal(scale=0.5, size=shape).astype(np.float32) for shape in shapes]


@pytest.mark.parametrize("units", [(4,), (5, 3)])
def test_the_file_computes_the_network(units, tmp_path):
    path = tmp_path / "model.onnx"
    path.write_bytes(onnx_file(weights(units), "some"))
    inputs = np.random.default_rng(1).normal(size=(7, 3, CHANNELS)).astype(np.float32)
    np.testing.assert_allclose(Network(path)(inputs), by_hand(weights(units), inputs), atol=1e-5)


def test_other_files_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"which is missing"):
        Network(tmp_path / "none.onnx")
    (tmp_path / "text.onnx").write_text("no network")
    with pytest.raises(ValueError, match=r"unreadable"):
        Network(tmp_path / "text.onnx")

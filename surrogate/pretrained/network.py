"""The network of a pretrained model: an ONNX file of LSTMs from scaled inputs to the scaled force.

Unlike the files of `surrogate export` it does not contain the features, which are compiled
(`surrogate.pretrained.kernels`). Input `inputs`, float32 of shape `(steps, batch, 13)`; output `force`, float32 of
shape `(steps, batch)`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from surrogate.network.graph import SEQUENCE, TABOR, Graph, lstm_weights
from surrogate.network.onnx_file import checked_model, session_of

CHANNELS = 13
BATCH = 128
"""Histories computed at a time: larger batches leave the caches and gain nothing."""


def onnx_file(weights: list[np.ndarray], name: str) -> bytes:
    """Return the ONNX file of a network.

    Args:
        weights: Those of the Keras model of `surrogate.pretrained.training.network` in their order: kernel, recurrent
            kernel and bias of each LSTM, then kernel and bias of two dense layers.
        name: The model's name.
    """
    from onnx import TensorProto, helper, numpy_helper

    nodes, constants, source = [], {"one": np.array([1])}, "inputs"
    *lstms, kernel, bias, last, offset = weights
    for number in range(len(lstms) // 3):
        units = lstms[3 * number + 1].shape[0]
        added = lstm_weights(*lstms[3 * number : 3 * number + 3])
        constants |= {f"{key}{number}": values for key, values in added.items()}
        nodes.append(helper.make_node("LSTM", [source, *(f"{key}{number}" for key in "WRB")], [f"y{number}"]))
        nodes[-1].attribute.append(helper.make_attribute("hidden_size", units))
        nodes.append(helper.make_node("Squeeze", [f"y{number}", "one"], [f"h{number}"]))
        source = f"h{number}"
    constants |= {"kernel": kernel, "bias": bias, "last": last, "offset": offset, "two": np.array([2])}
    for kind, inputs, output in (
        ("MatMul", [source, "kernel"], "a"),
        ("Add", ["a", "bias"], "b"),
        ("Relu", ["b"], "c"),
        ("MatMul", ["c", "last"], "d"),
        ("Add", ["d", "offset"], "e"),
        ("Squeeze", ["e", "two"], "force"),
    ):
        nodes.append(helper.make_node(kind, inputs, [output]))
    shapes = {"inputs": ["steps", "batch", CHANNELS], "force": ["steps", "batch"]}
    taken, given = (helper.make_tensor_value_info(key, TensorProto.FLOAT, shape) for key, shape in shapes.items())
    stored = [numpy_helper.from_array(np.ascontiguousarray(values), key) for key, values in constants.items()]
    model = checked_model(helper.make_graph(nodes, name, [taken], [given], initializer=stored))
    return model.SerializeToString(deterministic=True)


def graph_of(path: Path) -> Graph:
    """Return the network of a file of `onnx_file` as a graph of elementary operations."""
    import onnx
    from onnx import numpy_helper

    known = {one.name: numpy_helper.to_array(one) for one in onnx.load(path).graph.initializer}
    graph = Graph()
    source = graph.add("append", "inputs", [SEQUENCE, TABOR])
    number = 0
    while f"R{number}" in known:
        weights = {key: known[f"{key}{number}"] for key in "WRB"}
        source = graph.add("lstm", f"lstm{number}", [source], weights)
        number += 1
    source = graph.add("dense", "dense", [source], {"kernel": known["kernel"], "bias": known["bias"]})
    source = graph.add("relu", "relu", [source])
    graph.add("dense", "force", [source], {"kernel": known["last"], "bias": known["offset"]})
    return graph


class Network:
    """An ONNX file of `onnx_file`, run by ONNX Runtime on one thread.

    Raises:
        FileNotFoundError: no such file.
        ValueError: it is not such a file.
    """

    def __init__(self, path: Path, threads: int = 1) -> None:
        if not path.is_file():
            raise FileNotFoundError(f"Expected the network of a pretrained model. Received: {path}, which is missing")
        try:
            self._session = session_of(path.read_bytes(), threads)
            shape = self._session.get_inputs()[0].shape
        # ONNX Runtime's exceptions share no base class of their own.
        except Exception as error:
            raise ValueError(f"Expected the network of a pretrained model. Received: {path}, unreadable") from error
        if len(shape) != 3 or shape[2] != CHANNELS:
            raise ValueError(f"Expected a network of {CHANNELS} inputs. Received: {path} of the inputs {shape}")

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        """Return the scaled force of shape `(batch, steps)` of scaled inputs `(steps, batch, 13)`."""
        found: Any = self._session.run(None, {"inputs": inputs})[0]
        return found.T

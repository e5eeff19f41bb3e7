"""Lowering of Keras models to elementary operations.

The layers of `surrogate.architectures` and those standard layers in `_LOWERING` can be lowered. For any other layer, or
another setting of a layer, an error names the layer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from surrogate.network.graph import Graph, lstm_weights

if TYPE_CHECKING:
    import keras


class NotExportableError(ValueError):
    """The model has a layer that cannot be expressed in elementary operations."""


def lower(model: keras.Model) -> Graph:
    """Return a model of `surrogate.build` as a graph of elementary operations.

    Raises:
        NotExportableError: the class or a setting of a layer is not supported; the message names the layer.
    """
    graph = Graph()
    results: dict[str, str] = {}
    layers = {layer.name: layer for layer in model.layers}
    for entry in model.get_config()["layers"]:
        name, kind, nodes = entry["name"], entry["class_name"], entry["inbound_nodes"]
        if kind == "InputLayer":
            results[name] = name
            continue
        # Operations outside layers, such as those of `keras.ops`, and layers of users may have the same class names.
        if kind not in _LOWERING or name not in layers or _package(layers[name]) not in ("keras", "surrogate"):
            raise NotExportableError(f"Expected layers of the kinds {', '.join(_LOWERING)}. Received: {kind} {name!r}")
        if len(nodes) != 1 or _sources(nodes[0]["kwargs"]):
            raise NotExportableError(
                f"Expected every layer called once, on its inputs in their order. Received: {kind} {name!r}, called "
                f"{f'{len(nodes)} times' if len(nodes) != 1 else 'with named inputs'}"
            )
        if kind not in ("Dense", "Dropout") and len(_first_input(layers[name]).shape) != 3:
            raise NotExportableError(f"Expected {kind} on a sequence. Received: layer {name!r} on the Tabor parameter")
        inputs = [results[source] for source in _sources(nodes[0]["args"])]
        results[name] = _LOWERING[kind](graph, layers[name], inputs)
    return graph


def _package(layer: Any) -> str:
    return type(layer).__module__.partition(".")[0]


def _first_input(layer: Any) -> Any:
    return layer.input[0] if isinstance(layer.input, list | tuple) else layer.input


def _sources(arguments: Any) -> list[str]:
    """Names of the layers whose results a call received, from Keras's description of it."""
    if isinstance(arguments, dict) and arguments.get("class_name") == "__keras_tensor__":
        return [arguments["config"]["keras_history"][0]]
    nested = arguments.values() if isinstance(arguments, dict) else arguments
    return [name for item in nested if isinstance(item, dict | list | tuple) for name in _sources(item)]


def _array(variable: Any) -> np.ndarray:
    import keras

    return keras.ops.convert_to_numpy(variable)


def _bias(layer: Any, size: int) -> np.ndarray:
    return np.zeros(size) if layer.bias is None else _array(layer.bias)


def _activation(function: Any) -> str:
    return getattr(function, "__name__", type(function).__name__)


def _dense(graph: Graph, layer: Any, inputs: list[str], prefix: str = "") -> str:
    name = prefix + layer.name
    activation = _activation(layer.activation)
    if activation not in ("linear", "relu", "softmax"):
        raise NotExportableError(
            f"Expected a linear, relu or softmax activation. Received: {activation} in layer {name!r}"
        )
    kernel = _array(layer.kernel)
    result = graph.add("dense", name, inputs, {"kernel": kernel, "bias": _bias(layer, kernel.shape[-1])})
    return result if activation == "linear" else graph.add(activation, f"{name}/{activation}", [result])


def _lstm(graph: Graph, layer: Any, inputs: list[str]) -> str:
    standard = (_activation(layer.activation), _activation(layer.recurrent_activation)) == ("tanh", "sigmoid")
    unusual = layer.go_backwards or layer.stateful or layer.return_state
    if not (standard and layer.return_sequences and layer.use_bias) or unusual:
        raise NotExportableError(
            "Expected a forward LSTM of tanh and sigmoid with bias, returning sequences alone. "
            f"Received: layer {layer.name!r}"
        )
    cell = layer.cell
    weights = lstm_weights(*map(_array, (cell.kernel, cell.recurrent_kernel, cell.bias)))
    return graph.add("lstm", layer.name, inputs, weights)


def _normalise(graph: Graph, layer: Any, inputs: list[str], prefix: str = "") -> str:
    if layer.gamma is None or layer.beta is None or layer.rms_scaling or layer.axis not in (-1, 2, [-1], [2]):
        raise NotExportableError(
            f"Expected a normalisation of the last axis that scales and shifts. Received: layer {layer.name!r}"
        )
    weights = {"gamma": _array(layer.gamma), "beta": _array(layer.beta)}
    return graph.add("normalise", prefix + layer.name, inputs, weights, epsilon=float(layer.epsilon))


def _convolve(graph: Graph, layer: Any, inputs: list[str], prefix: str = "") -> str:
    activation = _activation(layer.activation)
    plain = layer.strides == (1,) and layer.groups == 1 and layer.data_format == "channels_last"
    causal = layer.padding == "causal" or layer.kernel_size == (1,)
    if not (plain and causal and activation in ("linear", "relu")):
        raise NotExportableError(
            f"Expected a causal convolution, linear or relu, of one group and stride. Received: layer {layer.name!r}"
        )
    name = prefix + layer.name
    weights = {"kernel": _array(layer.kernel).transpose(2, 1, 0), "bias": _bias(layer, layer.filters)}
    result = graph.add("convolve", name, inputs, weights, dilation=int(layer.dilation_rate[0]))
    return result if activation == "linear" else graph.add("relu", f"{name}/relu", [result])


def _append(graph: Graph, layer: Any, inputs: list[str]) -> str:
    return graph.add("append", layer.name, inputs)


def _add(graph: Graph, layer: Any, inputs: list[str]) -> str:
    shapes = [tuple(one.shape) for one in layer.input]
    if len(shapes) != 2 or shapes[0] != shapes[1]:
        raise NotExportableError(f"Expected a sum of two of one shape. Received: {shapes} in layer {layer.name!r}")
    return graph.add("add", layer.name, inputs)


def _dropout(_graph: Graph, _layer: Any, inputs: list[str]) -> str:
    """Return the input: dropout has no effect in prediction."""
    return inputs[0]


def _film(graph: Graph, layer: Any, inputs: list[str]) -> str:
    prefix = f"{layer.name}/"
    context = _dense(graph, layer.context, [inputs[1]], prefix)
    scale, shift = (_dense(graph, part, [context], prefix) for part in (layer.scale, layer.shift))
    return graph.add("modulate", layer.name, [inputs[0], scale, shift])


def _gate(graph: Graph, layer: Any, inputs: list[str]) -> str:
    prefix = f"{layer.name}/"
    context = _dense(graph, layer.context, [inputs[2]], prefix)
    return graph.add("mix", layer.name, [*inputs[:2], _dense(graph, layer.weighting, [context], prefix)])


def _tcn_block(graph: Graph, layer: Any, inputs: list[str]) -> str:
    prefix, hidden = f"{layer.name}/", inputs
    for convolution, normalisation in (
        (layer.first_convolution, layer.first_normalisation),
        (layer.second_convolution, layer.second_normalisation),
    ):
        normalised = _normalise(graph, normalisation, [_convolve(graph, convolution, hidden, prefix)], prefix)
        hidden = [graph.add("relu", f"{normalised}/relu", [normalised])]
    skip = inputs[0] if layer.projection is None else _convolve(graph, layer.projection, inputs, prefix)
    return graph.add("add", layer.name, [*hidden, skip])


def _encoder_block(graph: Graph, layer: Any, inputs: list[str]) -> str:
    prefix, attention = f"{layer.name}/", layer.attention
    weights = {}
    for key, part in zip(
        ("q", "k", "v", "out"),
        (attention.query_dense, attention.key_dense, attention.value_dense, attention.output_dense),
        strict=True,
    ):
        kernel, bias = _array(part.kernel), _array(part.bias)
        width = kernel.shape[-1] if key == "out" else kernel.shape[0]
        weights[f"kernel_{key}"] = kernel.reshape(-1, width) if key == "out" else kernel.reshape(width, -1)
        weights[f"bias_{key}"] = bias.reshape(-1)
    sizes = {"heads": layer.heads, "key_dim": layer.key_dim}
    attended = graph.add("attend", f"{prefix}attention", inputs, weights, **sizes)
    total = graph.add("add", f"{prefix}attention_sum", [inputs[0], attended])
    hidden = _normalise(graph, layer.attention_normalisation, [total], prefix)
    transformed = _dense(graph, layer.contract, [_dense(graph, layer.expand, [hidden], prefix)], prefix)
    total = graph.add("add", f"{prefix}output_sum", [hidden, transformed])
    return _normalise(graph, layer.output_normalisation, [total], prefix)


_LOWERING: dict[str, Callable[..., str]] = {
    "AppendTabor": _append,
    "Add": _add,
    "Conv1D": _convolve,
    "Dense": _dense,
    "Dropout": _dropout,
    "EncoderBlock": _encoder_block,
    "FiLM": _film,
    "LSTM": _lstm,
    "LayerNormalization": _normalise,
    "ResidualTCNBlock": _tcn_block,
    "TaborGate": _gate,
}

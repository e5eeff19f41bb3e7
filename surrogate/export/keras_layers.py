"""Layers of Keras as nodes of an ONNX graph.

The layers of `surrogate.architectures` and those standard layers in `_LAYERS` can be exported. For any other layer, or
another setting of a layer, an error names the layer. Sequences have the shape `(batch, steps, width)`, and values that
depend on the Tabor parameter alone `(batch, width)`. Each LSTM is one operator; its gates have the order i, o, f, c.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from surrogate.export.onnx_graph import OnnxGraph, Value

if TYPE_CHECKING:
    import keras


class NotExportableError(ValueError):
    """The model has a layer that cannot be expressed in ONNX."""


def add_network(
    graph: OnnxGraph, model: keras.Model, sequence: Value, tabor: Value | None, *, appended: bool = False
) -> Value:
    """Add a model of `surrogate.build` to a graph.

    Args:
        graph: The graph.
        model: The model.
        sequence: Its scaled channels, float32 of shape `(batch, steps, channels)`.
        tabor: The scaled Tabor parameter, float32 of shape `(batch, 1)`.
        appended: Whether the sequence has the Tabor parameter as its last channel already; `tabor` is then `None`.

    Returns:
        The scaled force, float32 of shape `(batch, steps, 1)`.

    Raises:
        NotExportableError: the class or a setting of a layer is not supported; the message names the layer.
        ValueError: a weight is not finite.
    """
    results = {"sequence": sequence, "tabor": tabor}
    layers = {layer.name: layer for layer in model.layers}
    for entry in model.get_config()["layers"]:
        name, kind, nodes = entry["name"], entry["class_name"], entry["inbound_nodes"]
        if kind == "InputLayer":
            continue
        # Operations outside layers, such as those of `keras.ops`, and layers of users may have the same class names.
        package = type(layers.get(name)).__module__.partition(".")[0]
        if kind not in _LAYERS or package not in ("keras", "surrogate"):
            raise NotExportableError(f"Expected layers of the kinds {', '.join(_LAYERS)}. Received: {kind} {name!r}")
        if len(nodes) != 1 or _sources(nodes[0]["kwargs"]):
            raise NotExportableError(
                f"Expected every layer called once, on its inputs in their order. Received: {kind} {name!r}, called "
                f"{f'{len(nodes)} times' if len(nodes) != 1 else 'with named inputs'}"
            )
        given = layers[name].input
        if (
            kind not in ("Dense", "Dropout", "Reshape")
            and len((given[0] if isinstance(given, list | tuple) else given).shape) != 3
        ):
            raise NotExportableError(f"Expected {kind} on a sequence. Received: layer {name!r} on the Tabor parameter")
        if bad := [weight.path for weight in layers[name].weights if not np.isfinite(_array(weight)).all()]:
            raise ValueError(f"Expected finite weights. Received: NaN or infinity in {bad[0]} of {model.name}")
        inputs = [results[source] for source in _sources(nodes[0]["args"])]
        told = appended and kind == "AppendTabor" and inputs[0] == sequence
        results[name] = sequence if told else _LAYERS[kind](graph, layers[name], inputs)
    return results[name]


def _unsupported(expected: str, layer: Any, received: str = "") -> NotExportableError:
    return NotExportableError(f"Expected {expected}. Received: {received}layer {layer.name!r}")


def _sources(arguments: Any) -> list[str]:
    """Names of the layers whose results a call received, from Keras's description of it."""
    if isinstance(arguments, dict) and arguments.get("class_name") == "__keras_tensor__":
        return [arguments["config"]["keras_history"][0]]
    nested = arguments.values() if isinstance(arguments, dict) else arguments
    return [name for item in nested if isinstance(item, dict | list | tuple) for name in _sources(item)]


def _array(variable: Any) -> np.ndarray:
    import keras

    return keras.ops.convert_to_numpy(variable)


def _activation(function: Any) -> str:
    return getattr(function, "__name__", type(function).__name__)


def _affine(graph: OnnxGraph, source: Value, name: str, kernel: np.ndarray, bias: np.ndarray, key: str = "") -> Value:
    return source @ graph.weight(f"{name}/kernel{key}", kernel) + graph.weight(f"{name}/bias{key}", bias)


def _bias(layer: Any, size: int) -> np.ndarray:
    return np.zeros(size) if layer.bias is None else _array(layer.bias)


def _dense(graph: OnnxGraph, layer: Any, inputs: list[Value], prefix: str = "") -> Value:
    name, activation = prefix + layer.name, _activation(layer.activation)
    if activation not in ("linear", "relu", "gelu", "softmax"):
        raise _unsupported("a linear, relu, gelu or softmax activation", layer, f"{activation} in ")
    kernel = _array(layer.kernel)
    result = _affine(graph, inputs[0], name, kernel, _bias(layer, kernel.shape[-1]))
    if activation == "relu":
        return graph.add("Relu", result)
    if activation == "gelu":
        half, one, root = (np.array(value, dtype=np.float32) for value in (0.5, 1.0, math.sqrt(0.5)))
        return result * half * (graph.add("Erf", result * root) + one)
    return graph.add("Softmax", result, axis=-1) if activation == "softmax" else result


def _lstm(graph: OnnxGraph, layer: Any, inputs: list[Value]) -> Value:
    standard = (_activation(layer.activation), _activation(layer.recurrent_activation)) == ("tanh", "sigmoid")
    unusual = layer.go_backwards or layer.stateful or layer.return_state
    if not (standard and layer.return_sequences and layer.use_bias) or unusual:
        raise _unsupported("a forward LSTM of tanh and sigmoid with bias, returning sequences alone", layer)
    units = layer.units
    # Keras has the order i, f, c, o.
    order = np.concatenate([np.arange(units) + units * block for block in (0, 3, 1, 2)])
    cell = layer.cell
    kernel, recurrent, bias = (_array(one)[..., order] for one in (cell.kernel, cell.recurrent_kernel, cell.bias))
    weights = {"W": kernel.T[None], "R": recurrent.T[None], "B": np.concatenate([bias, np.zeros_like(bias)])[None]}
    names = [graph.weight(f"{layer.name}/{key}", values) for key, values in weights.items()]
    hidden = graph.add("LSTM", inputs[0].turned(1, 0, 2), *names, hidden_size=units)
    return hidden.squeeze(1).turned(1, 0, 2)


def _normalise(graph: OnnxGraph, layer: Any, inputs: list[Value], prefix: str = "") -> Value:
    if layer.gamma is None or layer.beta is None or layer.rms_scaling or layer.axis not in (-1, 2, [-1], [2]):
        raise _unsupported("a normalisation of the last axis that scales and shifts", layer)
    name = prefix + layer.name
    weights = [graph.weight(f"{name}/{key}", _array(getattr(layer, key))) for key in ("gamma", "beta")]
    return graph.add("LayerNormalization", inputs[0], *weights, axis=-1, epsilon=float(layer.epsilon))


def _convolve(graph: OnnxGraph, layer: Any, inputs: list[Value], prefix: str = "") -> Value:
    activation = _activation(layer.activation)
    plain = layer.strides == (1,) and layer.groups == 1 and layer.data_format == "channels_last"
    causal = layer.padding == "causal" or layer.kernel_size == (1,)
    if not (plain and causal and activation in ("linear", "relu")):
        raise _unsupported("a causal convolution, linear or relu, of one group and stride", layer)
    name, dilation = prefix + layer.name, int(layer.dilation_rate[0])
    kernel = graph.weight(f"{name}/kernel", _array(layer.kernel).transpose(2, 1, 0))
    bias = graph.weight(f"{name}/bias", _bias(layer, layer.filters))
    past = (layer.kernel_size[0] - 1) * dilation
    convolved = graph.add("Conv", inputs[0].turned(0, 2, 1), kernel, bias, dilations=[dilation], pads=[past, 0])
    result = convolved.turned(0, 2, 1)
    return graph.add("Relu", result) if activation == "relu" else result


def _append(graph: OnnxGraph, _: Any, inputs: list[Value]) -> Value:
    sequence, tabor = inputs
    first = graph.add("Slice", sequence, [0], [1], [2])
    return graph.add("Concat", sequence, (first - first) + tabor.expand(1), axis=2)


def _choose(graph: OnnxGraph, layer: Any, inputs: list[Value]) -> Value:
    return graph.add("Reshape", inputs[0].pick(*layer.steps), [0, -1])


def _reshape(graph: OnnxGraph, layer: Any, inputs: list[Value]) -> Value:
    return graph.add("Reshape", inputs[0], [0, *layer.target_shape])


def _add(_: OnnxGraph, layer: Any, inputs: list[Value]) -> Value:
    shapes = [tuple(one.shape) for one in layer.input]
    if len(shapes) != 2 or shapes[0] != shapes[1]:
        raise _unsupported("a sum of two of one shape", layer, f"{shapes} in ")
    return inputs[0] + inputs[1]


def _film(graph: OnnxGraph, layer: Any, inputs: list[Value]) -> Value:
    prefix = f"{layer.name}/"
    context = _dense(graph, layer.context, [inputs[1]], prefix)
    scale, shift = (_dense(graph, part, [context], prefix).expand(1) for part in (layer.scale, layer.shift))
    return inputs[0] * scale + shift


def _gate(graph: OnnxGraph, layer: Any, inputs: list[Value]) -> Value:
    prefix = f"{layer.name}/"
    weights = _dense(graph, layer.weighting, [_dense(graph, layer.context, [inputs[2]], prefix)], prefix)
    first, second = (source * weights.pick(index).expand(1) for index, source in enumerate(inputs[:2]))
    return first + second


def _tcn_block(graph: OnnxGraph, layer: Any, inputs: list[Value]) -> Value:
    prefix, hidden = f"{layer.name}/", inputs
    for convolution, normalisation in (
        (layer.first_convolution, layer.first_normalisation),
        (layer.second_convolution, layer.second_normalisation),
    ):
        normalised = _normalise(graph, normalisation, [_convolve(graph, convolution, hidden, prefix)], prefix)
        hidden = [graph.add("Relu", normalised)]
    skip = inputs[0] if layer.projection is None else _convolve(graph, layer.projection, inputs, prefix)
    return hidden[0] + skip


def _encoder_block(graph: OnnxGraph, layer: Any, inputs: list[Value]) -> Value:
    prefix = f"{layer.name}/"
    total = inputs[0] + _attention(graph, layer, inputs[0], f"{prefix}attention")
    hidden = _normalise(graph, layer.attention_normalisation, [total], prefix)
    transformed = _dense(graph, layer.contract, [_dense(graph, layer.expand, [hidden], prefix)], prefix)
    return _normalise(graph, layer.output_normalisation, [hidden + transformed], prefix)


def _attention(graph: OnnxGraph, layer: Any, source: Value, name: str) -> Value:
    """Add the self-attention of an encoder block over all steps."""
    attention, heads, key_dim = layer.attention, layer.heads, layer.key_dim

    def split(key: str, part: Any, *axes: int) -> Value:
        kernel = _array(part.kernel)
        affine = _affine(graph, source, name, kernel.reshape(len(kernel), -1), _array(part.bias).reshape(-1), key)
        return graph.add("Reshape", affine, [0, 0, heads, key_dim]).turned(*axes)

    factor = np.array(1.0 / math.sqrt(key_dim), dtype=np.float32)
    query = split("_q", attention.query_dense, 0, 2, 1, 3) * factor
    scores = query @ split("_k", attention.key_dense, 0, 2, 3, 1)
    value = split("_v", attention.value_dense, 0, 2, 1, 3)
    joined = (graph.add("Softmax", scores, axis=-1) @ value).turned(0, 2, 1, 3)
    flat = graph.add("Reshape", joined, [0, 0, heads * key_dim])
    kernel = _array(attention.output_dense.kernel)
    return _affine(graph, flat, name, kernel.reshape(-1, kernel.shape[-1]), _array(attention.output_dense.bias), "_out")


_LAYERS: dict[str, Callable[..., Value]] = {
    "AppendTabor": _append,
    "Add": _add,
    "ChosenSteps": _choose,
    "Conv1D": _convolve,
    "Dense": _dense,
    "Dropout": lambda _graph, _layer, inputs: inputs[0],  # without effect in prediction
    "EncoderBlock": _encoder_block,
    "FiLM": _film,
    "LSTM": _lstm,
    "LayerNormalization": _normalise,
    "Reshape": _reshape,
    "ResidualTCNBlock": _tcn_block,
    "TaborGate": _gate,
}

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

from surrogate.onnx.graph import Value

if TYPE_CHECKING:
    import keras


class NotExportableError(ValueError):
    """The model has a layer that cannot be expressed in ONNX."""


def add_network(model: keras.Model, sequence: Value, tabor: Value) -> Value:
    """Add a model of `surrogate.build` to the graph of its inputs.

    Args:
        model: The model.
        sequence: Its scaled channels, float32 of shape `(batch, steps, channels)`.
        tabor: The scaled Tabor parameter, float32 of shape `(batch, 1)`.

    Returns:
        The scaled force, float32 of shape `(batch, steps, 1)`.

    Raises:
        NotExportableError: the class or a setting of a layer is not supported; the message names the layer.
    """
    results = {"sequence": sequence, "tabor": tabor}
    layers = {layer.name: layer for layer in model.layers}
    for entry in model.get_config()["layers"]:
        name, layer_class, nodes = entry["name"], entry["class_name"], entry["inbound_nodes"]
        if layer_class == "InputLayer":
            continue
        # Operations outside layers, such as those of `keras.ops`, and layers of users may have the same class names.
        package = type(layers.get(name)).__module__.partition(".")[0]
        if layer_class not in _LAYERS or package not in ("keras", "surrogate"):
            raise NotExportableError(
                f"layers must be of the kinds {', '.join(_LAYERS)}; received {layer_class} {name!r}"
            )
        arguments, options = nodes[0]["args"], nodes[0]["kwargs"].values()
        if len(nodes) != 1 or any(options) or any(value and not _sources([value]) for value in arguments):
            raise NotExportableError(
                f"layers must be called once, on their inputs in their order; received {layer_class} {name!r}, "
                f"called {f'{len(nodes)} times' if len(nodes) != 1 else 'with named inputs or options'}"
            )
        layer_input = layers[name].input
        if (
            layer_class not in ("Dense", "Dropout", "Reshape")
            and len((layer_input[0] if isinstance(layer_input, list | tuple) else layer_input).shape) != 3
        ):
            raise NotExportableError(
                f"{layer_class} must be on a sequence; received layer {name!r} on the Tabor parameter"
            )
        results[name] = _LAYERS[layer_class](layers[name], *(results[source] for source in _sources(arguments)))
    return results[name]


def _unsupported(expected: str, layer: Any, received: str = "") -> NotExportableError:
    return NotExportableError(f"layer {layer.name!r} must be {expected}; received {received or 'another'}")


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


def _affine(source: Value, name: str, kernel: np.ndarray, bias: np.ndarray, key: str = "") -> Value:
    graph = source.graph
    return source @ graph.weight(f"{name}/kernel{key}", kernel) + graph.weight(f"{name}/bias{key}", bias)


def _bias(layer: Any, size: int) -> np.ndarray:
    return np.zeros(size) if layer.bias is None else _array(layer.bias)


def _dense(layer: Any, source: Value) -> Value:
    activation, kernel = _activation(layer.activation), _array(layer.kernel)
    if activation not in ("linear", "relu", "gelu", "softmax"):
        raise _unsupported("a linear, relu, gelu or softmax activation", layer, activation)
    result = _affine(source, layer.path, kernel, _bias(layer, kernel.shape[-1]))
    if activation == "relu":
        return result.to("Relu")
    if activation == "gelu":
        half, unit, root = (np.array(value, dtype=np.float32) for value in (0.5, 1.0, math.sqrt(0.5)))
        return result * half * ((result * root).to("Erf") + unit)
    return result.to("Softmax", axis=-1) if activation == "softmax" else result


def _lstm(layer: Any, source: Value) -> Value:
    standard = (_activation(layer.activation), _activation(layer.recurrent_activation)) == ("tanh", "sigmoid")
    unusual = layer.go_backwards or layer.stateful or layer.return_state
    if not (standard and layer.return_sequences and layer.use_bias) or unusual:
        raise _unsupported("a forward LSTM of tanh and sigmoid with bias, returning sequences alone", layer)
    units, cell = layer.units, layer.cell
    # Keras has the order i, f, c, o.
    order = np.concatenate([np.arange(units) + units * block for block in (0, 3, 1, 2)])
    kernel, recurrent, bias = (_array(weight)[..., order] for weight in (cell.kernel, cell.recurrent_kernel, cell.bias))
    weights = {"W": kernel.T[None], "R": recurrent.T[None], "B": np.concatenate([bias, np.zeros_like(bias)])[None]}
    names = [source.graph.weight(f"{layer.path}/{key}", values) for key, values in weights.items()]
    return source.turned(1, 0, 2).to("LSTM", *names, hidden_size=units).squeeze(1).turned(1, 0, 2)


def _normalise(layer: Any, source: Value) -> Value:
    if layer.gamma is None or layer.beta is None or layer.rms_scaling or layer.axis not in (-1, 2, [-1], [2]):
        raise _unsupported("a normalisation of the last axis that scales and shifts", layer)
    weights = [source.graph.weight(f"{layer.path}/{key}", _array(getattr(layer, key))) for key in ("gamma", "beta")]
    return source.to("LayerNormalization", *weights, axis=-1, epsilon=float(layer.epsilon))


def _convolve(layer: Any, source: Value) -> Value:
    activation = _activation(layer.activation)
    plain = layer.strides == (1,) and layer.groups == 1 and layer.data_format == "channels_last"
    causal = layer.padding == "causal" or layer.kernel_size == (1,)
    if not (plain and causal and activation in ("linear", "relu")):
        raise _unsupported("a causal convolution, linear or relu, of one group and stride", layer)
    kernel = source.graph.weight(f"{layer.path}/kernel", _array(layer.kernel).transpose(2, 1, 0))
    bias = source.graph.weight(f"{layer.path}/bias", _bias(layer, layer.filters))
    dilation = int(layer.dilation_rate[0])
    past = (layer.kernel_size[0] - 1) * dilation
    result = source.turned(0, 2, 1).to("Conv", kernel, bias, dilations=[dilation], pads=[past, 0]).turned(0, 2, 1)
    return result.to("Relu") if activation == "relu" else result


def _append(_: Any, sequence: Value, tabor: Value) -> Value:
    first = sequence.to("Slice", [0], [1], [2])
    return sequence.to("Concat", (first - first) + tabor.expand(1), axis=2)


def _add(layer: Any, *inputs: Value) -> Value:
    shapes = [tuple(tensor.shape) for tensor in layer.input]
    if len(shapes) != 2 or shapes[0] != shapes[1]:
        raise _unsupported("a sum of two of one shape", layer, str(shapes))
    return inputs[0] + inputs[1]


def _film(layer: Any, sequence: Value, tabor: Value) -> Value:
    context = _dense(layer.context, tabor)
    scale, shift = (_dense(dense, context).expand(1) for dense in (layer.scale, layer.shift))
    return sequence * scale + shift


def _gate(layer: Any, first: Value, second: Value, tabor: Value) -> Value:
    weights = _dense(layer.weighting, _dense(layer.context, tabor))
    first, second = (source * weights.pick(index).expand(1) for index, source in enumerate((first, second)))
    return first + second


def _relu(layer: Any, source: Value) -> Value:
    if layer.max_value is not None or layer.negative_slope or layer.threshold:
        raise _unsupported("a ReLU without options", layer)
    return source.to("Relu")


def _attention(layer: Any, *inputs: Value) -> Value:
    """Add the attention of a sequence to itself, over all steps."""
    config, name = layer.get_config(), layer.path
    if [value.name for value in inputs] != [inputs[0].name] * 2 or not config["use_bias"] or config["output_shape"]:
        raise _unsupported("the attention of one sequence to itself, with bias, to the width of its input", layer)

    def split(key: str, projection: Any, *axes: int) -> Value:
        kernel, bias = _array(projection.kernel), _array(projection.bias)
        affine = _affine(inputs[0], name, kernel.reshape(len(kernel), -1), bias.reshape(-1), key)
        return affine.to("Reshape", [0, 0, *bias.shape]).turned(*axes)

    factor = np.array(1.0 / math.sqrt(config["key_dim"]), dtype=np.float32)
    scores = split("_q", layer.query_dense, 0, 2, 1, 3) * factor @ split("_k", layer.key_dense, 0, 2, 3, 1)
    value = split("_v", layer.value_dense, 0, 2, 1, 3)
    joined = (scores.to("Softmax", axis=-1) @ value).turned(0, 2, 1, 3)
    kernel = _array(layer.output_dense.kernel)
    flat = joined.to("Reshape", [0, 0, math.prod(kernel.shape[:2])])
    return _affine(flat, name, kernel.reshape(-1, kernel.shape[-1]), _array(layer.output_dense.bias), "_out")


_LAYERS: dict[str, Callable[..., Value]] = {
    "AppendTabor": _append,
    "Add": _add,
    "Conv1D": _convolve,
    "Dense": _dense,
    "Dropout": lambda _, source: source,  # without effect in prediction
    "FiLM": _film,
    "LSTM": _lstm,
    "LayerNormalization": _normalise,
    "MultiHeadAttention": _attention,
    "ReLU": _relu,
    "Reshape": lambda layer, source: source.to("Reshape", [0, *layer.target_shape]),
    "TaborGate": _gate,
}
"""From a layer and its inputs to its result."""

"""Construction of ONNX graphs: a builder, and one emitter for each elementary operation.

An emitter takes the builder, an operation of `surrogate.network.graph` and the names of its inputs. It adds the nodes
of the operation and returns the name of the result.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from surrogate.network.graph import Operation


class OnnxGraph:
    """Builder of an ONNX graph. Each method adds nodes or a constant, and returns the name of the result."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.initializers: dict[str, np.ndarray] = {}

    def add(self, kind: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        """Append a node."""
        output = output or f"{kind}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, inputs, [output], name=output, **attributes))
        return output

    def constant(self, values: np.ndarray) -> str:
        """Add an array as a constant; equal arrays share one name."""
        for name, known in self.initializers.items():
            if known.dtype == values.dtype and known.shape == values.shape and np.array_equal(known, values):
                return name
        name = f"constant_{len(self.initializers)}"
        self.initializers[name] = values
        return name

    def number(self, value: float) -> str:
        """Add a float64 number."""
        return self.constant(np.array(value, dtype=np.float64))

    def integers(self, values: list[int] | int) -> str:
        """Add a vector of integers, or one integer without dimensions."""
        return self.constant(np.array(values, dtype=np.int64))

    def cast(self, source: str, to: int) -> str:
        """Convert to another type, of `onnx.TensorProto`."""
        return self.add("Cast", source, to=to)

    def symlog(self, source: str) -> str:
        """Compute sign(x) log(1 + |x|)."""
        size = self.add("Log", self.add("Add", self.add("Abs", source), self.number(1.0)))
        return self.add("Mul", self.add("Sign", source), size)

    def symexp(self, source: str, output: str) -> str:
        """Compute sign(y) (exp(|y|) - 1)."""
        size = self.add("Sub", self.add("Exp", self.add("Abs", source)), self.number(1.0))
        return self.add("Mul", self.add("Sign", source), size, output=output)

    def standardise(self, source: str, mean: np.ndarray, deviation: np.ndarray) -> str:
        """Subtract the mean and divide by the standard deviation."""
        return self.add("Div", self.add("Sub", source, self.constant(mean)), self.constant(deviation))

    def slope(self, values: str) -> str:
        """Compute the backward difference over time along the steps; the first value is zero."""
        quotient = self.add("Div", self.rise(values), self.rise("times"))
        return self.add("Pad", quotient, self.integers([0, 1, 0, 0]))

    def rise(self, values: str) -> str:
        """Compute the differences of neighbours along the steps, of which there is one less."""
        one, minus_one, zero, far = (self.integers([bound]) for bound in (1, -1, 0, np.iinfo(np.int64).max))
        later, earlier = self.add("Slice", values, one, far, one), self.add("Slice", values, zero, minus_one, one)
        return self.add("Sub", later, earlier)

    def log_step(self) -> str:
        """Logarithm of the time since the step before, zero at the first."""
        return self.add("Pad", self.add("Log", self.rise("times")), self.integers([0, 1, 0, 0]))

    def scan(self, body: onnx.GraphProto, start: str, *sources: str, axis: int) -> str:
        """Run `body` along an axis of the sources, from the state `start`, and stack its results along this axis."""
        name, count = f"Scan_{len(self.nodes)}", len(sources)
        axes = {"num_scan_inputs": count, "scan_input_axes": [axis] * count, "scan_output_axes": [axis]}
        node = helper.make_node("Scan", [start, *sources], [f"{name}_last", name], name=name, body=body, **axes)
        self.nodes.append(node)
        return name

    def unscaled_force(self, scaled: str, moments: tuple[float, float]) -> None:
        """Add the output `force` from the scaled force, float32, and its mean and standard deviation."""
        mean, deviation = moments
        product = self.add("Mul", self.cast(scaled, TensorProto.DOUBLE), self.number(deviation))
        self.symexp(self.add("Add", product, self.number(mean)), "force")

    def finish(self, name: str, more: dict[str, list[str]] | None = None) -> onnx.GraphProto:
        """Return the ONNX graph with the physical inputs and output, and `more` inputs by name with their shapes."""
        matrix = ["batch", "steps"]
        shapes = {"times": matrix, "indentations": matrix, "tabor": ["batch"], "edge": matrix} | (more or {})
        inputs = [helper.make_tensor_value_info(key, TensorProto.DOUBLE, shape) for key, shape in shapes.items()]
        output = helper.make_tensor_value_info("force", TensorProto.DOUBLE, matrix)
        constants = [numpy_helper.from_array(values, key) for key, values in self.initializers.items()]
        return helper.make_graph(self.nodes, name, inputs, [output], initializer=constants)


def _emit_append(graph: OnnxGraph, _: Operation, inputs: list[str]) -> str:
    sequence, tabor = inputs
    first = graph.add("Slice", sequence, graph.integers([0]), graph.integers([1]), graph.integers([2]))
    nothing = graph.add("Sub", first, first)
    return graph.add(
        "Concat", sequence, graph.add("Add", nothing, graph.add("Unsqueeze", tabor, graph.integers([1]))), axis=2
    )


def _emit_dense(graph: OnnxGraph, operation: Operation, inputs: list[str]) -> str:
    product = graph.add("MatMul", inputs[0], f"{operation.name}/kernel")
    return graph.add("Add", product, f"{operation.name}/bias")


def _emit_lstm(graph: OnnxGraph, operation: Operation, inputs: list[str]) -> str:
    units = graph.initializers[f"{operation.name}/R"].shape[-1]
    steps_first = graph.add("Transpose", inputs[0], perm=[1, 0, 2])
    weights = [f"{operation.name}/{key}" for key in ("W", "R", "B")]
    hidden = graph.add("LSTM", steps_first, *weights, hidden_size=units)
    return graph.add("Transpose", graph.add("Squeeze", hidden, graph.integers([1])), perm=[1, 0, 2])


def _emit_normalise(graph: OnnxGraph, operation: Operation, inputs: list[str]) -> str:
    weights = [f"{operation.name}/{key}" for key in ("gamma", "beta")]
    return graph.add("LayerNormalization", inputs[0], *weights, axis=-1, epsilon=operation.options["epsilon"])


def _emit_convolve(graph: OnnxGraph, operation: Operation, inputs: list[str]) -> str:
    dilation = operation.options["dilation"]
    reach = (graph.initializers[f"{operation.name}/kernel"].shape[-1] - 1) * dilation
    weights = [f"{operation.name}/{key}" for key in ("kernel", "bias")]
    channels_first = graph.add("Transpose", inputs[0], perm=[0, 2, 1])
    convolved = graph.add("Conv", channels_first, *weights, dilations=[dilation], pads=[reach, 0])
    return graph.add("Transpose", convolved, perm=[0, 2, 1])


def _emit_modulate(graph: OnnxGraph, _: Operation, inputs: list[str]) -> str:
    scale, shift = (graph.add("Unsqueeze", part, graph.integers([1])) for part in inputs[1:])
    return graph.add("Add", graph.add("Mul", inputs[0], scale), shift)


def _emit_mix(graph: OnnxGraph, _: Operation, inputs: list[str]) -> str:
    terms = []
    for index, source in enumerate(inputs[:2]):
        weight = graph.add("Gather", inputs[2], graph.integers([index]), axis=1)
        terms.append(graph.add("Mul", source, graph.add("Unsqueeze", weight, graph.integers([1]))))
    return graph.add("Add", *terms)


def _emit_attend(graph: OnnxGraph, operation: Operation, inputs: list[str]) -> str:
    heads, key_dim = operation.options["heads"], operation.options["key_dim"]

    def affine(source: str, key: str) -> str:
        product = graph.add("MatMul", source, f"{operation.name}/kernel_{key}")
        return graph.add("Add", product, f"{operation.name}/bias_{key}")

    def split(key: str, perm: list[int]) -> str:
        apart = graph.add("Reshape", affine(inputs[0], key), graph.integers([0, 0, heads, key_dim]))
        return graph.add("Transpose", apart, perm=perm)

    factor = graph.constant(np.array(1.0 / math.sqrt(key_dim), dtype=np.float32))
    scores = graph.add("MatMul", graph.add("Mul", split("q", [0, 2, 1, 3]), factor), split("k", [0, 2, 3, 1]))
    attended = graph.add("MatMul", graph.add("Softmax", scores, axis=-1), split("v", [0, 2, 1, 3]))
    joined = graph.add("Transpose", attended, perm=[0, 2, 1, 3])
    return affine(graph.add("Reshape", joined, graph.integers([0, 0, heads * key_dim])), "out")


EMITTERS: dict[str, Callable[[OnnxGraph, Operation, list[str]], str]] = {
    "add": lambda graph, _, inputs: graph.add("Add", *inputs),
    "append": _emit_append,
    "attend": _emit_attend,
    "convolve": _emit_convolve,
    "dense": _emit_dense,
    "lstm": _emit_lstm,
    "mix": _emit_mix,
    "modulate": _emit_modulate,
    "normalise": _emit_normalise,
    "relu": lambda graph, _, inputs: graph.add("Relu", *inputs),
    "softmax": lambda graph, _, inputs: graph.add("Softmax", *inputs, axis=-1),
}

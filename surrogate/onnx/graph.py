"""Construction of ONNX graphs, node by node, or by the signs of arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def _sign(operator: str) -> tuple[Callable[..., Value], Callable[..., Value]]:
    """Return the method of an operator, and that for a value on its right."""
    return (
        lambda left, right: left.graph.add(operator, left, right),
        lambda right, left: right.graph.add(operator, left, right),
    )


class Value:
    """A result in a graph. Signs of arithmetic combine it with others, with numbers and with arrays."""

    __array_ufunc__ = None  # an array on the left leaves the operation to this class
    __add__, __radd__ = _sign("Add")
    __sub__, __rsub__ = _sign("Sub")
    __mul__, __rmul__ = _sign("Mul")
    __truediv__, __rtruediv__ = _sign("Div")
    __matmul__, _ = _sign("MatMul")

    def __init__(self, graph: OnnxGraph, name: str) -> None:
        self.graph, self.name = graph, name

    def to(self, operator: str, *operands: Operand, output: str = "", **attributes: Any) -> Value:
        """Append a node whose first input this is; see `OnnxGraph.add`."""
        return self.graph.add(operator, self, *operands, output=output, **attributes)

    def cast(self, to: int) -> Value:
        """Convert to another type, of `onnx.TensorProto`."""
        return self.to("Cast", to=to)

    def expand(self, *axes: int) -> Value:
        """Insert axes of length one."""
        return self.to("Unsqueeze", [*axes])

    def squeeze(self, *axes: int) -> Value:
        """Remove axes of length one."""
        return self.to("Squeeze", [*axes])

    def turned(self, *axes: int) -> Value:
        """Put the axes into another order."""
        return self.to("Transpose", perm=[*axes])

    def pick(self, *columns: int) -> Value:
        """Take some columns of a matrix."""
        return self.to("Gather", [*columns], axis=1)

    def rise(self) -> Value:
        """Compute the differences of neighbours along the steps, of which there is one less."""
        return self.to("Slice", [1], [np.iinfo(np.int64).max], [1]) - self.to("Slice", [0], [-1], [1])

    def after_zero(self) -> Value:
        """Put a zero before the values along the steps."""
        return self.to("Pad", [0, 1, 0, 0])

    def symlog(self) -> Value:
        """Compute sign(x) log(1 + |x|)."""
        size = (self.to("Abs") + 1.0).to("Log")
        return self.to("Sign") * size

    def symexp(self, output: str) -> Value:
        """Compute sign(y) (exp(|y|) - 1)."""
        size = self.to("Abs").to("Exp") - 1.0
        return self.to("Sign").to("Mul", size, output=output)


Operand = Value | float | list[int] | np.ndarray
"""An input of a node: integers become a tensor of int64, other numbers one of float64."""


class OnnxGraph:
    """Builder of an ONNX graph. Each method adds nodes or a constant, and returns the result."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.initializers: dict[str, np.ndarray] = {}
        self._results: dict[tuple[Any, ...], Value] = {}

    def named(self, name: str) -> Value:
        """Return an input, or what has got this name otherwise."""
        return Value(self, name)

    def add(self, operator: str, *inputs: Operand, output: str = "", **attributes: Any) -> Value:
        """Append a node, or return the result of an equal one."""
        names = [self._constant(operand) if not isinstance(operand, Value) else operand.name for operand in inputs]
        key = (operator, *names, output, repr(attributes))
        if key not in self._results:
            output = output or f"{operator}_{len(self.nodes)}"
            self.nodes.append(helper.make_node(operator, names, [output], name=output, **attributes))
            self._results[key] = Value(self, output)
        return self._results[key]

    def weight(self, name: str, values: np.ndarray) -> Value:
        """Add the weights of a network, converted to float32, under a name, or a new one if another network has it."""
        name = f"{name}_{len(self.initializers)}" if name in self.initializers else name
        self.initializers[name] = np.ascontiguousarray(values, dtype=np.float32)
        return Value(self, name)

    def scan(self, body: str, start: Value, source: Value) -> Value:
        """Run a graph in ONNX's text form along the steps of a source, from a state, and stack its results."""
        name, names = f"Scan_{len(self.nodes)}", [start.name, source.name]
        axes = {"num_scan_inputs": 1, "scan_input_axes": [1], "scan_output_axes": [1]}
        step, outputs = onnx.parser.parse_graph(body), [f"{name}_last", name]
        self.nodes.append(helper.make_node("Scan", names, outputs, name=name, body=step, **axes))
        return Value(self, name)

    def finish(self, name: str, inputs: Mapping[str, list[Any]], outputs: Mapping[str, list[Any]]) -> onnx.GraphProto:
        """Return the ONNX graph with inputs and outputs of float64, by name with their shapes."""
        input_infos, output_infos = (
            [helper.make_tensor_value_info(key, TensorProto.DOUBLE, shape) for key, shape in ends.items()]
            for ends in (inputs, outputs)
        )
        constants = [numpy_helper.from_array(values, key) for key, values in self.initializers.items()]
        return helper.make_graph(self.nodes, name, input_infos, output_infos, initializer=constants)

    def _constant(self, operand: float | list[int] | np.ndarray) -> str:
        """Add a constant; equal ones share one name."""
        integer = isinstance(operand, int | list)
        values = np.array(operand, dtype=np.int64) if integer else np.asarray(operand)
        for name, constant in self.initializers.items():
            if constant.dtype == values.dtype and constant.shape == values.shape and np.array_equal(constant, values):
                return name
        name = f"constant_{len(self.initializers)}"
        self.initializers[name] = values
        return name

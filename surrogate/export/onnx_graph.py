"""Construction of ONNX graphs, node by node."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


class OnnxGraph:
    """Builder of an ONNX graph. Each method adds nodes or a constant, and returns the name of the result."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.initializers: dict[str, np.ndarray] = {}
        self._results: dict[tuple[Any, ...], str] = {}

    def add(self, kind: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        """Append a node, or return the result of an equal one."""
        key = (kind, inputs, output, repr(attributes))
        if key not in self._results:
            self._results[key] = output = output or f"{kind}_{len(self.nodes)}"
            self.nodes.append(helper.make_node(kind, inputs, [output], name=output, **attributes))
        return self._results[key]

    def constant(self, values: np.ndarray) -> str:
        """Add an array as a constant; equal arrays share one name."""
        for name, known in self.initializers.items():
            if known.dtype == values.dtype and known.shape == values.shape and np.array_equal(known, values):
                return name
        name = f"constant_{len(self.initializers)}"
        self.initializers[name] = values
        return name

    def weight(self, name: str, values: np.ndarray) -> str:
        """Add the weights of a network, converted to float32, under a name."""
        self.initializers[name] = np.ascontiguousarray(values, dtype=np.float32)
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
        return self.after_zero(self.add("Div", self.rise(values), self.rise("times")))

    def after_zero(self, values: str) -> str:
        """Put a zero before the values along the steps."""
        return self.add("Pad", values, self.integers([0, 1, 0, 0]))

    def rise(self, values: str) -> str:
        """Compute the differences of neighbours along the steps, of which there is one less."""
        one, minus_one, zero, far = (self.integers([bound]) for bound in (1, -1, 0, np.iinfo(np.int64).max))
        later, earlier = self.add("Slice", values, one, far, one), self.add("Slice", values, zero, minus_one, one)
        return self.add("Sub", later, earlier)

    def scan(self, body: str, start: str, *sources: str, axis: int) -> str:
        """Run a graph in ONNX's text form along an axis of sources, from a state, and stack its results along it."""
        key, count = ("Scan", body, start, sources, axis), len(sources)
        if key not in self._results:
            name = self._results[key] = f"Scan_{len(self.nodes)}"
            axes = {"num_scan_inputs": count, "scan_input_axes": [axis] * count, "scan_output_axes": [axis]}
            step, outputs = onnx.parser.parse_graph(body), [f"{name}_last", name]
            self.nodes.append(helper.make_node("Scan", [start, *sources], outputs, name=name, body=step, **axes))
        return self._results[key]

    def unscaled_force(self, scaled: str, moments: tuple[float, float]) -> None:
        """Add the output `force` from the scaled force, float32, and its mean and standard deviation."""
        mean, deviation = moments
        product = self.add("Mul", self.cast(scaled, TensorProto.DOUBLE), self.number(deviation))
        self.symexp(self.add("Add", product, self.number(mean)), "force")

    def finish(self, name: str, inputs: dict[str, list[Any]], output: list[Any], kind: int = TensorProto.DOUBLE) -> Any:
        """Return the ONNX graph with inputs by name with their shapes, and the output `force`, of one type."""
        given = [helper.make_tensor_value_info(key, kind, shape) for key, shape in inputs.items()]
        found = helper.make_tensor_value_info("force", kind, output)
        constants = [numpy_helper.from_array(values, key) for key, values in self.initializers.items()]
        return helper.make_graph(self.nodes, name, given, [found], initializer=constants)

"""A network as an ONNX graph of one time step, whose states are inputs and outputs.

It is what ONNX Runtime offers instead of `surrogate.inference.streaming.Stream`, and is built here only to be compared
with it (`experiments.surrogates.streaming_cost`). The graph is as short as we could write it: the hidden state of an
LSTM is its result, a convolution is one product of a matrix with the window of its last inputs, all channels pass
`symlog` together, and results that depend on the Tabor parameter and the modulus ratio only are constants.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from onnx import TensorProto, helper, numpy_helper

from surrogate.data.features import PHYSICS, channel_names
from surrogate.data.scaling import SYMLOG_PASSES, Scaling
from surrogate.export.onnx_graph import EMITTERS, OnnxGraph
from surrogate.network.graph import SEQUENCE, TABOR, Graph, Operation
from surrogate.network.onnx_file import checked_model

INPUT, FORCE = "inputs", "force"
TIME, INDENTATION, HERTZ, MEMORIES = "motion/time", "motion/indentation", "motion/hertz", "motion/memories"
"""States of the features, those of the point before: float64 of shape `(1, 1, 1)`, the memories `(1, 1, 3)`."""


@dataclass(frozen=True)
class Solid:
    """What does not change during a history: Tabor parameter, and modulus ratio for the inputs F."""

    tabor: float
    modulus_ratio: float | None = None


def step_model(network: Graph, scaling: Scaling, solid: Solid, *, features: bool) -> bytes:
    """Return the ONNX file of one step of a causal network.

    With `features`, `inputs` are time, indentation and edge, float64 of shape `(1, 1, 3)`, and `force` is the physical
    force, float64. The time before the first step is minus one, and the indentation that of the first step; the history
    begins at time zero out of contact. Without, `inputs` are the scaled channels and, where the network appends it to
    them, the scaled Tabor parameter, float32 of shape `(1, 1, width)`, and `force` is the scaled force, float32. Each
    state has an output of its name and `/next`. Other states begin at zero.

    Raises:
        ValueError: a convolution is dilated, or the features need the acceleration.
    """
    step = _Step(network, scaling, solid)
    if features:
        source = step.features()
    else:
        source, step.taken[INPUT] = INPUT, np.zeros((1, 1, step.width), dtype=np.float32)
    scaled = step.network(source)
    if features:
        step.graph.unscaled_force(scaled, scaling.force)
    else:
        step.graph.add("Identity", scaled, output=FORCE)
    states = {f"{name}/next": values for name, values in step.taken.items() if name != INPUT}
    force = np.zeros((1, 1, 1), dtype=np.float64 if features else np.float32)
    return _file(step.graph, step.taken, {FORCE: force, **states})


def empty_model(width: int) -> bytes:
    """Return the ONNX file of a graph that computes nothing: it shows what a call costs by itself."""
    graph, values = OnnxGraph(), np.zeros((1, 1, width), dtype=np.float32)
    graph.add("Identity", INPUT, output=FORCE)
    return _file(graph, {INPUT: values}, {FORCE: values})


def _file(graph: OnnxGraph, taken: dict[str, np.ndarray], given: dict[str, np.ndarray]) -> bytes:
    inputs, outputs = (
        [
            helper.make_tensor_value_info(name, helper.np_dtype_to_tensor_dtype(values.dtype), values.shape)
            for name, values in ends.items()
        ]
        for ends in (taken, given)
    )
    stored = [numpy_helper.from_array(values, name) for name, values in graph.initializers.items()]
    content = checked_model(helper.make_graph(graph.nodes, "step", inputs, outputs, initializer=stored))
    return bytes(content.SerializeToString(deterministic=True))


class _Step:
    """Builder of the graph of one step; `taken` holds an array like each input by its name."""

    def __init__(self, network: Graph, scaling: Scaling, solid: Solid) -> None:
        self.graph = OnnxGraph()
        self.graph.initializers |= network.weights
        self.taken: dict[str, np.ndarray] = {}
        self._network, self._scaling, self._solid = network, scaling, solid
        self._tabor = scaling.scale_tabor(np.array([solid.tabor]))
        self._appended = any(one.kind == "append" and one.inputs[0] == SEQUENCE for one in network.operations)
        self.width = len(channel_names(scaling.features)) + self._appended

    def network(self, source: str) -> str:
        """Add the network and return the name of the scaled force."""
        results = {SEQUENCE: source, TABOR: self.graph.constant(self._tabor)}
        for operation in self._network.operations:
            inputs = [results[one] for one in operation.inputs]
            results[operation.name] = self._added(operation, inputs, source)
        return results[self._network.output]

    def _added(self, operation: Operation, inputs: list[str], source: str) -> str:
        if operation.kind == "append" and inputs[0] == source:
            return source  # the Tabor parameter is in it already
        if operation.kind == "lstm":
            return self._lstm(operation.name, inputs[0])
        if operation.kind == "convolve":
            if operation.options["dilation"] != 1:
                raise ValueError(
                    "Expected convolutions without dilation. "
                    f"Received: {operation.name!r} of dilation {operation.options['dilation']}"
                )
            return self._convolution(operation.name, inputs[0])
        return EMITTERS[operation.kind](self.graph, operation, inputs)

    def _lstm(self, name: str, source: str) -> str:
        units = self.graph.initializers[f"{name}/R"].shape[-1]
        hidden, cell = (self._state(f"{name}/{state}", units, np.float32) for state in ("hidden", "cell"))
        inputs = [source, *(f"{name}/{key}" for key in "WRB"), "", hidden, cell]
        outputs = ["", f"{hidden}/next", f"{cell}/next"]
        self.graph.nodes.append(helper.make_node("LSTM", inputs, outputs, hidden_size=units))
        return f"{hidden}/next"

    def _convolution(self, name: str, source: str) -> str:
        kernel = self.graph.initializers[f"{name}/kernel"]
        out, width, points = kernel.shape
        window = self._state(f"{name}/window", (points - 1) * width, np.float32)
        seen = self.graph.add("Concat", window, source, axis=2)
        bounds = ([width], [points * width], [2])
        self.graph.add("Slice", seen, *map(self.graph.integers, bounds), output=f"{window}/next")
        self.graph.initializers[f"{name}/kernel"] = kernel.transpose(2, 1, 0).reshape(points * width, out)
        return self.graph.add("Add", self.graph.add("MatMul", seen, f"{name}/kernel"), f"{name}/bias")

    def _state(self, name: str, width: int, kind: type = np.float64) -> str:
        self.taken[name] = np.zeros((1, 1, width), dtype=kind)
        return name

    def features(self) -> str:
        """Add the scaled channels, and the scaled Tabor parameter if it is appended, from the new point."""
        graph, names = self.graph, list(channel_names(self._scaling.features))
        self.taken[INPUT] = np.zeros((1, 1, 3))
        time, depth = self._state(TIME, 1), self._state(INDENTATION, 1)
        point = [f"{time}/next", f"{depth}/next", "edge"]
        graph.nodes.append(helper.make_node("Split", [INPUT], point, axis=2))
        duration, change = graph.add("Sub", point[0], time), graph.add("Sub", point[1], depth)
        raw = dict(zip(("time", "indentation", "edge"), point, strict=True))
        raw["velocity"] = graph.add("Div", change, duration)
        if not set(names) <= {*raw}:
            if "acceleration" in names:
                raise ValueError(f"Expected features without acceleration. Received: {self._scaling.features}")
            raw["log_step"] = graph.add("Log", duration)
            if PHYSICS[0] in names:
                raw |= self._physics(point[1], duration, change, raw["velocity"])
        mean, scale = dict(zip(names, self._scaling.channel_mean, strict=True)), self._scaling.channel_scale
        deviation = dict(zip(names, scale, strict=True))
        ordered = sorted(names, key=lambda name: -SYMLOG_PASSES[name])
        vector: list[str] = []
        for passes in (2, 1, 0):
            parts = [raw[name] for name in ordered if SYMLOG_PASSES[name] == passes]
            if passes == 0 and self._appended:
                parts.append(graph.constant(self._tabor.astype(np.float64).reshape(1, 1, 1)))
            whole = [*vector, *parts]
            joined = graph.add("Concat", *whole, axis=2) if len(whole) > 1 else whole[0]
            vector = [graph.symlog(joined) if passes else joined]
        moments = [np.array([one[name] for name in ordered]) for one in (mean, deviation)]
        order = [ordered.index(name) for name in names]
        if self._appended:
            moments = [np.append(moments[0], 0.0), np.append(moments[1], 1.0)]
            order.append(len(names))
        scaled = graph.cast(graph.standardise(vector[0], *moments), TensorProto.FLOAT)
        return graph.add("Gather", scaled, graph.integers(order), axis=2)

    def _physics(self, indentation: str, duration: str, change: str, velocity: str) -> dict[str, str]:
        """Add the channels of F that depend on the solid, as `surrogate.network.kernels` computes them."""
        graph, ratio = self.graph, self._solid.modulus_ratio
        if ratio is None:
            raise ValueError("Expected a modulus ratio for features F. Received: none")
        size = graph.number(-4.0 / (3.0 * math.pi) * self._solid.tabor**-1.5)
        pressed = graph.add("Max", indentation, graph.number(0.0))
        power = graph.add("Mul", pressed, graph.add("Sqrt", pressed))
        before, memories = self._state(HERTZ, 1), self._state(MEMORIES, 3)
        hertz = graph.add("Mul", power, size, output=f"{before}/next")
        rates = graph.constant(np.array([[[-1.0 / ratio, -1.0 / ratio, -1.0]]]))
        exponents = graph.add("Mul", duration, rates)
        gone = graph.add("Sub", graph.add("Exp", exponents), graph.number(1.0))
        rises = graph.add("Concat", graph.add("Sub", hertz, before), change, change, axis=2)
        gains = graph.add("Mul", graph.add("Div", gone, exponents), rises)
        kept = graph.add("Add", memories, graph.add("Mul", gone, memories))
        after = graph.add("Add", kept, gains, output=f"{memories}/next")
        split = ["memory", *PHYSICS[2:]]
        graph.nodes.append(helper.make_node("Split", [after], split, axis=2))
        lost = graph.add("Mul", split[0], graph.number(1.0 / ratio - 1.0))
        flags = {
            name: graph.cast(graph.add(kind, velocity, graph.number(0.0)), TensorProto.DOUBLE)
            for name, kind in (("loading", "Greater"), ("unloading", "Less"))
        }
        logarithm = graph.constant(np.full((1, 1, 1), math.log(ratio)))
        return flags | {
            "lee_radok": graph.add("Add", hertz, lost),
            "hertz": hertz,
            **{name: name for name in PHYSICS[2:]},
            "log_modulus_ratio": logarithm,
        }

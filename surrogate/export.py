"""Trained models as ONNX files that take physical inputs and return physical forces.

Features, scaling and network are one graph, so the file alone is enough. Inputs, all float64: `times`, `indentations`
and `edge` of shape `(batch, steps)`, `tabor` of shape `(batch,)`; output: `force` of shape `(batch, steps)`, float64.
`edge` is one at the first and last point of the dwell and zero elsewhere. Differences of large times cancel, so
everything before the network and after it is float64; the network itself is float32, each LSTM one ONNX operator.

The file's metadata say whose it is: `format`, `format_version`, `name`, `architecture`, `features`, `ranges` (JSON,
smallest and largest training value of each protocol quantity), `scaling` (JSON), `plan` (JSON, see `surrogate.plan`),
`dataset_sha256` and `weights_sha256` (of `model.weights.h5`).
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from surrogate.backends import ONNX_FORMAT, ONNX_FORMAT_VERSION, ONNX_NAME, keras_model
from surrogate.features import ACCELERATION_SMOOTHING, channel_names
from surrogate.files import whole_file
from surrogate.model_files import read_run
from surrogate.plan import SEQUENCE, TABOR, Operation, Plan, lower
from surrogate.scaling import SYMLOG_PASSES, Scaling

if TYPE_CHECKING:
    import keras

# The newest pair the ONNX Runtimes of browsers have long known.
OPSET, IR_VERSION = 17, 8


def export_folder(folder: Path) -> Path:
    """Write `model.onnx` into a model directory, from its weights and scaling.

    Returns:
        The file's path.

    Raises:
        FileNotFoundError: the directory is not complete.
        ValueError: the weights do not fit.
    """
    run, scaling = read_run(folder)
    weights = hashlib.sha256((folder / "model.weights.h5").read_bytes()).hexdigest()
    content = build_graph(
        keras_model(folder, run), scaling, name=run["name"], architecture=run["architecture"], weights_sha256=weights
    )
    target = folder / ONNX_NAME
    with whole_file(target) as part:
        part.write_bytes(content.SerializeToString(deterministic=True))
    return target


def build_graph(
    model: keras.Model, scaling: Scaling, *, name: str, architecture: str, weights_sha256: str = ""
) -> onnx.ModelProto:
    """Translate a trained model and its scaling to ONNX.

    Args:
        model: A model of `surrogate.build`.
        scaling: Its scaling.
        name: The name it is published under.
        architecture: One of the eighteen names.
        weights_sha256: Digest of the weights file, for readers to compare.

    Returns:
        The ONNX model, checked.

    Raises:
        ValueError: the model has layers unknown to `surrogate.plan`.
    """
    plan = lower(model)
    graph = _Graph()
    sequence = _scaled_channels(graph, scaling)
    mean, deviation = scaling.tabor
    tabor = graph.standardise(graph.symlog("tabor"), np.array(mean), np.array(deviation))
    tabor = graph.add("Unsqueeze", graph.cast(tabor, TensorProto.FLOAT), graph.integers([1]))

    results = {SEQUENCE: sequence, TABOR: tabor}
    graph.initializers |= plan.weights
    for operation in plan.operations:
        results[operation.name] = _EMITTERS[operation.kind](graph, operation, [results[i] for i in operation.inputs])

    scaled = graph.cast(graph.add("Squeeze", results[plan.output], graph.integers([2])), TensorProto.DOUBLE)
    mean, deviation = scaling.force
    scaled = graph.add("Add", graph.add("Mul", scaled, graph.number(deviation)), graph.number(mean))
    graph.symexp(scaled, "force")

    content = helper.make_model(
        graph.finish(name), opset_imports=[helper.make_opsetid("", OPSET)], producer_name="contact-trajectories"
    )
    content.ir_version = IR_VERSION
    helper.set_model_props(content, _metadata(plan, scaling, name, architecture, weights_sha256))
    onnx.checker.check_model(content, full_check=True)
    return content


def _metadata(plan: Plan, scaling: Scaling, name: str, architecture: str, weights_sha256: str) -> dict[str, str]:
    return {
        "format": ONNX_FORMAT,
        "format_version": str(ONNX_FORMAT_VERSION),
        "name": name,
        "architecture": architecture,
        "features": scaling.features,
        "ranges": json.dumps(scaling.ranges),
        "scaling": scaling.to_json(),
        "plan": json.dumps([operation.as_dict() for operation in plan.operations]),
        "dataset_sha256": scaling.dataset_sha256,
        "weights_sha256": weights_sha256,
    }


class _Graph:
    """Nodes and constants of a growing graph; every `add` returns the name of its result."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.initializers: dict[str, np.ndarray] = {}

    def add(self, kind: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        output = output or f"{kind}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, inputs, [output], name=output, **attributes))
        return output

    def constant(self, values: np.ndarray) -> str:
        for name, known in self.initializers.items():
            if known.dtype == values.dtype and known.shape == values.shape and np.array_equal(known, values):
                return name
        name = f"constant_{len(self.initializers)}"
        self.initializers[name] = values
        return name

    def number(self, value: float) -> str:
        return self.constant(np.array(value, dtype=np.float64))

    def integers(self, values: list[int]) -> str:
        return self.constant(np.array(values, dtype=np.int64))

    def cast(self, source: str, to: int) -> str:
        return self.add("Cast", source, to=to)

    def symlog(self, source: str) -> str:
        size = self.add("Log", self.add("Add", self.add("Abs", source), self.number(1.0)))
        return self.add("Mul", self.add("Sign", source), size)

    def symexp(self, source: str, output: str) -> str:
        size = self.add("Sub", self.add("Exp", self.add("Abs", source)), self.number(1.0))
        return self.add("Mul", self.add("Sign", source), size, output=output)

    def standardise(self, source: str, mean: np.ndarray, deviation: np.ndarray) -> str:
        return self.add("Div", self.add("Sub", source, self.constant(mean)), self.constant(deviation))

    def slope(self, values: str) -> str:
        """Backward difference by time along the steps, zero at the first."""
        ends = [self.integers([bound]) for bound in (1, -1, 0, np.iinfo(np.int64).max)]
        one, minus_one, zero, far = ends
        rises = [
            self.add("Sub", self.add("Slice", x, one, far, one), self.add("Slice", x, zero, minus_one, one))
            for x in (values, "times")
        ]
        return self.add("Pad", self.add("Div", *rises), self.integers([0, 1, 0, 0]))

    def finish(self, name: str) -> onnx.GraphProto:
        matrix = ["batch", "steps"]
        shapes = {"times": matrix, "indentations": matrix, "tabor": ["batch"], "edge": matrix}
        inputs = [helper.make_tensor_value_info(key, TensorProto.DOUBLE, shape) for key, shape in shapes.items()]
        output = helper.make_tensor_value_info("force", TensorProto.DOUBLE, matrix)
        constants = [numpy_helper.from_array(values, key) for key, values in self.initializers.items()]
        return helper.make_graph(self.nodes, name, inputs, [output], initializer=constants)


def _scaled_channels(graph: _Graph, scaling: Scaling) -> str:
    velocity = None
    columns = []
    for channel in channel_names(scaling.features):
        if channel in ("velocity", "acceleration") and velocity is None:
            velocity = graph.slope("indentations")
        column = {
            "time": lambda: "times",
            "indentation": lambda: "indentations",
            "velocity": lambda v=velocity: v,
            "acceleration": lambda v=velocity: _moving_average(graph, graph.slope(v)),
            "edge": lambda: "edge",
        }[channel]()
        for _ in range(SYMLOG_PASSES[channel]):
            column = graph.symlog(column)
        columns.append(graph.add("Unsqueeze", column, graph.integers([2])))
    stacked = graph.add("Concat", *columns, axis=2)
    mean, deviation = (np.array(values) for values in (scaling.channel_mean, scaling.channel_scale))
    return graph.cast(graph.standardise(stacked, mean, deviation), TensorProto.FLOAT)


def _moving_average(graph: _Graph, source: str) -> str:
    """Exponential moving average along the steps, from zero, as a scan."""
    state, item, result = (
        helper.make_tensor_value_info(name, TensorProto.DOUBLE, ["batch"]) for name in ("before", "raw", "after")
    )
    output = helper.make_tensor_value_info("smooth", TensorProto.DOUBLE, ["batch"])
    weights = {"share": ACCELERATION_SMOOTHING, "rest": 1.0 - ACCELERATION_SMOOTHING}
    body = helper.make_graph(
        [
            helper.make_node("Mul", ["raw", "share"], ["new"]),
            helper.make_node("Mul", ["before", "rest"], ["old"]),
            helper.make_node("Add", ["new", "old"], ["after"]),
            helper.make_node("Identity", ["after"], ["smooth"]),
        ],
        "moving_average",
        [state, item],
        [result, output],
        initializer=[numpy_helper.from_array(np.array(value), key) for key, value in weights.items()],
    )
    start = graph.add("Mul", TABOR, graph.number(0.0))
    smooth = f"Scan_{len(graph.nodes)}"
    graph.nodes.append(
        helper.make_node(
            "Scan",
            [start, source],
            [f"{smooth}_last", smooth],
            name=smooth,
            body=body,
            num_scan_inputs=1,
            scan_input_axes=[1],
            scan_output_axes=[1],
        )
    )
    return smooth


def _emit_append(graph: _Graph, _: Operation, inputs: list[str]) -> str:
    sequence, tabor = inputs
    first = graph.add("Slice", sequence, graph.integers([0]), graph.integers([1]), graph.integers([2]))
    nothing = graph.add("Sub", first, first)
    return graph.add(
        "Concat", sequence, graph.add("Add", nothing, graph.add("Unsqueeze", tabor, graph.integers([1]))), axis=2
    )


def _emit_dense(graph: _Graph, operation: Operation, inputs: list[str]) -> str:
    product = graph.add("MatMul", inputs[0], f"{operation.name}/kernel")
    return graph.add("Add", product, f"{operation.name}/bias")


def _emit_lstm(graph: _Graph, operation: Operation, inputs: list[str]) -> str:
    units = graph.initializers[f"{operation.name}/R"].shape[-1]
    steps_first = graph.add("Transpose", inputs[0], perm=[1, 0, 2])
    weights = [f"{operation.name}/{key}" for key in ("W", "R", "B")]
    hidden = graph.add("LSTM", steps_first, *weights, hidden_size=units)
    return graph.add("Transpose", graph.add("Squeeze", hidden, graph.integers([1])), perm=[1, 0, 2])


def _emit_normalise(graph: _Graph, operation: Operation, inputs: list[str]) -> str:
    weights = [f"{operation.name}/{key}" for key in ("gamma", "beta")]
    return graph.add("LayerNormalization", inputs[0], *weights, axis=-1, epsilon=operation.options["epsilon"])


def _emit_convolve(graph: _Graph, operation: Operation, inputs: list[str]) -> str:
    dilation = operation.options["dilation"]
    reach = (graph.initializers[f"{operation.name}/kernel"].shape[-1] - 1) * dilation
    weights = [f"{operation.name}/{key}" for key in ("kernel", "bias")]
    channels_first = graph.add("Transpose", inputs[0], perm=[0, 2, 1])
    convolved = graph.add("Conv", channels_first, *weights, dilations=[dilation], pads=[reach, 0])
    return graph.add("Transpose", convolved, perm=[0, 2, 1])


def _emit_modulate(graph: _Graph, _: Operation, inputs: list[str]) -> str:
    scale, shift = (graph.add("Unsqueeze", part, graph.integers([1])) for part in inputs[1:])
    return graph.add("Add", graph.add("Mul", inputs[0], scale), shift)


def _emit_mix(graph: _Graph, _: Operation, inputs: list[str]) -> str:
    terms = []
    for index, source in enumerate(inputs[:2]):
        weight = graph.add("Gather", inputs[2], graph.integers([index]), axis=1)
        terms.append(graph.add("Mul", source, graph.add("Unsqueeze", weight, graph.integers([1]))))
    return graph.add("Add", *terms)


def _emit_attend(graph: _Graph, operation: Operation, inputs: list[str]) -> str:
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


_EMITTERS: dict[str, Callable[[_Graph, Operation, list[str]], str]] = {
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

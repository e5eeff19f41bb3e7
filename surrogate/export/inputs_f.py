"""The inputs F (`surrogate.data.physics`) as operations of an ONNX graph, in double precision.

Each memory of F obeys m_i = a_i m_(i-1) + b_i with the decay a and the gain b of its step. Decays and gains of all
steps are computed at once, so that only this recurrence runs step by step.
"""

from __future__ import annotations

import math

import numpy as np
from onnx import TensorProto, helper

from surrogate.data.features import channel_names
from surrogate.data.scaling import SYMLOG_PASSES, Scaling
from surrogate.export.onnx_graph import OnnxGraph

RATIO = "modulus_ratio"


def scaled_inputs(graph: OnnxGraph, scaling: Scaling) -> str:
    """Add the scaled channels F and, last, the scaled Tabor parameter: float32 of shape `(steps, batch, 13)`.

    The inputs of the graph are `times`, `indentations` and `edge` of shape `(batch, steps)`, `tabor` and
    `modulus_ratio` of shape `(batch,)`.
    """
    found = _channels(graph)
    columns = []
    for name in channel_names("F"):
        column = found[name]
        for _ in range(SYMLOG_PASSES[name]):
            column = graph.symlog(column)
        columns.append(graph.add("Unsqueeze", column, graph.integers([2])))
    columns.append(graph.add("Unsqueeze", _along(graph, graph.symlog("tabor")), graph.integers([2])))
    moments = [*zip(scaling.channel_mean, scaling.channel_scale, strict=True), scaling.tabor]
    mean, scale = np.array(moments).T.copy()
    scaled = graph.standardise(graph.add("Concat", *columns, axis=2), mean, scale)
    return graph.add("Transpose", graph.cast(scaled, TensorProto.FLOAT), perm=[1, 0, 2])


def _channels(graph: OnnxGraph) -> dict[str, str]:
    """Add the channels before any transformation, each of shape `(batch, steps)`, by name."""
    zero = graph.number(0.0)
    velocity = graph.slope("indentations")
    hertz = _hertz(graph)
    memory, relaxation, retardation = _memories(graph, hertz)
    ratio = graph.add("Unsqueeze", RATIO, graph.integers([1]))
    strength = graph.add("Sub", graph.add("Reciprocal", ratio), graph.number(1.0))
    flags = {name: graph.add(kind, velocity, zero) for name, kind in (("loading", "Greater"), ("unloading", "Less"))}
    return {
        "time": "times",
        "indentation": "indentations",
        "velocity": velocity,
        "edge": "edge",
        "log_step": graph.log_step(),
        "lee_radok": graph.add("Add", hertz, graph.add("Mul", strength, memory)),
        "hertz": hertz,
        "memory_relaxation": relaxation,
        "memory_retardation": retardation,
        "log_modulus_ratio": _along(graph, graph.add("Log", RATIO)),
        **{name: graph.cast(flag, TensorProto.DOUBLE) for name, flag in flags.items()},
    }


def _along(graph: OnnxGraph, values: str) -> str:
    """Repeat one value of each history, shape `(batch,)`, along the steps."""
    column = graph.add("Unsqueeze", values, graph.integers([1]))
    return graph.add("Expand", column, graph.add("Shape", "times"))


def _hertz(graph: OnnxGraph) -> str:
    """Relaxed force of Hertz, -4/(3 pi) mu^(-3/2) max(indentation, 0)^(3/2)."""
    pressed = graph.add("Max", "indentations", graph.number(0.0))
    power = graph.add("Mul", pressed, graph.add("Sqrt", pressed))
    size = graph.add("Mul", graph.number(-4.0 / (3.0 * math.pi)), graph.add("Pow", "tabor", graph.number(-1.5)))
    return graph.add("Mul", graph.add("Unsqueeze", size, graph.integers([1])), power)


def _memories(graph: OnnxGraph, hertz: str) -> list[str]:
    """Memories of the force of Hertz and of the indentation at the relaxation time, and at the retardation time."""
    duration = graph.rise("times")
    ratio = graph.add("Unsqueeze", RATIO, graph.integers([1]))
    change, force_change = graph.rise("indentations"), graph.rise(hertz)
    first = graph.add("Slice", hertz, graph.integers([0]), graph.integers([1]), graph.integers([1]))
    nothing = graph.add("Sub", first, first)
    quick = graph.add("Div", duration, ratio)
    decays, gains = [], []
    for steps, rise, start in ((quick, force_change, first), (quick, change, nothing), (duration, change, nothing)):
        lost = _lost(graph, steps)
        decay = graph.add("Sub", graph.number(1.0), lost)
        gain = graph.add("Mul", graph.add("Div", lost, steps), rise)
        for found, begin, later in ((decays, nothing, decay), (gains, start, gain)):
            column = graph.add("Concat", begin, later, axis=1)
            found.append(graph.add("Unsqueeze", column, graph.integers([0])))
    memories = _recurrence(graph, *(graph.add("Concat", *rows, axis=0) for rows in (decays, gains)))
    return [graph.add("Gather", memories, graph.integer(row), axis=0) for row in range(3)]


def _lost(graph: OnnxGraph, steps: str) -> str:
    """1 - exp(-x) of steps x > 0, as 2 t / (1 + t) with t = tanh(x / 2): short steps lose no digits."""
    half = graph.add("Tanh", graph.add("Mul", graph.number(0.5), steps))
    return graph.add("Div", graph.add("Add", half, half), graph.add("Add", graph.number(1.0), half))


def _recurrence(graph: OnnxGraph, decays: str, gains: str) -> str:
    """Add m_i = a_i m_(i-1) + b_i from zero, for arrays of shape `(memories, batch, steps)`."""
    shape = ["memories", "batch"]
    value = {
        name: helper.make_tensor_value_info(name, TensorProto.DOUBLE, shape)
        for name in ("before", "decay", "gain", "after", "here")
    }
    body = helper.make_graph(
        [
            helper.make_node("Mul", ["decay", "before"], ["kept"]),
            helper.make_node("Add", ["kept", "gain"], ["after"]),
            helper.make_node("Identity", ["after"], ["here"]),
        ],
        "memory",
        [value["before"], value["decay"], value["gain"]],
        [value["after"], value["here"]],
    )
    start = graph.add("Gather", gains, graph.integer(0), axis=2)
    nothing = graph.add("Sub", start, start)
    name = f"Scan_{len(graph.nodes)}"
    attributes = {"num_scan_inputs": 2, "scan_input_axes": [2, 2], "scan_output_axes": [2]}
    node = helper.make_node(
        "Scan", [nothing, decays, gains], [f"{name}_last", name], name=name, body=body, **attributes
    )
    graph.nodes.append(node)
    return name

"""Channels of all feature sets as operations of an ONNX graph, in double precision.

The channels are those of `surrogate.data.features` and `surrogate.data.physics`. Each memory of set F obeys
m_i = a_i m_(i-1) + b_i with the decay a and the gain b of its step. Decays and gains of all steps are computed at once,
so that only this recurrence runs step by step.
"""

from __future__ import annotations

import math

import numpy as np
from onnx import TensorProto

from surrogate.data.features import channel_names
from surrogate.data.physics import ACCELERATION_SMOOTHING
from surrogate.data.scaling import SYMLOG_PASSES, Scaling
from surrogate.export.onnx_graph import OnnxGraph

RATIO = "modulus_ratio"
"""Input or constant of the graphs of set F, of shape `(batch,)` or `(1,)`."""

MEMORY = """
memory (double[memories, batch] before, double[memories, batch] decay, double[memories, batch] gain)
    => (double[memories, batch] after, double[memories, batch] here) {
    kept = Mul(decay, before)
    after = Add(kept, gain)
    here = Identity(after)
}"""
"""One step of memories, in the text form of ONNX."""
AVERAGE = f"""
moving_average (double[batch] before, double[batch] raw) => (double[batch] after, double[batch] smooth)
    <double share = {{{ACCELERATION_SMOOTHING!r}}}, double rest = {{{1.0 - ACCELERATION_SMOOTHING!r}}}> {{
    new = Mul(raw, share)
    old = Mul(before, rest)
    after = Add(new, old)
    smooth = Identity(after)
}}"""
"""One step of a moving average, likewise."""


def scaled_channels(graph: OnnxGraph, scaling: Scaling, *, with_tabor: bool = False) -> str:
    """Add the scaled channels of a feature set, float32 of shape `(batch, steps, channels)`, and return their name.

    The inputs of the graph are `times`, `indentations` and `edge` of shape `(batch, steps)`, and `tabor` of shape
    `(batch,)`. Set F also needs `RATIO`.

    Args:
        graph: The graph.
        scaling: The scaling, which names the feature set.
        with_tabor: Whether the scaled Tabor parameter is one more channel, the last one.
    """
    columns = []
    for name in channel_names(scaling.features):
        column = _channel(graph, name)
        for _ in range(SYMLOG_PASSES[name]):
            column = graph.symlog(column)
        columns.append(graph.add("Unsqueeze", column, graph.integers([2])))
    mean, deviation = list(scaling.channel_mean), list(scaling.channel_scale)
    if with_tabor:
        columns.append(graph.add("Unsqueeze", _along(graph, graph.symlog("tabor")), graph.integers([2])))
        mean.append(scaling.tabor[0])
        deviation.append(scaling.tabor[1])
    stacked = graph.add("Concat", *columns, axis=2)
    return graph.cast(graph.standardise(stacked, np.array(mean), np.array(deviation)), TensorProto.FLOAT)


def _channel(graph: OnnxGraph, name: str) -> str:
    """Add a channel before any transformation, of shape `(batch, steps)`; what two channels share is added once."""
    if name in ("loading", "unloading"):
        flag = graph.add("Greater" if name == "loading" else "Less", graph.slope("indentations"), graph.number(0.0))
        return graph.cast(flag, TensorProto.DOUBLE)
    if name in ("lee_radok", "memory_relaxation", "memory_retardation"):
        memories = _memories(graph, _hertz(graph))
        if name != "lee_radok":
            return memories[1 if name == "memory_relaxation" else 2]
        ratio = graph.add("Unsqueeze", RATIO, graph.integers([1]))
        strength = graph.add("Sub", graph.add("Reciprocal", ratio), graph.number(1.0))
        return graph.add("Add", _hertz(graph), graph.add("Mul", strength, memories[0]))
    makers = {
        "time": lambda: "times",
        "indentation": lambda: "indentations",
        "velocity": lambda: graph.slope("indentations"),
        "acceleration": lambda: _moving_average(graph, graph.slope(graph.slope("indentations"))),
        "edge": lambda: "edge",
        "log_step": lambda: graph.after_zero(graph.add("Log", graph.rise("times"))),
        "hertz": lambda: _hertz(graph),
        "log_modulus_ratio": lambda: _along(graph, graph.add("Log", RATIO)),
    }
    return makers[name]()


def _hertz(graph: OnnxGraph) -> str:
    """Add the relaxed force of Hertz, -4/(3 pi) mu^(-3/2) max(indentation, 0)^(3/2)."""
    pressed = graph.add("Max", "indentations", graph.number(0.0))
    power = graph.add("Mul", pressed, graph.add("Sqrt", pressed))
    size = graph.add("Mul", graph.number(-4.0 / (3.0 * math.pi)), graph.add("Pow", "tabor", graph.number(-1.5)))
    return graph.add("Mul", graph.add("Unsqueeze", size, graph.integers([1])), power)


def _along(graph: OnnxGraph, values: str) -> str:
    """Repeat one value of each history, shape `(batch,)`, along the steps."""
    column = graph.add("Unsqueeze", values, graph.integers([1]))
    return graph.add("Expand", column, graph.add("Shape", "times"))


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
    decay, gain = (graph.add("Concat", *rows, axis=0) for rows in (decays, gains))
    start = graph.add("Gather", gain, graph.integers(0), axis=2)
    memories = graph.scan(MEMORY, graph.add("Sub", start, start), decay, gain, axis=2)
    return [graph.add("Gather", memories, graph.integers(row), axis=0) for row in range(3)]


def _lost(graph: OnnxGraph, steps: str) -> str:
    """1 - exp(-x) of steps x > 0, as 2 t / (1 + t) with t = tanh(x / 2): short steps lose no digits."""
    half = graph.add("Tanh", graph.add("Mul", graph.number(0.5), steps))
    return graph.add("Div", graph.add("Add", half, half), graph.add("Add", graph.number(1.0), half))


def _moving_average(graph: OnnxGraph, source: str) -> str:
    """Add an exponential moving average along the steps, with the initial value zero, and return its name."""
    return graph.scan(AVERAGE, graph.add("Mul", "tabor", graph.number(0.0)), source, axis=1)

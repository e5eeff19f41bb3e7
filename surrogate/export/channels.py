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
from surrogate.export.onnx_graph import OnnxGraph, Value

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


def scaled_channels(graph: OnnxGraph, scaling: Scaling, *, with_tabor: bool = False) -> Value:
    """Add the scaled channels of a feature set, and return them, float32 of shape `(batch, steps, channels)`.

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
        columns.append(column.expand(2))
    mean, deviation = list(scaling.channel_mean), list(scaling.channel_scale)
    if with_tabor:
        columns.append(_along(graph, graph.symlog(graph.named("tabor"))).expand(2))
        mean.append(scaling.tabor[0])
        deviation.append(scaling.tabor[1])
    stacked = graph.add("Concat", *columns, axis=2)
    return ((stacked - np.array(mean)) / np.array(deviation)).cast(TensorProto.FLOAT)


def _channel(graph: OnnxGraph, name: str) -> Value:
    """Add a channel before any transformation, of shape `(batch, steps)`; what two channels share is added once."""
    times, indentations = graph.named("times"), graph.named("indentations")
    if name in ("loading", "unloading"):
        velocity = _slope(times, indentations)
        return (velocity > 0.0 if name == "loading" else velocity < 0.0).cast(TensorProto.DOUBLE)
    if name in ("lee_radok", "memory_relaxation", "memory_retardation"):
        memories = _memories(graph, _hertz(graph))
        if name != "lee_radok":
            return memories[1 if name == "memory_relaxation" else 2]
        strength = graph.add("Reciprocal", graph.named(RATIO).expand(1)) - 1.0
        return _hertz(graph) + strength * memories[0]
    makers = {
        "time": lambda: times,
        "indentation": lambda: indentations,
        "velocity": lambda: _slope(times, indentations),
        "acceleration": lambda: graph.scan(
            AVERAGE, graph.named("tabor") * 0.0, _slope(times, _slope(times, indentations)), axis=1
        ),
        "edge": lambda: graph.named("edge"),
        "log_step": lambda: graph.after_zero(graph.add("Log", times.rise())),
        "hertz": lambda: _hertz(graph),
        "log_modulus_ratio": lambda: _along(graph, graph.add("Log", graph.named(RATIO))),
    }
    return makers[name]()


def _slope(times: Value, values: Value) -> Value:
    """Backward difference over time along the steps; the first value is zero."""
    return times.graph.after_zero(values.rise() / times.rise())


def _hertz(graph: OnnxGraph) -> Value:
    """Add the relaxed force of Hertz, -4/(3 pi) mu^(-3/2) max(indentation, 0)^(3/2)."""
    pressed = graph.add("Max", graph.named("indentations"), 0.0)
    size = -4.0 / (3.0 * math.pi) * graph.add("Pow", graph.named("tabor"), -1.5)
    return size.expand(1) * (pressed * graph.add("Sqrt", pressed))


def _along(graph: OnnxGraph, values: Value) -> Value:
    """Repeat one value of each history, shape `(batch,)`, along the steps."""
    return graph.add("Expand", values.expand(1), graph.add("Shape", graph.named("times")))


def _memories(graph: OnnxGraph, hertz: Value) -> list[Value]:
    """Memories of the force of Hertz and of the indentation at the relaxation time, and at the retardation time."""
    duration, change = graph.named("times").rise(), graph.named("indentations").rise()
    first = hertz.columns(0, 1)
    nothing = first - first
    quick = duration / graph.named(RATIO).expand(1)
    decays, gains = [], []
    for steps, rise, start in ((quick, hertz.rise(), first), (quick, change, nothing), (duration, change, nothing)):
        lost = _lost(graph, steps)
        for found, begin, later in ((decays, nothing, 1.0 - lost), (gains, start, lost / steps * rise)):
            found.append(graph.add("Concat", begin, later, axis=1).expand(0))
    decay, gain = (graph.add("Concat", *rows, axis=0) for rows in (decays, gains))
    start = graph.add("Gather", gain, 0, axis=2)
    memories = graph.scan(MEMORY, start - start, decay, gain, axis=2)
    return [graph.add("Gather", memories, row, axis=0) for row in range(3)]


def _lost(graph: OnnxGraph, steps: Value) -> Value:
    """1 - exp(-x) of steps x > 0, as 2 t / (1 + t) with t = tanh(x / 2): short steps lose no digits."""
    half = graph.add("Tanh", 0.5 * steps)
    return (half + half) / (1.0 + half)

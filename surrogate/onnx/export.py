"""Trained models as ONNX files, which map physical inputs to physical forces.

One graph contains features, scaling and network, so the file is self-contained. Inputs, all float64: `times`,
`indentations` and `edge` of shape `(batch, steps)`, `tabor` of shape `(batch,)`. Output: `force` of shape `(batch,
steps)`, float64. `edge` is one at the first and the last point of the dwell and zero elsewhere. All operations before
and after the network are float64, because differences of large times lose digits; the network is float32. Each LSTM is
one ONNX operator. In a model of the inputs F, the modulus ratio of the training set is a constant.

The metadata of the file are `format`, `format_version`, `name`, `architecture`, `features`, `ranges` (JSON: smallest
and largest value of each protocol quantity in the training set), `scaling` (JSON), `dataset_sha256`, `weights_sha256`
(of `model.weights.h5`) and, as the last entry, `content_sha256` (see `surrogate.onnx.file`).

A model with bands, `fast` or `accurate`, has one more input, `modulus_ratio` of shape `(batch,)`. Its times must be the
measurement steps of `bem.dataset.physical_steps`. It has more outputs, results with their intervals and bands
(`surrogate.onnx.intervals_graph`). Its metadata have no `architecture` and no digests of other files, but `counts`
(JSON: points of loading, dwell and unloading) and `coverage`, the share of true values that the bands contain.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from onnx import TensorProto

from surrogate.data.features import NEEDS_MATERIAL, channel_names
from surrogate.data.physics import ACCELERATION_SMOOTHING
from surrogate.data.scaling import SYMLOG_PASSES, Scaling
from surrogate.onnx.file import ONNX_FORMAT, ONNX_FORMAT_VERSION, checked_content, sealed
from surrogate.onnx.graph import OnnxGraph, Value
from surrogate.onnx.keras_layers import add_network

if TYPE_CHECKING:
    import keras

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

MATRIX = ["batch", "steps"]
HISTORY = {"times": MATRIX, "indentations": MATRIX, "tabor": ["batch"], "edge": MATRIX}
"""Shapes of the inputs and of the output of a complete file."""


def file_content(
    model: keras.Model, scaling: Scaling, *, name: str, architecture: str, weights_sha256: str = ""
) -> bytes:
    """Return the ONNX file of a trained model and its scaling.

    Args:
        model: A model of `surrogate.build`.
        scaling: The scaling of its training set.
        name: Name under which the model is published.
        architecture: Name of the architecture.
        weights_sha256: SHA-256 sum of the weights file, for the metadata.

    Returns:
        The bytes, with the metadata and the checksum that `surrogate.load` checks.

    Raises:
        NotExportableError: the model has layers unknown to `surrogate.onnx.keras_layers`.
        ValueError: its inputs need a modulus ratio that is not known.
    """
    graph = OnnxGraph()
    if scaling.features in NEEDS_MATERIAL:
        if scaling.modulus_ratio is None:
            raise ValueError(
                f"modulus_ratio of the training set must be known for features {scaling.features}; received none"
            )
        graph.initializers[RATIO] = np.array([scaling.modulus_ratio])
    sequence = scaled_channels(graph, scaling)
    mean, deviation = scaling.tabor
    tabor = ((graph.named("tabor").symlog() - mean) / deviation).cast(TensorProto.FLOAT)
    unscaled(add_network(model, sequence, tabor.expand(1)).squeeze(2), scaling)
    more = {
        "architecture": architecture,
        "dataset_sha256": scaling.dataset_sha256,
        "weights_sha256": weights_sha256,
    }
    return complete(graph, HISTORY, {"force": MATRIX}, ONNX_FORMAT, name, scaling, more)


def network_content(members: Sequence[keras.Model], features: str, name: str) -> bytes:
    """Return the ONNX file of a network alone, the mean of its members, as folders of models with bands hold it.

    Its input `inputs`, float32 of shape `(steps, batch, channels + 1)`, are scaled channels and the scaled Tabor
    parameter. Its output `force`, float32 of shape `(steps, batch)`, is the scaled force.

    Args:
        members: Models that append the Tabor parameter to their channels.
        features: The feature set.
        name: Name of the model.

    Returns:
        The bytes, without a checksum of their own.
    """
    graph, width = OnnxGraph(), len(channel_names(features)) + 1
    sequence = graph.named("inputs").turned(1, 0, 2)
    first, *more_forces = (add_network(member, sequence) for member in members)
    force = sum(more_forces, first) / np.array(len(members), dtype=np.float32) if more_forces else first
    force.turned(1, 0, 2).to("Squeeze", [2], output="force")
    inputs, outputs = {"inputs": ["steps", "batch", width]}, {"force": ["steps", "batch"]}
    return checked_content(graph.finish(name, inputs, outputs, TensorProto.FLOAT))


def unscaled(scaled: Value, scaling: Scaling) -> Value:
    """Add the output `force` from the scaled force, float32, and return that as float64."""
    mean, deviation = scaling.force
    scaled = scaled.cast(TensorProto.DOUBLE)
    (scaled * deviation + mean).symexp("force")
    return scaled


def complete(
    graph: OnnxGraph,
    inputs: Mapping[str, list[Any]],
    outputs: Mapping[str, list[Any]],
    file_format: str,
    name: str,
    scaling: Scaling,
    more: dict[str, str],
) -> bytes:
    """Return the file of a complete graph, with the metadata that all files have and `more`."""
    metadata = {
        "format": file_format,
        "format_version": str(ONNX_FORMAT_VERSION),
        "name": name,
        "features": scaling.features,
        "ranges": json.dumps(scaling.ranges),
        "scaling": scaling.to_json(),
    }
    return sealed(checked_content(graph.finish(name, inputs, outputs), metadata | more))


def scaled_channels(graph: OnnxGraph, scaling: Scaling, *, with_tabor: bool = False) -> Value:
    """Add the scaled channels of a feature set.

    The inputs of the graph are `times`, `indentations` and `edge` of shape `(batch, steps)`, and `tabor` of shape
    `(batch,)`. Set F also needs `RATIO`. All is computed in double precision, as `surrogate.data.features` does.

    Args:
        graph: The graph.
        scaling: The scaling, which names the feature set.
        with_tabor: Whether the scaled Tabor parameter is one more channel, the last one.

    Returns:
        The channels, float32 of shape `(batch, steps, channels)`.
    """
    columns = []
    for name in channel_names(scaling.features):
        column = _channel(graph, name)
        for _ in range(SYMLOG_PASSES[name]):
            column = column.symlog()
        columns.append(column.expand(2))
    mean, deviation = list(scaling.channel_mean), list(scaling.channel_scale)
    if with_tabor:
        columns.append(_along(graph.named("tabor").symlog()).expand(2))
        mean.append(scaling.tabor[0])
        deviation.append(scaling.tabor[1])
    stacked = graph.add("Concat", *columns, axis=2)
    return ((stacked - np.array(mean)) / np.array(deviation)).cast(TensorProto.FLOAT)


def _channel(graph: OnnxGraph, name: str) -> Value:
    """Add a channel before any transformation, of shape `(batch, steps)`; what two channels share is added once."""
    times, indentations, tabor, ratio = (graph.named(key) for key in ("times", "indentations", "tabor", RATIO))
    if name in ("lee_radok", "memory_relaxation", "memory_retardation"):
        hertz = _hertz(indentations, tabor)
        force, relaxation, retardation = _memories(times, indentations, hertz, ratio)
        if name != "lee_radok":
            return relaxation if name == "memory_relaxation" else retardation
        strength = ratio.expand(1).to("Reciprocal") - 1.0
        return hertz + strength * force
    makers = {
        "time": lambda: times,
        "indentation": lambda: indentations,
        "velocity": lambda: _slope(times, indentations),
        "acceleration": lambda: graph.scan(AVERAGE, tabor * 0.0, _slope(times, _slope(times, indentations)), axis=1),
        "edge": lambda: graph.named("edge"),
        "log_step": lambda: times.rise().to("Log").after_zero(),
        "hertz": lambda: _hertz(indentations, tabor),
        "log_modulus_ratio": lambda: _along(ratio.to("Log")),
        "loading": lambda: (_slope(times, indentations) > 0.0).cast(TensorProto.DOUBLE),
        "unloading": lambda: (_slope(times, indentations) < 0.0).cast(TensorProto.DOUBLE),
    }
    return makers[name]()


def _slope(times: Value, values: Value) -> Value:
    """Backward difference over time along the steps; the first value is zero."""
    return (values.rise() / times.rise()).after_zero()


def _hertz(indentations: Value, tabor: Value) -> Value:
    """Add the relaxed force of Hertz, -4/(3 pi) mu^(-3/2) max(indentation, 0)^(3/2)."""
    pressed = indentations.to("Max", 0.0)
    size = -4.0 / (3.0 * math.pi) * tabor.to("Pow", -1.5)
    return size.expand(1) * (pressed * pressed.to("Sqrt"))


def _along(values: Value) -> Value:
    """Repeat one value of each history, shape `(batch,)`, along the steps."""
    return values.expand(1).to("Expand", values.graph.named("times").to("Shape"))


def _memories(times: Value, indentations: Value, hertz: Value, ratio: Value) -> list[Value]:
    """Memories of the force of Hertz and of the indentation at the relaxation time, and at the retardation time.

    A graph holds no call of `bem.dataset.physical_steps.carried`, so that recursion stands here again, as m_i = a_i
    m_(i-1) + b_i with the decay a and the gain b of each step. Decays and gains of all steps are
    computed at once, so that only this recurrence runs step by step.
    """
    graph, duration, change = times.graph, times.rise(), indentations.rise()
    first = hertz.columns(0, 1)
    nothing = first - first
    quick = duration / ratio.expand(1)
    decays, gains = [], []
    for steps, rise, start in ((quick, hertz.rise(), first), (quick, change, nothing), (duration, change, nothing)):
        # 1 - exp(-x) of steps x > 0, as 2 t / (1 + t) with t = tanh(x / 2): short steps lose no digits.
        half = (0.5 * steps).to("Tanh")
        lost = (half + half) / (1.0 + half)
        for series, begin, later in ((decays, nothing, 1.0 - lost), (gains, start, lost / steps * rise)):
            series.append(begin.to("Concat", later, axis=1).expand(0))
    decay, gain = (graph.add("Concat", *rows, axis=0) for rows in (decays, gains))
    start = gain.to("Gather", 0, axis=2)
    memories = graph.scan(MEMORY, start - start, decay, gain, axis=2)
    return [memories.to("Gather", row, axis=0) for row in range(3)]

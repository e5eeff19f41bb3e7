"""Trained models as ONNX files, which map physical inputs to physical forces.

One graph contains features, scaling and network, so the file is self-contained. Inputs, all float64: `times`,
`indentations` and `edge` of shape `(batch, steps)`, `tabor` of shape `(batch,)`. Output: `force` of shape `(batch,
steps)`, float64. `edge` is one at the first and the last point of the dwell and zero elsewhere. All operations before
and after the network are float64, because differences of large times lose digits; the network is float32. Each LSTM is
one ONNX operator.

The metadata of the file are `format`, `format_version`, `name`, `architecture`, `features`, `ranges` (JSON: smallest
and largest value of each protocol quantity in the training set), `scaling` (JSON), `dataset_sha256`, `weights_sha256`
(of `model.weights.h5`) and, as the last entry, `content_sha256` (see `surrogate.onnx.file`).
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
from onnx import TensorProto

from surrogate.data.features import ACCELERATION_SMOOTHING, channel_names
from surrogate.data.scaling import SYMLOG_PASSES, Scaling
from surrogate.onnx.file import ONNX_FORMAT, ONNX_FORMAT_VERSION, checked_content, sealed
from surrogate.onnx.graph import OnnxGraph, Value
from surrogate.onnx.keras_layers import add_network

if TYPE_CHECKING:
    import keras

AVERAGE = f"""
moving_average (double[batch] before, double[batch] raw) => (double[batch] after, double[batch] smooth)
    <double share = {{{ACCELERATION_SMOOTHING!r}}}, double rest = {{{1.0 - ACCELERATION_SMOOTHING!r}}}> {{
    new = Mul(raw, share)
    old = Mul(before, rest)
    after = Add(new, old)
    smooth = Identity(after)
}}"""
"""One step of a moving average, in the text form of ONNX."""

MATRIX = ["batch", "steps"]
HISTORY = {"times": MATRIX, "indentations": MATRIX, "tabor": ["batch"], "edge": MATRIX}
"""Shapes of the inputs."""


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
    """
    graph = OnnxGraph()
    sequence = scaled_channels(graph, scaling)
    mean, deviation = scaling.tabor
    tabor = ((graph.named("tabor").symlog() - mean) / deviation).cast(TensorProto.FLOAT)
    scaled = add_network(model, sequence, tabor.expand(1)).squeeze(2).cast(TensorProto.DOUBLE)
    mean, deviation = scaling.force
    (scaled * deviation + mean).symexp("force")
    metadata = {
        "format": ONNX_FORMAT,
        "format_version": str(ONNX_FORMAT_VERSION),
        "name": name,
        "features": scaling.features,
        "ranges": json.dumps(scaling.ranges),
        "scaling": scaling.to_json(),
        "architecture": architecture,
        "dataset_sha256": scaling.dataset_sha256,
        "weights_sha256": weights_sha256,
    }
    return sealed(checked_content(graph.finish(name, HISTORY, {"force": MATRIX}), metadata))


def scaled_channels(graph: OnnxGraph, scaling: Scaling) -> Value:
    """Add the scaled channels of a feature set, float32 of shape `(batch, steps, channels)`.

    The inputs of the graph are `times`, `indentations` and `edge` of shape `(batch, steps)`, and `tabor` of shape
    `(batch,)`. All is computed in double precision, as `surrogate.data.features` does.
    """
    columns = []
    for name in channel_names(scaling.features):
        column = _channel(graph, name)
        for _ in range(SYMLOG_PASSES[name]):
            column = column.symlog()
        columns.append(column.expand(2))
    stacked = graph.add("Concat", *columns, axis=2)
    scaled = (stacked - np.array(scaling.channel_mean)) / np.array(scaling.channel_scale)
    return scaled.cast(TensorProto.FLOAT)


def _channel(graph: OnnxGraph, name: str) -> Value:
    """Add a channel before any transformation, of shape `(batch, steps)`; what two channels share is added once."""
    times, indentations, tabor = (graph.named(key) for key in ("times", "indentations", "tabor"))
    makers = {
        "time": lambda: times,
        "indentation": lambda: indentations,
        "velocity": lambda: _slope(times, indentations),
        "acceleration": lambda: graph.scan(AVERAGE, tabor * 0.0, _slope(times, _slope(times, indentations))),
        "edge": lambda: graph.named("edge"),
    }
    return makers[name]()


def _slope(times: Value, values: Value) -> Value:
    """Backward difference over time along the steps; the first value is zero."""
    return (values.rise() / times.rise()).after_zero()

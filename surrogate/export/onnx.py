"""Trained models as ONNX files, which map physical inputs to physical forces.

One graph contains features, scaling and network, so the file is self-contained. Inputs, all float64: `times`,
`indentations` and `edge` of shape `(batch, steps)`, `tabor` of shape `(batch,)`. Output: `force` of shape `(batch,
steps)`, float64. `edge` is one at the first and the last point of the dwell and zero elsewhere. All operations before
and after the network are float64, because differences of large times lose digits; the network is float32. Each LSTM is
one ONNX operator. In a model of the inputs F, the modulus ratio of the training set is a constant.

The metadata of the file are `format`, `format_version`, `name`, `architecture`, `features`, `ranges` (JSON: smallest
and largest value of each protocol quantity in the training set), `scaling` (JSON), `dataset_sha256`, `weights_sha256`
(of `model.weights.h5`) and, as the last entry, `content_sha256` (see `surrogate.export.onnx_file`).

A model with bands, `fast` or `accurate`, has one more input, `modulus_ratio` of shape `(batch,)`. Its times must be the
measurement steps of `bem.dataset.physical_steps`. It has more outputs, results with their intervals and bands
(`surrogate.prediction.bands_graph`). Its metadata have no `architecture` and no digests of other files, but `counts`
(JSON: points of loading, dwell and unloading) and `coverage`, the share of true values that the bands contain.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from onnx import TensorProto

from surrogate.data.features import NEEDS_MATERIAL, channel_names
from surrogate.data.scaling import Scaling
from surrogate.export.channels import RATIO, scaled_channels
from surrogate.export.keras_layers import add_network
from surrogate.export.onnx_file import ONNX_FORMAT, ONNX_FORMAT_VERSION, checked_model, sealed
from surrogate.export.onnx_graph import OnnxGraph, Value

if TYPE_CHECKING:
    import keras

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
        NotExportableError: the model has layers unknown to `surrogate.export.keras_layers`.
        ValueError: the model has weights that are not finite, or its inputs need a modulus ratio that is not known.
    """
    graph = OnnxGraph()
    if scaling.features in NEEDS_MATERIAL:
        if scaling.modulus_ratio is None:
            raise ValueError(
                f"Expected a training set of one known modulus ratio for features {scaling.features}. Received: none"
            )
        graph.initializers[RATIO] = np.array([scaling.modulus_ratio])
    sequence = scaled_channels(graph, scaling)
    mean, deviation = scaling.tabor
    tabor = ((graph.symlog(graph.named("tabor")) - mean) / deviation).cast(TensorProto.FLOAT)
    unscaled(graph, add_network(graph, model, sequence, tabor.expand(1)).squeeze(2), scaling)
    more = {
        "architecture": architecture,
        "dataset_sha256": scaling.dataset_sha256,
        "weights_sha256": weights_sha256,
    }
    return complete(graph, HISTORY, {"force": MATRIX}, ONNX_FORMAT, name, scaling, more)


def network_content(members: Sequence[keras.Model], features: str, name: str) -> bytes:
    """Return the ONNX file of a network alone, the mean of its members, as folders of models with bands hold it.

    Its input `inputs`, float32 of shape `(steps, batch, channels + 1)`, are scaled channels and the scaled Tabor
    parameter. Its output `force`, float32 of shape `(steps, batch)`, is the scaled force. Where some members are causal
    and others see whole histories, the output `causal` is the mean of the former.

    Args:
        members: Models that append the Tabor parameter to their channels.
        features: The feature set.
        name: Name of the model.

    Returns:
        The bytes, which `surrogate.export.onnx_file.seal_folder` completes with checksums.
    """
    graph, width = OnnxGraph(), len(channel_names(features)) + 1
    given = graph.named("inputs").turned(1, 0, 2)
    forces = [add_network(graph, one, given, None, appended=True) for one in members]
    kinds = [{type(layer).__name__ for layer in one.layers} for one in members]
    causal = [force for force, kind in zip(forces, kinds, strict=True) if "ChosenSteps" not in kind]
    outputs = {"force": _mean(forces)} | ({"causal": _mean(causal)} if 0 < len(causal) < len(forces) else {})
    for key, value in outputs.items():
        graph.add("Squeeze", value.turned(1, 0, 2), [2], output=key)
    shapes: dict[str, list[Any]] = {key: ["steps", "batch"] for key in outputs}
    made = checked_model(graph.finish(name, {"inputs": ["steps", "batch", width]}, shapes, TensorProto.FLOAT))
    return made.SerializeToString(deterministic=True)


def _mean(values: list[Value]) -> Value:
    return sum(values[1:], values[0]) / np.array(len(values), dtype=np.float32) if len(values) > 1 else values[0]


def unscaled(graph: OnnxGraph, scaled: Value, scaling: Scaling) -> Value:
    """Add the output `force` from the scaled force, float32, and return that as float64."""
    mean, deviation = scaling.force
    scaled = scaled.cast(TensorProto.DOUBLE)
    graph.symexp(scaled * deviation + mean, "force")
    return scaled


def complete(
    graph: OnnxGraph,
    inputs: Mapping[str, list[Any]],
    outputs: Mapping[str, list[Any]],
    kind: str,
    name: str,
    scaling: Scaling,
    more: dict[str, str],
) -> bytes:
    """Return the file of a complete graph, with the metadata that all files have and `more`."""
    metadata = {
        "format": kind,
        "format_version": str(ONNX_FORMAT_VERSION),
        "name": name,
        "features": scaling.features,
        "ranges": json.dumps(scaling.ranges),
        "scaling": scaling.to_json(),
    }
    content = checked_model(graph.finish(name, inputs, outputs), metadata | more)
    return sealed(content.SerializeToString(deterministic=True))

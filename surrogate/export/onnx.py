"""Export of trained models as ONNX files, which map physical inputs to physical forces.

One graph contains features, scaling and network, so the file is self-contained. Inputs, all float64: `times`,
`indentations` and `edge` of shape `(batch, steps)`, `tabor` of shape `(batch,)`. Output: `force` of shape `(batch,
steps)`, float64. `edge` is one at the first and the last point of the dwell and zero elsewhere. All operations before
and after the network are float64, because differences of large times lose digits; the network is float32. Each LSTM is
one ONNX operator. In a model of the inputs F, the modulus ratio of the training set is a constant.

The metadata of the file are `format`, `format_version`, `name`, `architecture`, `features`, `ranges` (JSON: smallest
and largest value of each protocol quantity in the training set), `scaling` (JSON), `plan` (JSON: the operations of
`surrogate.network.graph`), `dataset_sha256`, `weights_sha256` (of `model.weights.h5`) and, as the last entry,
`content_sha256` (see `surrogate.network.onnx_file`).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from onnx import TensorProto

from bem._support.outputs import whole_file
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS, measurement_grid
from surrogate.architectures.naming import split_name
from surrogate.architectures.registry import REGISTERED
from surrogate.data.features import NEEDS_MATERIAL, edge_from_counts
from surrogate.data.scaling import Scaling
from surrogate.export.channels import RATIO, scaled_channels
from surrogate.export.onnx_graph import EMITTERS, OnnxGraph
from surrogate.inference.keras_backend import KerasBackend, keras_model
from surrogate.inference.model_files import read_run, weights_sha256
from surrogate.network.graph import SEQUENCE, TABOR, Graph
from surrogate.network.lowering import NotExportableError, lower
from surrogate.network.onnx_file import ONNX_FORMAT, ONNX_FORMAT_VERSION, ONNX_NAME, checked_model, sealed

if TYPE_CHECKING:
    import keras
    import onnx

AGREEMENT = 1e-3
"""Largest difference between ONNX and Keras for a registered architecture, as a fraction of a history's force range."""


def export_folder(folder: Path) -> Path:
    """Write `model.onnx` into a model directory, from its weights and scaling.

    Returns:
        Path of the file.

    Raises:
        FileNotFoundError: the directory is not complete.
        NotExportableError: a registered architecture has a layer that cannot be exported.
        ValueError: the weights do not fit the architecture.
    """
    target = folder / ONNX_NAME
    with whole_file(target) as part:
        part.write_bytes(folder_content(folder))
    return target


def folder_content(folder: Path) -> bytes:
    """Return the bytes of the ONNX file of a model directory, from its weights and scaling.

    Raises:
        FileNotFoundError: the directory is not complete.
        NotExportableError: a registered architecture has a layer that cannot be exported.
        ValueError: the weights do not fit the architecture.
    """
    run, scaling = read_run(folder)
    model = keras_model(folder, run)
    graph = build_graph(
        model, scaling, name=run["name"], architecture=run["architecture"], weights_sha256=weights_sha256(folder)
    )
    content = graph.SerializeToString(deterministic=True)
    if split_name(run["architecture"])[0] in REGISTERED:
        _require_agreement(content, model, scaling)
    return sealed(content)


def _require_agreement(content: bytes, model: keras.Model, scaling: Scaling) -> None:
    """Compare an ONNX file with Keras on protocols inside the ranges. Tests do so for the 18 paper models.

    Raises:
        NotExportableError: they differ by more than `AGREEMENT`.
    """
    import onnxruntime

    protocols = {name: np.linspace(*scaling.ranges[name], 4)[1:] for name in QUANTITIES}
    times, indentations = measurement_grid(**protocols)
    arguments = {"times": times, "indentations": indentations, "tabor": protocols["tabor"]}
    arguments["edge"] = edge_from_counts(FMS, len(times))
    expected = KerasBackend(model, scaling).force(**arguments)
    (found,) = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"]).run(["force"], arguments)
    differences = np.abs(found - expected).max(axis=1) / np.ptp(expected, axis=1)
    if not differences.max() <= AGREEMENT:
        raise NotExportableError(
            f"Expected an ONNX file that agrees with Keras to {AGREEMENT:g} of the force's range. Received: one that "
            f"differs by {differences.max():.1e}, because a layer computes something else than its class says"
        )


def build_graph(
    model: keras.Model, scaling: Scaling, *, name: str, architecture: str, weights_sha256: str = ""
) -> onnx.ModelProto:
    """Return the ONNX model of a trained model and its scaling.

    Args:
        model: A model of `surrogate.build`.
        scaling: The scaling of its training set.
        name: Name under which the model is published.
        architecture: Name of the architecture.
        weights_sha256: SHA-256 sum of the weights file, for the metadata.

    Returns:
        The ONNX model, after ONNX's own check.

    Raises:
        NotExportableError: the model has layers unknown to `surrogate.network.lowering`.
        ValueError: the model has weights that are not finite, or its inputs need a modulus ratio that is not known.
    """
    network = lower(model)
    for weight, values in network.weights.items():
        if not np.isfinite(values).all():
            raise ValueError(f"Expected finite weights. Received: NaN or infinity in {weight} of {name}")
    graph = OnnxGraph()
    if scaling.features in NEEDS_MATERIAL:
        graph.initializers[RATIO] = np.array([scaling.known_modulus_ratio])
    sequence = scaled_channels(graph, scaling)
    mean, deviation = scaling.tabor
    tabor = graph.standardise(graph.symlog("tabor"), np.array(mean), np.array(deviation))
    tabor = graph.add("Unsqueeze", graph.cast(tabor, TensorProto.FLOAT), graph.integers([1]))

    results = {SEQUENCE: sequence, TABOR: tabor}
    graph.initializers |= network.weights
    for operation in network.operations:
        results[operation.name] = EMITTERS[operation.kind](graph, operation, [results[i] for i in operation.inputs])

    graph.unscaled_force(graph.add("Squeeze", results[network.output], graph.integers([2])), scaling.force)

    return checked_model(graph.finish(name), _metadata(network, scaling, name, architecture, weights_sha256))


def _metadata(network: Graph, scaling: Scaling, name: str, architecture: str, weights_sha256: str) -> dict[str, str]:
    return {
        "format": ONNX_FORMAT,
        "format_version": str(ONNX_FORMAT_VERSION),
        "name": name,
        "architecture": architecture,
        "features": scaling.features,
        "ranges": json.dumps(scaling.ranges),
        "scaling": scaling.to_json(),
        "plan": json.dumps([operation.as_dict() for operation in network.operations]),
        "dataset_sha256": scaling.dataset_sha256,
        "weights_sha256": weights_sha256,
    }

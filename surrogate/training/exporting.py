"""The ONNX file of a model directory, from its weights and scaling."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS, measurement_grid
from surrogate.architectures.naming import split_name
from surrogate.architectures.registry import REGISTERED
from surrogate.data.features import edge_from_counts
from surrogate.export.keras_layers import NotExportableError
from surrogate.export.onnx import file_content
from surrogate.prediction.files import read_run, weights_sha256
from surrogate.prediction.networks import OnnxNetwork, keras_network

AGREEMENT = 1e-3
"""Largest difference between ONNX and Keras for a registered architecture, as a fraction of a history's force range."""


def folder_content(folder: Path) -> bytes:
    """Return the bytes of the ONNX file of a model directory.

    Raises:
        FileNotFoundError: the directory is not complete.
        NotExportableError: a registered architecture has a layer that cannot be exported, or that computes otherwise in
            ONNX Runtime than in Keras.
        ValueError: the weights do not fit the architecture.
    """
    run, scaling = read_run(folder)
    network = keras_network(folder, run, scaling)
    content = file_content(
        network.model,
        scaling,
        name=run["name"],
        architecture=run["architecture"],
        weights_sha256=weights_sha256(folder),
    )
    if split_name(run["architecture"])[0] in REGISTERED:  # tests compare the 18 paper models with Keras
        protocols = {name: np.linspace(*scaling.ranges[name], 4)[1:] for name in QUANTITIES}
        given = (*measurement_grid(**protocols), protocols["tabor"], None, edge_from_counts(FMS, 3))
        expected, found = network.force(*given), OnnxNetwork(content, scaling, run["name"]).force(*given)
        differences = np.abs(found - expected).max(axis=1) / np.ptp(expected, axis=1)
        if not differences.max() <= AGREEMENT:
            raise NotExportableError(
                f"Expected an ONNX file that agrees with Keras to {AGREEMENT:g} of the force's range. Received: one "
                f"that differs by {differences.max():.1e}, because a layer computes something else than its class says"
            )
    return content

"""Backends of a prediction: ONNX Runtime, which starts quickly, and Keras, whose models can be differentiated.

Both map times, indentations and edge marks of shape `(batch, steps)` and Tabor parameters of shape `(batch,)` to forces
of shape `(batch, steps)`. All are physical (not scaled) and float64.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from surrogate.data.scaling import Scaling
from surrogate.inference.keras_backend import KerasBackend, keras_model
from surrogate.inference.model_files import existing, read_run
from surrogate.inference.onnx_backend import OnnxBackend, require_exported
from surrogate.network.graph import Graph
from surrogate.network.onnx_file import ONNX_NAME

BACKENDS = ("onnx", "keras")


class Backend(Protocol):
    """Interface of a backend of `surrogate.Surrogate`."""

    name: str
    scaling: Scaling

    def force(self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Return the physical forces of shape `(batch, steps)`."""
        ...

    def graph(self) -> Graph:
        """Return the network as a graph of elementary operations."""
        ...


def load_backend(place: Path, backend: str, threads: int) -> Backend:
    """Load a model directory or an ONNX file.

    Args:
        place: Path of the directory or the file.
        backend: `"onnx"` or `"keras"`.
        threads: Number of threads of ONNX Runtime.

    Raises:
        FileNotFoundError: a file is missing.
        ModuleNotFoundError: Keras is not installed, and the backend is `"keras"`.
        ValueError: as for `surrogate.load`.
    """
    if place.is_file():
        if backend != "onnx":
            raise ValueError(f"Expected a model directory for the {backend} backend. Received: {place}")
        return OnnxBackend(place, threads)
    run, scaling = read_run(place)
    if backend == "keras":
        require_exported(place, scaling)
        return KerasBackend(keras_model(place, run), scaling, name=run["name"])
    if not (place / ONNX_NAME).is_file():
        existing(place / "model.weights.h5")
        raise FileNotFoundError(
            f"Expected {ONNX_NAME} in {place}; write it with `surrogate export {place}`, or load with backend='keras'. "
            f"Received: no such file"
        )
    loaded = OnnxBackend(place / ONNX_NAME, threads)
    loaded.require_weights_of(place)
    loaded.require_scaling(scaling)
    return loaded

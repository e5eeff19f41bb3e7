"""Prediction by Keras, whose models can be differentiated and trained further."""

from __future__ import annotations

import importlib
import importlib.util
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from surrogate.architectures import build
from surrogate.architectures.registry import require_source
from surrogate.backend import import_keras
from surrogate.data.features import channels
from surrogate.data.scaling import Scaling
from surrogate.inference.model_files import existing
from surrogate.network.graph import Graph
from surrogate.network.lowering import lower

if TYPE_CHECKING:
    import keras

EVALUATION_BATCH = 512
"""Trajectories in a batch."""

TRAINING_EXTRA = "Keras is not installed; install it with `pip install 'contact-trajectories[train]'`"


def predict_scaled(model: keras.Model, sequence: np.ndarray, tabor: np.ndarray) -> np.ndarray:
    """Return the scaled force of a model, shape `(batch, steps)`, float32.

    Args:
        model: A model of `surrogate.build`.
        sequence: Scaled channels of shape `(batch, steps, channels)`.
        tabor: Scaled Tabor parameters of shape `(batch, 1)`.
    """
    chunks = [
        np.asarray(
            model.predict_on_batch(
                [sequence[start : start + EVALUATION_BATCH], tabor[start : start + EVALUATION_BATCH]]
            )
        )
        for start in range(0, len(sequence), EVALUATION_BATCH)
    ]
    return np.concatenate(chunks)[..., 0]


class KerasBackend:
    """A Keras model with its scaling.

    Args:
        model: A trained model of `surrogate.build`.
        scaling: The scaling of its training set.
        name: Name of the model in messages.
    """

    def __init__(self, model: keras.Model, scaling: Scaling, name: str = "surrogate") -> None:
        self.model = model
        self.scaling = scaling
        self.name = name

    def __reduce__(self) -> tuple[Any, ...]:
        return _keras_backend, (self.model.get_config(), self.model.get_weights(), self.scaling, self.name)

    def force(self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Return the physical forces of shape `(batch, steps)`."""
        scaling = self.scaling
        found = channels(times, indentations, edge, scaling.features, tabor=tabor, modulus_ratio=scaling.modulus_ratio)
        sequence = scaling.scale_channels(found)
        return self.force_from_channels(sequence, self.scaling.scale_tabor(tabor))

    def force_from_channels(self, sequence: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        """Return the physical forces of shape `(batch, steps)` from scaled inputs.

        Args:
            sequence: Scaled channels of shape `(batch, steps, channels)`.
            tabor: Scaled Tabor parameters of shape `(batch, 1)`.
        """
        return self.scaling.unscale_force(predict_scaled(self.model, sequence, tabor))

    @cached_property
    def _graph(self) -> Graph:
        return lower(self.model)

    def graph(self) -> Graph:
        """Return the network as a graph of elementary operations.

        Raises:
            NotExportableError: a layer cannot be expressed in elementary operations.
        """
        return self._graph


def _keras_backend(config: dict[str, Any], weights: list[np.ndarray], scaling: Scaling, name: str) -> KerasBackend:
    """Return the backend that was pickled."""
    import_keras()
    import keras

    # The import registers the layers of these modules with Keras.
    importlib.import_module("surrogate.architectures.blocks")
    importlib.import_module("surrogate.architectures.layers")
    model = keras.Model.from_config(config)
    model.set_weights(weights)
    return KerasBackend(model, scaling, name)


def keras_model(folder: Path, run: dict[str, Any]) -> keras.Model:
    """Return the model of a model directory, with its weights.

    Args:
        folder: The model directory.
        run: The content of its `run.json`.

    Raises:
        FileNotFoundError: the weights file is missing.
        ModuleNotFoundError: Keras is not installed.
        ValueError: the weights do not fit, or the architecture is not the registered one of the training.
    """
    if importlib.util.find_spec("keras") is None:
        raise ModuleNotFoundError(f"{TRAINING_EXTRA}, or load with backend='onnx'", name="keras")
    # This module imports h5py, which predictions by ONNX Runtime do not need.
    from surrogate.inference.weights import load_weights

    require_source(run)
    model = build(run["architecture"], features=run["features"])
    load_weights(model, existing(folder / "model.weights.h5"))
    return model

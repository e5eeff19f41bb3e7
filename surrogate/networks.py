"""The networks behind a predictor: an ONNX file, or a Keras model.

Both map times, indentations and edge marks of shape `(batch, steps)` and Tabor parameters of shape `(batch,)` to forces
of shape `(batch, steps)`. All are physical (not scaled) and float64. The file computes features and scaling itself.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.wording import shortened
from surrogate.architectures import build
from surrogate.architectures.registry import require_source
from surrogate.data.features import channels
from surrogate.data.scaling import Scaling
from surrogate.files import WEIGHTS, read_intact
from surrogate.onnx.file import session_of

if TYPE_CHECKING:
    import keras

FILE_BATCH, KERAS_BATCH = 256, 512
"""Trajectories in a batch. Larger ones do not fit into the caches and are not faster."""

BLOCKS = {"residual_tcn_block", "encoder_block"}
"""Groups of weights files in which a block of M4 or M5 was one layer; now its layers are the model's own."""

TRAINING_EXTRA = "Keras is not installed; install it with `pip install '.[train]'` in a clone of the repository"


class Network:
    """What a `surrogate.Surrogate` asks for forces.

    Args:
        scaling: The scaling of the training set.
        name: Name of the model in messages.
    """

    batch: int

    def __init__(self, scaling: Scaling, name: str) -> None:
        self.scaling, self.name = scaling, name

    def force(self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Return the physical forces of shape `(batch, steps)`.

        Raises:
            ValueError: the backend cannot compute them, for example because attention over a long history exceeds the
                memory.
        """
        inputs = [times, indentations, tabor, edge]
        parts = [
            self._force(*(array[at : at + self.batch] for array in inputs)) for at in range(0, len(times), self.batch)
        ]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _force(self, times: Any, indentations: Any, tabor: Any, edge: Any) -> np.ndarray:
        """Return the forces of one batch."""
        raise NotImplementedError


class OnnxNetwork(Network):
    """A file of `surrogate.onnx.export`, and its session.

    A pickled one carries the file, which another process may lack.
    """

    batch = FILE_BATCH

    def __init__(self, model_bytes: bytes, scaling: Scaling, name: str, threads: int = 1, session: Any = None) -> None:
        super().__init__(scaling, name)
        self._content, self.threads, self.session = model_bytes, threads, session or session_of(model_bytes, threads)

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"session": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, session=session_of(state["_content"], state["threads"]))

    def _force(self, times: Any, indentations: Any, tabor: Any, edge: Any) -> np.ndarray:
        arrays = {"times": times, "indentations": indentations, "tabor": tabor, "edge": edge}
        inputs = {name: np.ascontiguousarray(values, dtype=np.float64) for name, values in arrays.items()}
        try:
            forces: np.ndarray = self.session.run(["force"], inputs)[0]
        except Exception as error:
            raise ValueError(
                f"histories must fit {self.name} and the memory; received shape {times.shape} ({shortened(str(error))})"
            ) from error
        return forces


class KerasNetwork(Network):
    """A Keras model of `surrogate.build`, which can be differentiated and trained further."""

    batch = KERAS_BATCH

    def __init__(self, model: keras.Model, scaling: Scaling, name: str = "surrogate") -> None:
        super().__init__(scaling, name)
        self.model = model

    def _force(self, times: Any, indentations: Any, tabor: Any, edge: Any) -> np.ndarray:
        sequence = self.scaling.scale_channels(channels(times, indentations, edge, self.scaling.features))
        return self.scaling.unscale_force(self.scaled(sequence, self.scaling.scale_tabor(tabor)))

    def scaled(self, sequence: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        """Return the scaled force of shape `(batch, steps)`.

        Args:
            sequence: Scaled channels of shape `(batch, steps, channels)`.
            tabor: Scaled Tabor parameters of shape `(batch, 1)`.
        """
        return np.asarray(self.model.predict_on_batch([sequence, tabor]))[..., 0]


def keras_network(folder: Path, run: dict[str, Any], scaling: Scaling) -> KerasNetwork:
    """Return the Keras model of a model directory, with its weights, from what `read_run` returns.

    Raises:
        FileNotFoundError: the weights file is missing.
        ModuleNotFoundError: Keras is not installed.
        ValueError: the weights are damaged or do not fit, or the architecture is not the registered one.
    """
    if importlib.util.find_spec("keras") is None:
        raise ModuleNotFoundError(f"{TRAINING_EXTRA}, or load with backend='onnx'", name="keras")
    require_source(run)
    model = build(run["architecture"], features=run["features"])
    read_intact(folder / WEIGHTS, run)
    load_weights(model, folder / WEIGHTS)
    return KerasNetwork(model, scaling, run["name"])


def load_weights(model: keras.Model, path: Path) -> None:
    """Set the weights of a model from a `.weights.h5` file.

    Raises:
        ValueError: the file is damaged, its weights do not fit the model, or a weight is not finite.
    """
    # Predictions by ONNX Runtime do not need them.
    import h5py

    from bem.dataset.sealed_file import arrays

    expected = f"weights of {model.name} must be {model.count_params()} finite numbers"
    try:
        # Keras ignores weights of layers that the model does not have.
        with h5py.File(path, "r") as file:
            size = sum(item.size for _, item in arrays(file))
            if size != model.count_params():
                raise ValueError(f"{size} parameters")
            by_layer = _by_layer(file["layers"]) if BLOCKS & file["layers"].keys() else {}
        if by_layer:
            layers = (weight.path.rpartition("/")[0].replace("/", "_") for weight in model.weights)
            model.set_weights([by_layer[layer].pop(0) for layer in layers])
        else:
            model.load_weights(path)
    except Exception as error:  # for a damaged file, the libraries raise errors of many kinds
        reason = shortened(str(error)) or type(error).__name__
        raise ValueError(f"{expected}; received {path} ({reason})") from error
    for weight in model.weights:
        if not np.isfinite(np.asarray(weight)).all():
            raise ValueError(f"{expected}; received {path} (NaN or infinity in {weight.path})")


def _by_layer(group: Any, name: str = "") -> dict[str, list[np.ndarray]]:
    """Return the arrays of a weights file, by the names of block, layer and part, such as `block_1_attention_query`."""
    arrays = {}
    for key, item in group.items():
        if key == "vars":
            arrays[name] = [item[str(index)][()] for index in range(len(item))]
        else:
            arrays |= _by_layer(item, f"{name}_{item['vars'].attrs['name']}".lstrip("_"))
    return arrays

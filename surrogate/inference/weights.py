"""Reading of weights files, with stricter checks than Keras's."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from bem._support.wording import shortened
from bem.dataset.hdf5_arrays import arrays

if TYPE_CHECKING:
    import keras


def load_weights(model: keras.Model, path: Path) -> None:
    """Set the weights of a model from a `.weights.h5` file.

    Raises:
        ValueError: the file is damaged, its weights do not fit the model, or a weight is not finite.
    """
    expected = f"Expected weights of {model.name} with {model.count_params()} parameters"
    try:
        # Keras ignores weights of layers that the model does not have.
        with h5py.File(path, "r") as file:
            size = sum(item.size for _, item in arrays(file))
        if size != model.count_params():
            raise ValueError(f"{size} parameters")
        model.load_weights(path)
    except Exception as error:  # for a damaged file, the libraries raise errors of many kinds
        reason = shortened(str(error)) or type(error).__name__
        raise ValueError(f"{expected}. Received: {path} ({reason})") from error
    for weight in model.weights:
        if not np.isfinite(np.asarray(weight)).all():
            raise ValueError(f"{expected}, all finite. Received: {path} (NaN or infinity in {weight.path})")

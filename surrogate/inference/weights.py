"""Weights from a file into a model, checked more strictly than Keras does."""

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
    """Read weights into a model.

    Raises:
        ValueError: the file holds other weights than the model has, or some that are not finite.
    """
    expected = f"Expected weights of {model.name} with {model.count_params()} parameters"
    try:
        # Keras leaves weights of layers the model lacks unread, without a word.
        with h5py.File(path, "r") as file:
            size = sum(item.size for _, item in arrays(file))
        if size != model.count_params():
            raise ValueError(f"{size} parameters")
        model.load_weights(path)
    except Exception as error:  # of a damaged file the libraries may say anything
        reason = shortened(str(error)) or type(error).__name__
        raise ValueError(f"{expected}. Received: {path} ({reason})") from error
    for weight in model.weights:
        if not np.isfinite(np.asarray(weight)).all():
            raise ValueError(f"{expected}, all finite. Received: {path} (NaN or infinity in {weight.path})")

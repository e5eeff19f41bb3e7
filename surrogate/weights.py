"""Weights from a file into a model, checked more strictly than Keras does."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import h5py

if TYPE_CHECKING:
    import keras


def load_weights(model: keras.Model, path: Path) -> None:
    """Read weights into a model.

    Raises:
        ValueError: the file holds other weights than the model has.
    """
    expected = f"Expected weights of {model.name} with {model.count_params()} parameters"
    try:
        # Keras leaves weights of layers the model lacks unread, without a word.
        with h5py.File(path, "r") as file:
            sizes = []
            file.visititems(lambda _, item: sizes.append(item.size) if isinstance(item, h5py.Dataset) else None)
        if sum(sizes) != model.count_params():
            raise ValueError(f"{sum(sizes)} parameters")
        model.load_weights(path)
    except (ValueError, KeyError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise ValueError(f"{expected}. Received: {path} ({reason})") from error

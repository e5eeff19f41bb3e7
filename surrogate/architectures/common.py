"""What all families share: the two inputs and the readout."""

from __future__ import annotations

from typing import Any

import keras
from keras import layers

from surrogate.data.features import channel_names

READOUT_WIDTH = 64


def inputs(features: str) -> tuple[Any, Any]:
    """Make the scaled sequence input of shape `(batch, steps, channels)` and the Tabor input of shape `(batch, 1)`."""
    sequence = keras.Input((None, len(channel_names(features))), name="sequence")
    tabor = keras.Input((1,), name="tabor")
    return sequence, tabor


def readout(hidden: Any) -> Any:
    """Map every step's features to one scaled force, by the same two dense layers at all steps.

    `Dense` on a 3D tensor is the paper's time-distributed dense layer: same map, same weights.
    """
    hidden = layers.Dense(READOUT_WIDTH, activation="relu", name="readout_hidden")(hidden)
    return layers.Dense(1, name="force")(hidden)

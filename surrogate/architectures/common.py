"""What all families share: the inputs and the readout."""

from __future__ import annotations

from typing import Any

import keras
from keras import layers

from surrogate.architectures.naming import CONDITIONINGS
from surrogate.data.features import channel_names

READOUT_WIDTH = 64
"""Units of the hidden layer of the readout."""


def inputs(features: str, conditioning: str = "concat") -> tuple[Any, Any]:
    """Return the two inputs of a model, for scaled quantities.

    Args:
        features: The feature set of the sequence.
        conditioning: How the model includes the Tabor parameter; the inputs are the same for all.

    Returns:
        The input `sequence` of shape `(batch, steps, channels)` and the input `tabor` of shape `(batch, 1)`.

    Raises:
        ValueError: the feature set or the conditioning is unknown.
    """
    if conditioning not in CONDITIONINGS:
        raise ValueError(f"conditioning must be one of {', '.join(CONDITIONINGS)}; received {conditioning!r}")
    sequence = keras.Input((None, len(channel_names(features))), name="sequence")
    tabor = keras.Input((1,), name="tabor")
    return sequence, tabor


def readout(hidden: Any) -> Any:
    """Return the scaled force of shape `(batch, steps, 1)` from features of shape `(batch, steps, features)`.

    Source: the paper's appendix "Neural Network Layer Definitions", section "TimeDistributed Dense layer". `Dense` on a
    3D tensor is that layer: it applies the same weights at all steps.
    """
    hidden = layers.Dense(READOUT_WIDTH, activation="relu", name="readout_hidden")(hidden)
    return layers.Dense(1, name="force")(hidden)

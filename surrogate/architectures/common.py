"""What all families share: inputs, readout, and the usual places of the Tabor parameter."""

from __future__ import annotations

from typing import Any

import keras
from keras import layers

from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.data.features import channel_names

READOUT_WIDTH = 64
"""Units of the hidden layer of the readout."""


def inputs(features: str) -> tuple[Any, Any]:
    """Return the two inputs of a model, for scaled quantities.

    Args:
        features: The feature set of the sequence.

    Returns:
        The input `sequence` of shape `(batch, steps, channels)` and the input `tabor` of shape `(batch, 1)`.

    Raises:
        ValueError: the feature set is unknown.
    """
    sequence = keras.Input((None, len(channel_names(features))), name="sequence")
    tabor = keras.Input((1,), name="tabor")
    return sequence, tabor


def appended(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the sequence, for `"concat"` with the Tabor parameter as one more channel."""
    return AppendTabor(name="append_tabor")(sequence, tabor) if conditioning == "concat" else sequence


def modulated_or_normalised(hidden: Any, tabor: Any, conditioning: str) -> Any:
    """Return features, for `"FiLM"` modulated, and for `"gated"` combined with their layer normalisation."""
    if conditioning == "FiLM":
        return FiLM(name="film")(hidden, tabor)
    if conditioning == "gated":
        return TaborGate(name="gate")(hidden, layers.LayerNormalization(name="normalisation")(hidden), tabor)
    return hidden


def readout(hidden: Any) -> Any:
    """Return the scaled force of shape `(batch, steps, 1)` from features of shape `(batch, steps, features)`.

    Source: the paper's appendix "Neural Network Layer Definitions", section "TimeDistributed Dense layer". `Dense` on a
    3D tensor is that layer: it applies the same weights at all steps.
    """
    hidden = layers.Dense(READOUT_WIDTH, activation="relu", name="readout_hidden")(hidden)
    return layers.Dense(1, name="force")(hidden)

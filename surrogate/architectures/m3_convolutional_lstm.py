"""M3: two causal convolutions before one LSTM layer.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.naming import check_conditioning


def convolutional_lstm(conditioning: str = "concat", features: str = "D", name: str | None = None) -> keras.Model:
    """Return an untrained M3 model.

    FiLM modulates the output of the LSTM. The gate combines that output with its layer normalisation.

    Args:
        conditioning: `"concat"`, `"FiLM"` or `"gated"`.
        features: The feature set of the sequence input, `"A"` to `"D"`.
        name: Name of the model.

    Raises:
        ValueError: the conditioning or the feature set is unknown.
    """
    check_conditioning(conditioning)
    sequence, tabor = inputs(features)

    hidden = sequence
    if conditioning == "concat":
        hidden = AppendTabor(name="append_tabor")(hidden, tabor)
    hidden = layers.Conv1D(64, 3, padding="causal", activation="relu", name="convolution_1")(hidden)
    hidden = layers.Conv1D(128, 3, padding="causal", activation="relu", name="convolution_2")(hidden)
    hidden = layers.LSTM(128, return_sequences=True, name="lstm")(hidden)
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    elif conditioning == "gated":
        normalised = layers.LayerNormalization(name="normalisation")(hidden)
        hidden = TaborGate(name="gate")(hidden, normalised, tabor)

    return keras.Model([sequence, tabor], readout(hidden), name=name)

"""M3: two causal convolutions before one LSTM layer.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate


def m3_convolutional_lstm(
    conditioning: str = "concat", *, features: str = "D", name: str | None = None, units: int = 128
) -> keras.Model:
    """Return an untrained M3, as in panel (c) of the paper's figure; see `m1_lstm` for arguments and errors.

    `"FiLM"` modulates the output of the LSTM. `"gated"` combines that output with its layer normalisation.
    `units`, of the LSTM and the second convolution, and half as many of the first are a guess.
    """
    sequence, tabor = inputs(features, conditioning)
    hidden = AppendTabor(name="append_tabor")(sequence, tabor) if conditioning == "concat" else sequence
    hidden = layers.Conv1D(units // 2, 3, padding="causal", activation="relu", name="convolution_1")(hidden)
    hidden = layers.Conv1D(units, 3, padding="causal", activation="relu", name="convolution_2")(hidden)
    hidden = layers.LSTM(units, return_sequences=True, name="lstm")(hidden)
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    elif conditioning == "gated":
        hidden = TaborGate(name="gate")(hidden, layers.LayerNormalization(name="normalisation")(hidden), tabor)
    return keras.Model([sequence, tabor], readout(hidden), name=name or f"M3-{conditioning}")

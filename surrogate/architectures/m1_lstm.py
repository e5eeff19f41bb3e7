"""M1: two LSTM layers and the readout. All three parameter counts are the paper's."""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.naming import check_conditioning


def lstm(conditioning: str = "concat", features: str = "D", name: str | None = None) -> keras.Model:
    """Build M1.

    Concatenated, the Tabor parameter joins the input channels; under FiLM it modulates the second LSTM's output. The
    gated model is of another kind: two LSTM experts side by side, mixed by the gate.

    Args:
        conditioning: `"concat"`, `"FiLM"` or `"gated"`.
        features: The feature set of the sequence input.
        name: The model's name.
    """
    check_conditioning(conditioning)
    sequence, tabor = inputs(features)

    if conditioning == "gated":
        first = layers.LSTM(128, return_sequences=True, name="expert_1")(sequence)
        second = layers.LSTM(128, return_sequences=True, name="expert_2")(sequence)
        hidden = TaborGate(name="gate")(first, second, tabor)
    else:
        hidden = sequence
        if conditioning == "concat":
            hidden = AppendTabor(name="append_tabor")(hidden, tabor)
        hidden = layers.LSTM(256, return_sequences=True, name="lstm_1")(hidden)
        hidden = layers.LSTM(128, return_sequences=True, name="lstm_2")(hidden)
        if conditioning == "FiLM":
            hidden = FiLM(name="film")(hidden, tabor)

    return keras.Model([sequence, tabor], readout(hidden), name=name)

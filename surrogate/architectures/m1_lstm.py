"""M1: two LSTM layers and the readout. The parameter counts are those of the paper."""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.naming import check_conditioning


def lstm(conditioning: str = "concat", features: str = "D", name: str | None = None) -> keras.Model:
    """Return an untrained M1 model.

    With `"concat"`, the Tabor parameter is an input channel. FiLM modulates the output of the second LSTM. The gated
    model differs from the others: the gate combines two parallel LSTM layers.

    Args:
        conditioning: `"concat"`, `"FiLM"` or `"gated"`.
        features: The feature set of the sequence input, `"A"` to `"D"`.
        name: Name of the model.

    Raises:
        ValueError: the conditioning or the feature set is unknown.
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

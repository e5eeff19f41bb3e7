"""M1: two LSTM layers. The parameter counts are those of the paper."""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate


def m1_lstm(conditioning: str = "concat", *, features: str = "D", name: str | None = None) -> keras.Model:
    """Return an untrained M1, as in panel (a) of the paper's figure of all architectures.

    Args:
        conditioning: `"concat"` makes the Tabor parameter an input channel, `"FiLM"` modulates the output of the second
            LSTM. `"gated"` differs from the others: the gate combines two parallel LSTM layers.
        features: Feature set of the sequence, `"A"` to `"F"`.
        name: Name of the model; by default `"M1-concat"` and so on.

    Returns:
        A functional model of the inputs and the output that `surrogate.build` describes.

    Raises:
        ValueError: the conditioning or the feature set is unknown.
    """
    sequence, tabor = inputs(features, conditioning)
    if conditioning == "gated":
        first = layers.LSTM(128, return_sequences=True, name="expert_1")(sequence)
        second = layers.LSTM(128, return_sequences=True, name="expert_2")(sequence)
        hidden = TaborGate(name="gate")(first, second, tabor)
    else:
        hidden = AppendTabor(name="append_tabor")(sequence, tabor) if conditioning == "concat" else sequence
        hidden = layers.LSTM(256, return_sequences=True, name="lstm_1")(hidden)
        hidden = layers.LSTM(128, return_sequences=True, name="lstm_2")(hidden)
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    return keras.Model([sequence, tabor], readout(hidden), name=name or f"M1-{conditioning}")

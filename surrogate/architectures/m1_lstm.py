"""M1: two LSTM layers. The parameter counts are those of the paper."""

from __future__ import annotations

from typing import Any

from keras import layers

from surrogate.architectures.common import appended
from surrogate.architectures.layers import FiLM, TaborGate


def lstm(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M1 at each step.

    With `"concat"`, the Tabor parameter is an input channel. FiLM modulates the output of the second LSTM. The gated
    model differs from the others: the gate combines two parallel LSTM layers.
    """
    if conditioning == "gated":
        first = layers.LSTM(128, return_sequences=True, name="expert_1")(sequence)
        second = layers.LSTM(128, return_sequences=True, name="expert_2")(sequence)
        return TaborGate(name="gate")(first, second, tabor)
    hidden = appended(sequence, tabor, conditioning)
    hidden = layers.LSTM(256, return_sequences=True, name="lstm_1")(hidden)
    hidden = layers.LSTM(128, return_sequences=True, name="lstm_2")(hidden)
    return FiLM(name="film")(hidden, tabor) if conditioning == "FiLM" else hidden

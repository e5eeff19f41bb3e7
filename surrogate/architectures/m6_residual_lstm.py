"""M6: the normalised sum of two LSTM layers, then a third.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

from typing import Any

from keras import layers

from surrogate.architectures.common import appended
from surrogate.architectures.layers import FiLM, TaborGate


def residual_lstm(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M6 at each step.

    FiLM modulates the output of the last LSTM. The gate combines the sum of both paths with its layer normalisation,
    before the last LSTM.
    """
    hidden = appended(sequence, tabor, conditioning)
    first = layers.LSTM(128, return_sequences=True, name="lstm_1")(hidden)
    second = layers.LSTM(128, return_sequences=True, name="lstm_2")(first)
    total = layers.Add(name="add")([first, second])
    hidden = layers.LayerNormalization(name="normalisation")(total)
    if conditioning == "gated":
        hidden = TaborGate(name="gate")(total, hidden, tabor)
    hidden = layers.LSTM(128, return_sequences=True, name="lstm_3")(hidden)
    return FiLM(name="film")(hidden, tabor) if conditioning == "FiLM" else hidden

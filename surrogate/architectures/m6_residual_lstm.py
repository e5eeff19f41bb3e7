"""M6: the normalised sum of two LSTM layers, then a third.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate


def m6_residual_lstm(
    conditioning: str = "concat", *, features: str = "D", name: str | None = None, units: int = 128
) -> keras.Model:
    """Return an untrained M6, as in panel (f) of the paper's figure; see `m1_lstm` for arguments and errors.

    `"FiLM"` modulates the output of the last LSTM. `"gated"` combines the sum of both paths with its layer
    normalisation, before the last LSTM. `units`, of each LSTM, are a guess.
    """
    sequence, tabor = inputs(features, conditioning)
    hidden = AppendTabor(name="append_tabor")(sequence, tabor) if conditioning == "concat" else sequence
    first = layers.LSTM(units, return_sequences=True, name="lstm_1")(hidden)
    second = layers.LSTM(units, return_sequences=True, name="lstm_2")(first)
    total = layers.Add(name="add")([first, second])
    hidden = layers.LayerNormalization(name="normalisation")(total)
    if conditioning == "gated":
        hidden = TaborGate(name="gate")(total, hidden, tabor)
    hidden = layers.LSTM(units, return_sequences=True, name="lstm_3")(hidden)
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    return keras.Model([sequence, tabor], readout(hidden), name=name or f"M6-{conditioning}")

"""M6: the normalised sum of two LSTM layers, then a third.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.naming import check_conditioning


def residual_lstm(conditioning: str = "concat", features: str = "D", name: str | None = None) -> keras.Model:
    """Return an untrained M6 model.

    FiLM modulates the output of the last LSTM. The gate combines the sum of both paths with its layer normalisation,
    before the last LSTM.

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
    first = layers.LSTM(128, return_sequences=True, name="lstm_1")(hidden)
    second = layers.LSTM(128, return_sequences=True, name="lstm_2")(first)
    total = layers.Add(name="add")([first, second])
    hidden = layers.LayerNormalization(name="normalisation")(total)
    if conditioning == "gated":
        hidden = TaborGate(name="gate")(total, hidden, tabor)
    hidden = layers.LSTM(128, return_sequences=True, name="lstm_3")(hidden)
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)

    return keras.Model([sequence, tabor], readout(hidden), name=name)

"""M2: two LSTM layers, each followed by layer normalisation.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.naming import check_conditioning


def normalised_lstm(conditioning: str = "concat", features: str = "D", name: str | None = None) -> keras.Model:
    """Return an untrained M2 model.

    FiLM modulates the output of the last normalisation. The gate combines the output of the second LSTM before and
    after normalisation.

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
    hidden = layers.LSTM(256, return_sequences=True, name="lstm_1")(hidden)
    hidden = layers.LayerNormalization(name="normalisation_1")(hidden)
    recurrent = layers.LSTM(128, return_sequences=True, name="lstm_2")(hidden)
    hidden = layers.LayerNormalization(name="normalisation_2")(recurrent)
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    elif conditioning == "gated":
        hidden = TaborGate(name="gate")(recurrent, hidden, tabor)

    return keras.Model([sequence, tabor], readout(hidden), name=name)

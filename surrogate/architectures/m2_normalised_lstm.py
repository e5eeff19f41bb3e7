"""M2: two LSTM layers, each followed by layer normalisation.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate


def m2_normalised_lstm(
    conditioning: str = "concat", *, features: str = "D", name: str | None = None, units: int = 128
) -> keras.Model:
    """Return an untrained M2, as in panel (b) of the paper's figure; see `m1_lstm` for arguments and errors.

    `"FiLM"` modulates the output of the last normalisation. `"gated"` combines the output of the second LSTM before and
    after normalisation. `units`, of the second LSTM, and twice as many of the first are a guess.
    """
    sequence, tabor = inputs(features, conditioning)
    hidden = AppendTabor(name="append_tabor")(sequence, tabor) if conditioning == "concat" else sequence
    hidden = layers.LSTM(2 * units, return_sequences=True, name="lstm_1")(hidden)
    hidden = layers.LayerNormalization(name="normalisation_1")(hidden)
    recurrent = layers.LSTM(units, return_sequences=True, name="lstm_2")(hidden)
    hidden = layers.LayerNormalization(name="normalisation_2")(recurrent)
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    elif conditioning == "gated":
        hidden = TaborGate(name="gate")(recurrent, hidden, tabor)
    return keras.Model([sequence, tabor], readout(hidden), name=name or f"M2-{conditioning}")

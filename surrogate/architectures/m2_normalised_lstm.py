"""M2: two LSTM layers, each followed by layer normalisation.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

from typing import Any

from keras import layers

from surrogate.architectures.common import appended
from surrogate.architectures.layers import FiLM, TaborGate


def normalised_lstm(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M2 at each step.

    FiLM modulates the output of the last normalisation. The gate combines the output of the second LSTM before and
    after normalisation.
    """
    hidden = appended(sequence, tabor, conditioning)
    hidden = layers.LSTM(256, return_sequences=True, name="lstm_1")(hidden)
    hidden = layers.LayerNormalization(name="normalisation_1")(hidden)
    recurrent = layers.LSTM(128, return_sequences=True, name="lstm_2")(hidden)
    hidden = layers.LayerNormalization(name="normalisation_2")(recurrent)
    if conditioning == "FiLM":
        return FiLM(name="film")(hidden, tabor)
    return TaborGate(name="gate")(recurrent, hidden, tabor) if conditioning == "gated" else hidden

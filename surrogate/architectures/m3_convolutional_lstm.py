"""M3: two causal convolutions before one LSTM layer.

The paper does not state the parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

from typing import Any

from keras import layers

from surrogate.architectures.common import appended, modulated_or_normalised


def convolutional_lstm(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M3 at each step.

    FiLM modulates the output of the LSTM. The gate combines that output with its layer normalisation.
    """
    hidden = appended(sequence, tabor, conditioning)
    hidden = layers.Conv1D(64, 3, padding="causal", activation="relu", name="convolution_1")(hidden)
    hidden = layers.Conv1D(128, 3, padding="causal", activation="relu", name="convolution_2")(hidden)
    hidden = layers.LSTM(128, return_sequences=True, name="lstm")(hidden)
    return modulated_or_normalised(hidden, tabor, conditioning)

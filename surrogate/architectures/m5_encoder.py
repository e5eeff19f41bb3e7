"""M5: a transformer encoder.

The paper calls M5 an encoder, so each step attends to all steps, and the model is not causal: it needs the whole
history. There is no positional encoding; the time channel increases along each history. The paper does not state the
parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

from typing import Any

from keras import layers

from surrogate.architectures.blocks import EncoderBlock
from surrogate.architectures.common import appended, modulated_or_normalised


def encoder(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M5 at each step.

    FiLM modulates the output of the second block. The gate combines that output with its layer normalisation.
    """
    hidden = layers.Dense(128, name="projection")(appended(sequence, tabor, conditioning))
    hidden = EncoderBlock(name="block_1")(hidden)
    hidden = EncoderBlock(name="block_2")(hidden)
    return modulated_or_normalised(hidden, tabor, conditioning)

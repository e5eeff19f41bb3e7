"""M5: a transformer encoder.

The paper calls M5 an encoder, so each step attends to all steps, and the model is not causal: it needs the whole
history. There is no positional encoding; the time channel increases along each history. The paper does not state the
parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.blocks import EncoderBlock
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.naming import check_conditioning


def encoder(conditioning: str = "concat", features: str = "D", name: str | None = None) -> keras.Model:
    """Return an untrained M5 model.

    FiLM modulates the output of the second block. The gate combines that output with its layer normalisation.

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
    hidden = layers.Dense(128, name="projection")(hidden)
    hidden = EncoderBlock(name="block_1")(hidden)
    hidden = EncoderBlock(name="block_2")(hidden)
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    elif conditioning == "gated":
        normalised = layers.LayerNormalization(name="normalisation")(hidden)
        hidden = TaborGate(name="gate")(hidden, normalised, tabor)

    return keras.Model([sequence, tabor], readout(hidden), name=name)

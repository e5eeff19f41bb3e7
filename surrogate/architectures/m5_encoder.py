"""M5: a transformer encoder. Parameter counts follow our reading of the paper.

The paper calls M5 an encoder, so attention runs both ways and the model is not causal: it sees the whole protocol
before it answers. Nothing encodes a step's position but the time channel, which grows along every history.
"""

from __future__ import annotations

import keras
from keras import layers

from surrogate.architectures.blocks import EncoderBlock
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.naming import check_conditioning


def encoder(conditioning: str = "concat", features: str = "D", name: str | None = None) -> keras.Model:
    """Build M5.

    FiLM modulates the second block's output; the gate mixes that output with its normalised self.

    Args:
        conditioning: `"concat"`, `"FiLM"` or `"gated"`.
        features: The feature set of the sequence input.
        name: The model's name.
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

"""M5: a transformer encoder.

The paper calls M5 an encoder, so each step attends to all steps, and the model is not causal: it needs the whole
history. There is no positional encoding; the time channel increases along each history. The paper does not state the
parameter counts; they follow from its description (`docs/surrogate-models.md`).
"""

from __future__ import annotations

from typing import Any

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate


def m5_encoder(
    conditioning: str = "concat", *, features: str = "D", name: str | None = None, units: int = 128
) -> keras.Model:
    """Return an untrained M5, as in panel (e) of the paper's figure; see `m1_lstm` for arguments and errors.

    `"FiLM"` modulates the output of the second block. `"gated"` combines that output with its layer normalisation.
    `units`, the width of the sequence and of each of four heads, and twice as many between are a guess.
    """
    sequence, tabor = inputs(features, conditioning)
    hidden = AppendTabor(name="append_tabor")(sequence, tabor) if conditioning == "concat" else sequence
    hidden = layers.Dense(units, name="projection")(hidden)
    hidden = _encoder_block(hidden, name="block_1")
    hidden = _encoder_block(hidden, name="block_2")
    if conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    elif conditioning == "gated":
        hidden = TaborGate(name="gate")(hidden, layers.LayerNormalization(name="normalisation")(hidden), tabor)
    return keras.Model([sequence, tabor], readout(hidden), name=name or f"M5-{conditioning}")


def _encoder_block(sequence: Any, *, name: str) -> Any:
    """Return the output of self-attention and of two dense layers, each normalised after its residual sum.

    Source: Vaswani et al. 2017, section 3.1.
    """
    # All are created before the first call, so that a seed draws the initial weights of the published trainings.
    width = sequence.shape[-1]
    attention = layers.MultiHeadAttention(num_heads=4, key_dim=width, name=f"{name}_attention")
    expand = layers.Dense(2 * width, activation="relu", name=f"{name}_expand")
    contract = layers.Dense(width, name=f"{name}_contract")
    hidden = layers.Add(name=f"{name}_attention_add")([sequence, attention(sequence, sequence)])
    hidden = layers.LayerNormalization(name=f"{name}_attention_normalisation")(hidden)
    total = layers.Add(name=f"{name}_output_add")([hidden, contract(expand(hidden))])
    return layers.LayerNormalization(name=f"{name}_output_normalisation")(total)

"""M4: four residual blocks of dilated causal convolutions. The parameter counts are those of the paper.

The receptive field is 1 + 2 (3 - 1) (1 + 2 + 4 + 8) = 61 steps.
"""

from __future__ import annotations

from typing import Any

import keras
from keras import layers

from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate


def m4_tcn(conditioning: str = "concat", *, features: str = "D", name: str | None = None) -> keras.Model:
    """Return an untrained M4, as in panel (d) of the paper's figure; see `m1_lstm` for arguments and errors.

    With `"concat"` and `"FiLM"`, the Tabor parameter enters after the four blocks: at the input, concatenation would
    need 229,185 parameters, and the paper states 228,993. The `"gated"` model has only the parameters of the gate, 386,
    in addition to the blocks and the readout, so the second branch has none: it is the output of the third block.
    """
    sequence, tabor = inputs(features, conditioning)
    hidden = _residual_block(sequence, filters=64, dilation=1, name="block_1")
    hidden = _residual_block(hidden, filters=64, dilation=2, name="block_2")
    third = _residual_block(hidden, filters=128, dilation=4, name="block_3")
    hidden = _residual_block(third, filters=128, dilation=8, name="block_4")
    if conditioning == "concat":
        hidden = AppendTabor(name="append_tabor")(hidden, tabor)
    elif conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    else:
        hidden = TaborGate(name="gate")(hidden, third, tabor)
    return keras.Model([sequence, tabor], readout(hidden), name=name or f"M4-{conditioning}")


def _residual_block(sequence: Any, *, filters: int, dilation: int, name: str) -> Any:
    """Return the output of two dilated causal convolutions plus a skip path, of shape `(batch, steps, filters)`.

    The skip path is the identity, or a pointwise convolution where the number of channels changes. Source: the paper's
    appendix "Neural Network Layer Definitions", section "Temporal Convolutional Network (TCN) block".
    """
    hidden, skip = sequence, sequence
    for stage in ("first", "second"):
        prefix = f"{name}_{stage}"
        convolution = layers.Conv1D(filters, 3, padding="causal", dilation_rate=dilation, name=f"{prefix}_convolution")
        hidden = layers.LayerNormalization(name=f"{prefix}_normalisation")(convolution(hidden))
        hidden = layers.ReLU(name=f"{prefix}_relu")(hidden)
        hidden = layers.Dropout(0.1, name=f"{prefix}_dropout")(hidden)
    if sequence.shape[-1] != filters:
        skip = layers.Conv1D(filters, 1, name=f"{name}_projection")(sequence)
    return layers.Add(name=f"{name}_add")([hidden, skip])

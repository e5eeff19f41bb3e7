"""M4: four residual blocks of dilated causal convolutions. The parameter counts are those of the paper.

The receptive field is 1 + 2 (3 - 1) (1 + 2 + 4 + 8) = 61 steps.
"""

from __future__ import annotations

import keras

from surrogate.architectures.blocks import ResidualTCNBlock
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, FiLM, TaborGate
from surrogate.architectures.naming import check_conditioning


def tcn(conditioning: str = "concat", features: str = "D", name: str | None = None) -> keras.Model:
    """Return an untrained M4 model.

    With `"concat"` and FiLM, the Tabor parameter enters after the four blocks: at the input, concatenation would need
    229,185 parameters, and the paper states 228,993. The gated model has only the parameters of the gate, 386, in
    addition to the blocks and the readout, so the second branch has none: it is the output of the third block.

    Args:
        conditioning: `"concat"`, `"FiLM"` or `"gated"`.
        features: The feature set of the sequence input, `"A"` to `"D"`.
        name: Name of the model.

    Raises:
        ValueError: the conditioning or the feature set is unknown.
    """
    check_conditioning(conditioning)
    sequence, tabor = inputs(features)

    hidden = ResidualTCNBlock(64, dilation=1, name="block_1")(sequence)
    hidden = ResidualTCNBlock(64, dilation=2, name="block_2")(hidden)
    third = ResidualTCNBlock(128, dilation=4, name="block_3")(hidden)
    hidden = ResidualTCNBlock(128, dilation=8, name="block_4")(third)
    if conditioning == "concat":
        hidden = AppendTabor(name="append_tabor")(hidden, tabor)
    elif conditioning == "FiLM":
        hidden = FiLM(name="film")(hidden, tabor)
    else:
        hidden = TaborGate(name="gate")(hidden, third, tabor)

    return keras.Model([sequence, tabor], readout(hidden), name=name)

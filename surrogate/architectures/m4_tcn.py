"""M4: four residual blocks of dilated causal convolutions. The parameter counts are those of the paper.

The receptive field is 1 + 2 (3 - 1) (1 + 2 + 4 + 8) = 61 steps.
"""

from __future__ import annotations

from typing import Any

from surrogate.architectures.blocks import ResidualTCNBlock
from surrogate.architectures.common import appended
from surrogate.architectures.layers import FiLM, TaborGate


def tcn(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M4 at each step.

    With `"concat"` and FiLM, the Tabor parameter enters after the four blocks: at the input, concatenation would need
    229,185 parameters, and the paper states 228,993. The gated model has only the parameters of the gate, 386, in
    addition to the blocks and the readout, so the second branch has none: it is the output of the third block.
    """
    hidden = ResidualTCNBlock(64, dilation=1, name="block_1")(sequence)
    hidden = ResidualTCNBlock(64, dilation=2, name="block_2")(hidden)
    third = ResidualTCNBlock(128, dilation=4, name="block_3")(hidden)
    hidden = ResidualTCNBlock(128, dilation=8, name="block_4")(third)
    if conditioning == "FiLM":
        return FiLM(name="film")(hidden, tabor)
    if conditioning == "gated":
        return TaborGate(name="gate")(hidden, third, tabor)
    return appended(hidden, tabor, conditioning)

"""The paper's six families: each function returns the features at each step, which the readout maps to the force.

A function takes the two inputs and the conditioning, and returns features of shape `(batch, steps, features)`. The
paper states the parameter counts of M1 and M4. Those of the others follow from its description
(`docs/surrogate-models.md`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from keras import layers

from surrogate.architectures.blocks import EncoderBlock, ResidualTCNBlock
from surrogate.architectures.common import appended, modulated_or_normalised
from surrogate.architectures.layers import FiLM, TaborGate


def lstm(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M1: two LSTM layers.

    With `"concat"`, the Tabor parameter is an input channel. FiLM modulates the output of the second LSTM. The gated
    model differs from the others: the gate combines two parallel LSTM layers.
    """
    if conditioning == "gated":
        first = layers.LSTM(128, return_sequences=True, name="expert_1")(sequence)
        second = layers.LSTM(128, return_sequences=True, name="expert_2")(sequence)
        return TaborGate(name="gate")(first, second, tabor)
    hidden = appended(sequence, tabor, conditioning)
    hidden = layers.LSTM(256, return_sequences=True, name="lstm_1")(hidden)
    hidden = layers.LSTM(128, return_sequences=True, name="lstm_2")(hidden)
    return FiLM(name="film")(hidden, tabor) if conditioning == "FiLM" else hidden


def normalised_lstm(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M2: two LSTM layers, each followed by layer normalisation.

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


def convolutional_lstm(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M3: two causal convolutions, then an LSTM layer.

    FiLM modulates the output of the LSTM. The gate combines that output with its layer normalisation.
    """
    hidden = appended(sequence, tabor, conditioning)
    hidden = layers.Conv1D(64, 3, padding="causal", activation="relu", name="convolution_1")(hidden)
    hidden = layers.Conv1D(128, 3, padding="causal", activation="relu", name="convolution_2")(hidden)
    hidden = layers.LSTM(128, return_sequences=True, name="lstm")(hidden)
    return modulated_or_normalised(hidden, tabor, conditioning)


def tcn(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M4: four residual blocks of dilated causal convolutions.

    The receptive field is 1 + 2 (3 - 1) (1 + 2 + 4 + 8) = 61 steps. With `"concat"` and FiLM, the Tabor parameter
    enters after the four blocks: at the input, concatenation would need 229,185 parameters, and the paper states
    228,993. The gated model has only the parameters of the gate, 386, in addition to the blocks and the readout, so the
    second branch has none: it is the output of the third block.
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


def encoder(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M5: a transformer encoder.

    The paper calls M5 an encoder, so each step attends to all steps, and the model is not causal: it needs the whole
    history. There is no positional encoding; the time channel increases along each history. FiLM modulates the output
    of the second block. The gate combines that output with its layer normalisation.
    """
    hidden = layers.Dense(128, name="projection")(appended(sequence, tabor, conditioning))
    hidden = EncoderBlock(name="block_1")(hidden)
    hidden = EncoderBlock(name="block_2")(hidden)
    return modulated_or_normalised(hidden, tabor, conditioning)


def residual_lstm(sequence: Any, tabor: Any, conditioning: str) -> Any:
    """Return the features of M6: the normalised sum of two LSTM layers, then a third.

    FiLM modulates the output of the last LSTM. The gate combines the sum of both paths with its layer normalisation,
    before the last LSTM.
    """
    hidden = appended(sequence, tabor, conditioning)
    first = layers.LSTM(128, return_sequences=True, name="lstm_1")(hidden)
    second = layers.LSTM(128, return_sequences=True, name="lstm_2")(first)
    total = layers.Add(name="add")([first, second])
    hidden = layers.LayerNormalization(name="normalisation")(total)
    if conditioning == "gated":
        hidden = TaborGate(name="gate")(total, hidden, tabor)
    hidden = layers.LSTM(128, return_sequences=True, name="lstm_3")(hidden)
    return FiLM(name="film")(hidden, tabor) if conditioning == "FiLM" else hidden


HIDDEN: dict[str, Callable[[Any, Any, str], Any]] = {
    "M1": lstm,
    "M2": normalised_lstm,
    "M3": convolutional_lstm,
    "M4": tcn,
    "M5": encoder,
    "M6": residual_lstm,
}
"""The function of each family of `surrogate.architectures.naming.FAMILIES`."""

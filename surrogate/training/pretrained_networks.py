"""The networks of `fast` and `accurate`, untrained and from a published file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import keras
import numpy as np
import onnx
from keras import layers
from onnx import numpy_helper

from bem.dataset.physical_steps import BEFORE_CROSSING
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor, ChosenSteps
from surrogate.files import read_intact, read_run
from surrogate.onnx.file import ONNX_NAME

FEATURES = "F"
Member = tuple[keras.Model, dict[str, Any]]
"""A network, and what `run.json` says of it."""
Layers = tuple[str, tuple[int, ...]]
"""Kind and units of the layers of a network; `"dense"` ones see the whole history at once."""
_DENSE: Layers = ("dense", (256, 256, 256))
_LSTM: Layers = ("LSTM", (128, 64))
NETWORKS: dict[str, tuple[Layers, ...]] = {"fast": (_DENSE,), "accurate": (_LSTM, _LSTM, *[_DENSE] * 4)}
"""The networks whose mean a model is."""


def network(layer: str, units: Sequence[int], counts: tuple[int, int, int]) -> keras.Model:
    """Build an untrained network.

    Args:
        layer: `"dense"` for dense layers on the steps that tell a history of its protocol, `"LSTM"` for LSTMs and the
            readout that all models share.
        units: Of each layer.
        counts: Points of loading, dwell and unloading.
    """
    sequence, tabor = inputs(FEATURES)
    hidden = AppendTabor(name="append_tabor")(sequence, tabor)
    if layer == "LSTM":
        for number, size in enumerate(units, 1):
            hidden = layers.LSTM(size, return_sequences=True, name=f"lstm_{number}")(hidden)
        return keras.Model([sequence, tabor], readout(hidden))
    hidden = ChosenSteps(telling_steps(counts), name="chosen_steps")(hidden)
    for number, size in enumerate(units, 1):
        hidden = layers.Dense(size, activation="gelu", name=f"dense_{number}")(hidden)
    force = layers.Dense(sum(counts), name="forces")(hidden)
    return keras.Model([sequence, tabor], layers.Reshape((sum(counts), 1), name="steps")(force))


def telling_steps(counts: Sequence[int]) -> list[int]:
    """Steps that tell a history of its protocol, which networks of dense layers read.

    They are those in the middle and at the end of loading and dwell, and four of the unloading, the last one included.

    Args:
        counts: Points of loading, dwell and unloading.

    Returns:
        Their eight indices.
    """
    loading, dwell, unloading = counts
    held = loading + dwell
    before = round(BEFORE_CROSSING * unloading)
    return [
        *(loading // 2 - 1, loading - 1, loading + dwell // 2 - 1, held - 1),
        *(held + before // 2 - 1, held + before - 1, held + before + unloading // 4, held + unloading - 1),
    ]


def members_of(folder: Path) -> list[Member]:
    """Return the networks whose mean a published model is, each with its record in `run.json`."""
    run, _ = read_run(folder)
    graph = onnx.load_from_string(read_intact(folder / ONNX_NAME, run)).graph
    arrays = [numpy_helper.to_array(initializer) for initializer in graph.initializer]
    arrays, weights, members = [array for array in arrays if array.dtype == np.float32 and array.ndim], [], []
    while arrays:
        if arrays[0].ndim == 3:  # an LSTM
            (kernel,), (recurrent,), (bias,) = arrays[:3]
            units, arrays = recurrent.shape[1], arrays[3:]
            order = np.concatenate([np.arange(units) + units * block for block in (0, 2, 3, 1)])  # of ONNX's i, o, f, c
            weights += [kernel.T[:, order], recurrent.T[:, order], (bias[: 4 * units] + bias[4 * units :])[order]]
        else:
            weights.append(arrays.pop(0))
    for record in run["members"]:
        model = network(record["layers"], record["units"], tuple(run["counts"]))
        own, weights = weights[: len(model.weights)], weights[len(model.weights) :]
        model.set_weights(own)
        members.append((model, record))
    return members

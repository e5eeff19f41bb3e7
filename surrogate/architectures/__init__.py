"""The 18 paper models, one module per family, and registered architectures. `build` makes each of them by name."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from surrogate.architectures.naming import CONDITIONINGS, FAMILIES, PAPER_PARAMETER_COUNTS, names, split_name
from surrogate.architectures.registry import REGISTERED, check_model, register
from surrogate.backend import import_keras

if TYPE_CHECKING:
    import keras

__all__ = ["CONDITIONINGS", "FAMILIES", "PAPER_PARAMETER_COUNTS", "build", "names", "register", "split_name"]

# Module and function of each family; the function takes the two inputs and the conditioning, and returns features of
# shape `(batch, steps, features)` for the readout.
_BUILDERS = {
    "M1": ("m1_lstm", "lstm"),
    "M2": ("m2_normalised_lstm", "normalised_lstm"),
    "M3": ("m3_convolutional_lstm", "convolutional_lstm"),
    "M4": ("m4_tcn", "tcn"),
    "M5": ("m5_encoder", "encoder"),
    "M6": ("m6_residual_lstm", "residual_lstm"),
}


def build(name: str, features: str = "D") -> keras.Model:
    """Return an untrained model by name; see `surrogate.build`."""
    family, conditioning = split_name(name)
    import_keras()
    if family in REGISTERED:
        model = REGISTERED[family].builder(conditioning=conditioning, features=features, name=name)
        check_model(model, name, features)
        return model
    import keras

    from surrogate.architectures.common import inputs, readout

    module, builder = _BUILDERS[family]
    hidden = getattr(importlib.import_module(f"surrogate.architectures.{module}"), builder)
    sequence, tabor = inputs(features)
    return keras.Model([sequence, tabor], readout(hidden(sequence, tabor, conditioning)), name=name)

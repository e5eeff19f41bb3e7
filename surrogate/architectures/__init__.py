"""The 18 paper models, one module per family, and registered architectures. `build` makes each of them by name.

The module `m1_lstm` of the family M1 has one public function, `m1_lstm`, which returns the model; so have the others.
The table `surrogate.architectures.naming.FAMILIES` names these functions.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from surrogate.architectures.naming import CONDITIONINGS, FAMILIES, PAPER_PARAMETER_COUNTS, names, split_name
from surrogate.architectures.registry import check_model, register
from surrogate.backend import import_keras

if TYPE_CHECKING:
    import keras

__all__ = ["CONDITIONINGS", "FAMILIES", "PAPER_PARAMETER_COUNTS", "build", "names", "register", "split_name"]


def build(name: str, features: str = "D") -> keras.Model:
    """Return an untrained model: one of the 18 paper models, or one of a registered family.

    Source: the paper's section "DL Models' architecture" and its appendices on architectures and layers.

    Args:
        name: One of `names()`, such as `"M1-concat"`.
        features: Feature set of the sequence input, `"A"` to `"F"` (see `surrogate.data.features`).

    Returns:
        A functional model with two scaled inputs, `sequence` of shape `(batch, steps, channels)` and `tabor` of shape
        `(batch, 1)`. The output is the scaled force of shape `(batch, steps, 1)`.

    Raises:
        ModuleNotFoundError: Keras is not installed.
        ValueError: the name or the feature set is unknown; the message lists the known ones.
    """
    family, conditioning = split_name(name)
    import_keras()
    builder = FAMILIES[family].builder
    if isinstance(builder, str):
        builder = getattr(importlib.import_module(f"{__name__}.{builder}"), builder)
    model: keras.Model = builder(conditioning=conditioning, features=features, name=name)
    check_model(model, name, features)
    return model

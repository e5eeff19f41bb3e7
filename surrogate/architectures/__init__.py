"""The 18 paper models, one function per family, and registered architectures. `build` makes each of them by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from surrogate.architectures.naming import split_name
from surrogate.architectures.registry import REGISTERED, check_model
from surrogate.backend import import_keras

if TYPE_CHECKING:
    import keras


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
    if family in REGISTERED:
        model = REGISTERED[family].builder(conditioning=conditioning, features=features, name=name)
        check_model(model, name, features)
        return model
    import keras

    from surrogate.architectures.common import inputs, readout
    from surrogate.architectures.families import HIDDEN

    sequence, tabor = inputs(features)
    return keras.Model([sequence, tabor], readout(HIDDEN[family](sequence, tabor, conditioning)), name=name)

"""The models of a force curve, from the simplest on."""

import math

from bem.lab.models import contact, elastic, ting
from bem.lab.models.model import CONTACT_POINT, Model, Parameter, Path, setup_of

_ALL = elastic.HERTZ, elastic.CONE, elastic.DMT, elastic.JKR, ting.MODEL, contact.MODEL
MODELS: dict[str, Model] = {model.name: model for model in _ALL}
_UNITS = {"force_offset": "N", "tilt": "N/m", "drag": "N s/m", "drift": "N/s"}
LINEAR = {
    name: Parameter(name, name.replace("_", " "), unit, "linear", -math.inf, math.inf, "two baselines")
    for name, unit in _UNITS.items()
}
"""What enters a fit linearly, with any model."""
PARAMETERS = LINEAR | {entry.name: entry for model in MODELS.values() for entry in (*model.parameters, CONTACT_POINT)}
"""Those of all models."""

__all__ = ["CONTACT_POINT", "LINEAR", "MODELS", "PARAMETERS", "Model", "Parameter", "Path", "setup_of"]

"""The models of a force curve, from the simplest on; each is one small file."""

import math

from bem.lab.models import cone, contact, dmt, hertz, jkr, ting
from bem.lab.models.model import CONTACT_POINT, Model, Parameter, Path, setup_of

MODELS: dict[str, Model] = {entry.MODEL.name: entry.MODEL for entry in (hertz, cone, dmt, jkr, ting, contact)}
_UNITS = {"force_offset": "N", "tilt": "N/m", "drag": "N s/m", "drift": "N/s"}
LINEAR = {
    name: Parameter(name, name.replace("_", " "), unit, "linear", -math.inf, math.inf, "two baselines")
    for name, unit in _UNITS.items()
}
"""What enters a fit linearly, with any model."""
PARAMETERS = LINEAR | {entry.name: entry for model in MODELS.values() for entry in (*model.parameters, CONTACT_POINT)}
"""Those of all models."""

__all__ = ["CONTACT_POINT", "LINEAR", "MODELS", "PARAMETERS", "Model", "Parameter", "Path", "setup_of"]

"""The models of a force curve, from the simplest on; each is one small file."""

from bem.lab.models import cone, contact, dmt, hertz, jkr, ting
from bem.lab.models.model import CONTACT_POINT, Model, Parameter, Path, setup_of

MODELS: dict[str, Model] = {entry.MODEL.name: entry.MODEL for entry in (hertz, cone, dmt, jkr, ting, contact)}
LINEAR = {"force_offset": "N", "tilt": "N/m", "drag": "N s/m", "drift": "N/s"}
"""What enters a fit linearly, with any model, and its units."""
PARAMETERS = {entry.name: entry for model in MODELS.values() for entry in (*model.parameters, CONTACT_POINT)}
"""Those of all models."""

__all__ = ["CONTACT_POINT", "LINEAR", "MODELS", "PARAMETERS", "Model", "Parameter", "Path", "setup_of"]

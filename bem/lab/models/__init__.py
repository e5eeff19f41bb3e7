"""The ladder of models of a force curve, from the simplest on."""

from bem.lab.models import elastic, solver, ting
from bem.lab.models.model import CONTACT_POINT, Jump, Model, Parameter, Path, setup_of

LADDER: dict[str, Model] = {each.name: each for each in (*elastic.MODELS, ting.MODEL, solver.MODEL)}
LINEAR = {"force_offset": "N", "tilt": "N/m", "drag": "N s/m", "drift": "N/s"}
"""What enters a fit linearly, with any model, and its units."""
UNITS = {each.name: each.unit for model in LADDER.values() for each in (*model.parameters, CONTACT_POINT)} | LINEAR
"""Of the parameters of all models, and of what enters a fit linearly."""

__all__ = ["CONTACT_POINT", "LADDER", "LINEAR", "UNITS", "Jump", "Model", "Parameter", "Path", "setup_of"]

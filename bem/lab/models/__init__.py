"""The ladder of models of a force curve, from the simplest on."""

from bem.lab.models import elastic, solver, ting
from bem.lab.models.model import CONTACT_POINT, Jump, Model, Parameter, Path

LADDER: dict[str, Model] = {each.name: each for each in (*elastic.MODELS, *ting.MODELS, solver.MODEL)}

__all__ = ["CONTACT_POINT", "LADDER", "Jump", "Model", "Parameter", "Path"]

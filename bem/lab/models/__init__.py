"""The ladder of models of a force curve, one file each, from the simplest on."""

from bem.lab.models import cone, dmt, hertz, jkr, maugis, pyramid, solver, ting, ting_power_law
from bem.lab.models.model import CONTACT_POINT, Model, Parameter
from bem.lab.models.path import Jump, Path

LADDER: dict[str, Model] = {
    each.MODEL.name: each.MODEL for each in (hertz, cone, pyramid, dmt, jkr, maugis, ting, ting_power_law, solver)
}

__all__ = ["CONTACT_POINT", "LADDER", "Jump", "Model", "Parameter", "Path"]

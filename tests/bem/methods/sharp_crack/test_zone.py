"""The process zone of a moving edge: its limits, for every law and kind of solid."""

import numpy as np
import pytest

from bem import PronySeries, StandardLinearSolid
from bem.methods.sharp_crack.zone import ZoneEquations
from bem.problem.tractions import ConstantStress, Exponential, LennardJones, law_of

LAWS = [LennardJones(), ConstantStress(), Exponential()]
SOLIDS = [StandardLinearSolid(0.1), PronySeries([0.5, 0.3], [0.1, 1.0])]


def equations_of(law, solid):
    return ZoneEquations(law_of(law), np.array(solid.strengths), np.array(solid.times))


@pytest.mark.parametrize("law", LAWS)
def test_toughness_at_rest_is_the_work(law):
    zone = equations_of(law, SOLIDS[0]).elastic()
    assert zone.far_value**2 / np.pi == pytest.approx(1.0, abs=7e-3)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("solid", SOLIDS)
def test_fast_edges_feel_the_glass(law, solid):
    equations = equations_of(law, solid)
    speeds, rest = np.geomspace(1e-3, 1e8, 40), equations.elastic()
    for closing, limit in ((False, 1.0 / solid.modulus_ratio), (True, solid.modulus_ratio)):
        work = [zone.far_value**2 / rest.far_value**2 for zone in equations.follow(speeds, rest, closing=closing)]
        assert work[0] == pytest.approx(1.0, abs=0.01)
        assert work[-1] == pytest.approx(limit, rel=0.025)
        assert np.all(np.diff(work) * (-1 if closing else 1) > -1e-3)


def test_traction_is_largest_at_the_edge():
    equations = equations_of(LAWS[0], SOLIDS[0])
    zone = equations.follow(np.geomspace(1e-3, 1.0, 12), equations.elastic(), closing=False)[-1]
    assert zone.gaps[equations.edge] == pytest.approx(3.0 ** (1.0 / 6.0))
    assert np.all(np.diff(zone.gaps) > 0.0)

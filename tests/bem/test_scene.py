import dataclasses

import numpy as np
import pytest

from bem.materials import Elastic, StandardLinearSolid
from bem.scene import Scene
from bem.tractions import ConstantStress, HardContact, LennardJones, TractionLaw


def test_defaults():
    scene = Scene(tabor=1)
    assert scene == Scene(1.0, Elastic(), LennardJones())
    assert type(scene.tabor) is float
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.tabor = 2.0


@pytest.mark.parametrize("tabor", [0.0, -1.0, np.nan, np.inf, 1e-7, 1e5, "3", True])
def test_bad_tabor(tabor):
    with pytest.raises(ValueError, match="tabor must be a finite number at least 1e-06 and at most 10000; received"):
        Scene(tabor=tabor)


@pytest.mark.parametrize("material", ["rubber", None, Elastic, HardContact()])
def test_wrong_material(material):
    with pytest.raises(ValueError, match=r"material must be one of Elastic\(\.\.\.\), .*; received"):
        Scene(tabor=1.0, material=material)


@pytest.mark.parametrize("adhesion", [Elastic(), "exponential", ConstantStress, TractionLaw])
def test_wrong_adhesion(adhesion):
    with pytest.raises(ValueError, match="adhesion must be one of LennardJones"):
        Scene(tabor=1.0, material=StandardLinearSolid(0.1), adhesion=adhesion)


def test_a_spring_is_none_by_default_and_where_it_is_infinitely_stiff():
    assert Scene(1.0).spring is None
    assert Scene(1.0, spring=np.inf) == Scene(1.0)
    assert Scene(1.0, spring=4).spring == 4.0
    assert Scene(1.0, spring=4.0) != Scene(1.0)


@pytest.mark.parametrize("spring", [0.0, -1.0, np.nan, -np.inf, 1e-7, 1e13, "4", True])
def test_bad_spring(spring):
    with pytest.raises(ValueError, match=r"spring must be a finite number at least 1e-06 and at most 1e\+12; received"):
        Scene(tabor=1.0, spring=spring)

import dataclasses

import numpy as np
import pytest

from bem.problem.materials import Elastic
from bem.problem.scene import Scene
from bem.problem.tractions import LennardJones


def test_defaults():
    scene = Scene(tabor=1)
    assert scene == Scene(1.0, Elastic(), LennardJones())
    assert type(scene.tabor) is float
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.tabor = 2.0


def test_infinitely_stiff_spring_is_none():
    assert Scene(1.0, spring=np.inf) == Scene(1.0)
    assert Scene(1.0, spring=4).spring == 4.0
    assert Scene(1.0, spring=4.0) != Scene(1.0)

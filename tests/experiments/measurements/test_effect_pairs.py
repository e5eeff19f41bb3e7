"""Scenes that differ in one effect, and what each costs."""

import pytest

from bem import ForceProtocol, simulate
from experiments.measurements import effect_pairs
from experiments.measurements.effect_pairs import Effects


def test_pairs_differ_in_one_effect_and_name_the_one_that_the_aim_limits():
    found = effect_pairs.pairs()
    assert len(found) == 42
    for effect, limited, other in found:
        assert sum(a != b for a, b in zip(limited, other, strict=True)) == 1
        assert effect in effect_pairs.LARGEST
    assert ("adhesion", Effects(False, 1), Effects(True, 1)) in found
    assert ("spring", Effects(True, 0, "spring"), Effects(True, 0)) in found


@pytest.mark.parametrize("effects", effect_pairs.EVERY, ids=lambda effects: effects.name)
def test_every_scene_completes_and_reaches_its_peak(effects):
    scene, protocol = effect_pairs.case(effects, 1.0, 1.0)
    found = simulate(scene, protocol)
    assert found.completed
    assert found.stats.memory_vectors == effects.processes
    if isinstance(protocol, ForceProtocol):
        assert found.max_compression == pytest.approx(min(protocol.forces), rel=1e-3)
    elif effects.device == "stage":
        assert max(found.indentation) == pytest.approx(effect_pairs.DEPTH)

"""What effects change and cost, and how often a recommendation keeps its promise."""

import types

import numpy as np
import pytest

from bem import ForceProtocol, Scene, simulate
from experiments.measurements import effect_pairs, effects
from experiments.measurements.effect_pairs import Effects

KINDS = [f"{name}, {solid}" for name in ("DMT-like", "JKR-like") for solid in ("elastic", "one relaxation")]


def test_curves_share_units_over_depth(monkeypatch):
    numbers = {"indentation": np.array([0.4]), "force": None, "time": None, "pull_off_force": 1.5}
    monkeypatch.setattr(effects, "simulate", lambda *_: types.SimpleNamespace(**numbers))
    assert effects.curve("any", Scene(0.2))["depth"] == pytest.approx([2.0])


def test_limits_and_errors_of_stand_ins():
    points = [{"tabor": mu, **dict.fromkeys(KINDS, error)} for mu, error in ((0.1, 0.2), (1.0, 0.01), (5.0, 0.04))]
    bands = [{"decades": d, "rate": rate, "error": 0.04 * d} for d in (1.0, 2.0) for rate in effects.SLOW_AND_FAST]
    ranges = {(row["stand_in"], row["instead_of"]): (row["low"], row["high"]) for row in effects.safe(points, bands)}
    assert ranges["JKR-like, mu = 3.2", "another range, elastic"] == (1.0, 5.0)
    assert ranges["DMT-like, mu = 0.2", "another range, elastic"] == (0.2, 5.0)
    assert ranges["one relaxation", "ten relaxations, rate 20"] == (0.0, 1.0)
    errors = effects.range_errors(effects.DMT_TABOR)
    assert errors["DMT-like, elastic"] == 0.0
    assert errors["JKR-like, elastic"] > 0.1
    assert effects.one_process_error(0.25, 20.0)["error"] < 0.01
    stand_ins = effects.stand_ins(1e-2)
    assert set(stand_ins["errors"]) == {"Hertz", "rubbery", "glassy", "no adhesion"}
    assert stand_ins["recommended"] == "elastic rubbery, adhesive"


def test_pairs_differ_in_one_effect():
    pairs = effect_pairs.pairs()
    assert len(pairs) == 42
    for effect, limited, scene in pairs:
        assert sum(a != b for a, b in zip(limited, scene, strict=True)) == 1
        assert effect in effect_pairs.LARGEST
    assert ("adhesion", Effects(False, 1), Effects(True, 1)) in pairs
    assert ("spring", Effects(True, 0, "spring"), Effects(True, 0)) in pairs


@pytest.mark.parametrize("effects", effect_pairs.EVERY, ids=lambda effects: effects.name)
def test_scenes_complete_and_reach_the_peak(effects):
    scene, protocol = effect_pairs.case(effects, 1.0, 1.0)
    trajectory = simulate(scene, protocol)
    assert trajectory.completed
    assert trajectory.stats.memory_vectors == effects.processes
    if isinstance(protocol, ForceProtocol):
        assert trajectory.max_compression == pytest.approx(min(protocol.forces), rel=1e-3)
    elif effects.device == "stage":
        assert max(trajectory.indentation) == pytest.approx(effect_pairs.DEPTH)

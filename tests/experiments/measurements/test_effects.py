"""What effects change and cost, and how often a recommendation keeps its promise."""

import types

import numpy as np
import pytest

from bem import ForceProtocol, LoadingProtocol, Scene, simulate
from experiments.measurements import effect_pairs, effects, recommendations
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


@pytest.mark.parametrize("name", recommendations.SAMPLES)
def test_recommendations_are_checked(name):
    (case,) = recommendations.sample(name, 1)
    row = recommendations.checked(*case, 0.1, "force")
    assert row["kept"] is (True if row["simplified"] else None)
    summary = recommendations.summary([row])
    assert (summary["cases"], summary["simplified"], summary["kept"]) == (1, row["simplified"], row["simplified"])


def test_summary_counts_kept_recommendations():
    full = {"simplified": False, "kept": None, "error": None, "ratio": None}
    simple = {"simplified": True, "kept": True, "error": 0.01, "ratio": 0.5, "full_seconds": 1.0}
    common = {"found_by": "estimate", "seconds": 0.1}
    summary = recommendations.summary([full | common, simple | common, simple | common | {"kept": False, "ratio": 2.0}])
    assert (summary["simplified"], summary["kept"], summary["slower"], summary["worst_error"]) == (2, 1, 1, 0.01)
    assert recommendations.summary([full | common])["worst_error"] is None
    ramps = {"peak_indentation": 5.0, "loading_rate": 2.0, "dwell_time": 1.0, "unloading_rate": 4.0}
    loads = recommendations.two_loads(LoadingProtocol(**ramps), 1.0, 0.5)
    assert np.diff(loads.indentations) / np.diff(loads.times) == pytest.approx([2.0, -4.0, 2.0, -4.0])
    assert loads.indentations[1:4].tolist() == [5.0, 2.5, 5.0]

"""What each effect changes, and where a simpler scene stands in for it."""

import types

import numpy as np
import pytest

from bem import Scene
from experiments.measurements import effects

KINDS = [f"{name}, {kind}" for name in ("DMT-like", "JKR-like") for kind in ("elastic", "one relaxation")]


def test_curves_are_over_depth_in_units_of_all_scenes(monkeypatch):
    numbers = {"indentation": np.array([0.4]), "force": None, "time": None, "pull_off_force": 1.5}
    monkeypatch.setattr(effects, "simulate", lambda *_: types.SimpleNamespace(**numbers))
    assert effects.curve("any", Scene(0.2))["depth"] == pytest.approx([2.0])


def test_limits_and_errors_of_stand_ins():
    points = [{"tabor": mu, **dict.fromkeys(KINDS, error)} for mu, error in ((0.1, 0.2), (1.0, 0.01), (5.0, 0.04))]
    bands = [{"decades": d, "rate": rate, "error": 0.04 * d} for d in (1.0, 2.0) for rate in effects.SLOW_AND_FAST]
    found = {(row["stand_in"], row["instead_of"]): (row["low"], row["high"]) for row in effects.safe(points, bands)}
    assert found["JKR-like, mu = 3.2", "another range, elastic"] == (1.0, 5.0)
    assert found["DMT-like, mu = 0.2", "another range, elastic"] == (0.2, 5.0)
    assert found["one relaxation", "ten relaxations, rate 20"] == (0.0, 1.0)
    found = effects.of_another_range(effects.DMT_TABOR)
    assert found["DMT-like, elastic"] == 0.0
    assert found["JKR-like, elastic"] > 0.1
    assert effects.of_one_process(0.25, 20.0)["error"] < 0.01
    found = effects.stand_ins(1e-2)
    assert set(found["errors"]) == {"Hertz", "rubbery", "glassy", "no adhesion"}
    assert found["recommended"] == "elastic rubbery, adhesive"

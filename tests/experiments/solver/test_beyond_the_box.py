"""The comparison of two solvers on scenes beyond the paper's box."""

import pytest

from bem import Elastic, HardContact, StandardLinearSolid
from experiments.solver import beyond_the_box, revision_comparison, solver_child
from experiments.solver.beyond_the_box import SAMPLES, judged
from experiments.solver.revision_comparison import NOW
from experiments.solver.solver_processes import ROOT


def test_a_solver_beside_itself_is_not_slower_and_completes_as_much(monkeypatch, capsys):
    monkeypatch.setattr(beyond_the_box, "source_of", lambda _: ROOT)
    monkeypatch.setattr(revision_comparison, "source_of", None)
    found = beyond_the_box.compare("HEAD", "draft", 2, 3, 1)
    assert list(found["samples"]) == list(SAMPLES)
    for sample in found["samples"].values():
        assert sample["not_completed"] == {"new": 0, "old": 0}
        assert sample["solvers"]["HEAD"]["statuses"] == sample["solvers"][NOW]["statuses"] == ["completed"] * 2
    beyond_the_box.show(found)
    said = capsys.readouterr().out
    assert all(sample in said for sample in SAMPLES)
    assert "modulus ratio" in said


def test_scenes_are_judged_one_by_one_where_both_completed():
    done = ["completed", "completed", "completed", "not started: x"]
    old = {"seconds_each": [1.0, 10.0, 1.0, 1.0], "statuses": ["completed", "completed", "stopped", "completed"]}
    found = judged({"seconds_each": [1.3, 5.0, 9.0, 0.1], "statuses": done}, old)
    assert found["ratios"] == [pytest.approx(1.3), pytest.approx(0.5), None, None]
    assert found["ratio"][0] == pytest.approx(6.3 / 11.0)
    assert found["slower"] == 1
    assert found["not_completed"] == {"new": 1, "old": 1}


def test_samples_differ_in_what_they_ask_for():
    asked = {sample: beyond_the_box.requests(sample, 20, 1) for sample in SAMPLES}
    scenes = {sample: [solver_child.scene_of(one) for one in requests] for sample, requests in asked.items()}
    assert all(isinstance(scene.material, Elastic) for scene in scenes["elastic"])
    assert all(isinstance(scene.material, StandardLinearSolid) for scene in scenes["beyond"])
    assert 0 < sum(isinstance(scene.adhesion, HardContact) for scene in scenes["stiff"]) < 20
    assert [one["protocol"] for one in asked["elastic"]] == [one["protocol"] for one in asked["beyond"]]

"""Seconds against errors of every tool, on the smallest samples."""

import types

import numpy as np

from experiments.measurements import accuracy_cost, tools
from experiments.measurements.cases import held_out
from experiments.measurements.closed_forms import Form
from surrogate.data.dataset import TrajectoryDataset


def test_every_tool_is_measured_and_missing_models_are_named(cost):
    tools = {(tool["kind"], tool["setting"]): tool for tool in cost["tools"]}
    assert list(tools)[:4] == [
        ("measurement steps", ""),
        ("solver", "0.05"),
        ("solver", "draft"),
        ("paper's discretisation", "20 nodes, 20 steps"),
    ]
    assert all(kind in ("closed form", "fast", "accurate") for kind, _ in list(tools)[4:])
    assert cost["tools"][0]["errors"]["force"]["largest"] == 0.0
    assert all(tool["failures"] == 0 for tool in cost["tools"])
    assert [tools[key]["protocols"] for key in list(tools)[1:4]] == [2, 2, 1]
    one_at_a_time = [tool for tool in cost["tools"][1:] if tool.get("way") != "ONNX batch"]
    assert all(tool["repeats"] == 2 and len(tool["run_totals"]) == 2 for tool in one_at_a_time)
    assert all(tool["seconds"]["count"] == tool["protocols"] for tool in cost["tools"][1:])
    assert len(cost["missing"]) == 18


def test_a_tool_is_judged_by_medians_against_its_own_protocols(monkeypatch):
    exact = np.random.default_rng(0).random((3, 122))
    seconds = np.array([[1.0], [2.0], [9.0]])
    assert accuracy_cost.report("any", "", exact[:1], seconds, exact[:1])["seconds"]["median"] == 2.0
    monkeypatch.setattr(accuracy_cost, "FORMS", (Form("last", lambda case: case == 2, lambda case: exact[case]),))
    monkeypatch.setattr(accuracy_cost, "TARGETS", ())
    (row,) = accuracy_cost.without_learning([0, 1, 2], exact, 1, finest=0)
    assert (row["kind"], row["protocols"], row["errors"]["force"]["largest"]) == ("closed form", 1, 0.0)


def test_held_out_cases_are_those_of_the_data_set_and_the_call_is_timed_whole(dataset):
    (case,) = held_out(1, dataset)
    data = TrajectoryDataset.load(dataset)
    assert case.scene.tabor == data.protocols["tabor"][data.split(0).test[0]]
    assert tools.solver_at(0.05)(case).shape == (122,)
    found = tools.answer_of(case, types.SimpleNamespace(completed=False))
    assert np.isnan(found).all()


def test_refined_answers_belong_to_their_solver_accuracy_and_cases(dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(tools, "KEPT", tmp_path)
    monkeypatch.setattr(tools, "in_parallel", lambda _, tasks, **__: [[tools.EXACT_TARGET] * 122 for _ in tasks])
    first, second = held_out(2, dataset)

    def kept(case):
        assert np.all(tools.refined([case], 1) == tools.EXACT_TARGET)
        return len(list(tmp_path.iterdir()))

    assert [kept(first), kept(first), kept(second)] == [1, 1, 2]
    monkeypatch.setattr(tools, "SOLVER_VERSION", "another")
    assert kept(first) == 3
    monkeypatch.setattr(tools, "EXACT_TARGET", 1e-2)
    assert kept(first) == 4

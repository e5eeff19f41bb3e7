"""Seconds against errors of every tool, on the smallest samples."""

import json

import numpy as np
import pytest

from experiments.cost import accuracy_cost, cases
from experiments.cost.closed_form_tools import Form
from experiments.timing import Clock
from surrogate.data.dataset import TrajectoryDataset


def test_every_tool_is_measured_and_missing_models_are_named(cost):
    content = json.loads(cost.read_text(encoding="utf-8"))
    tools = {(tool["kind"], tool["setting"]): tool for tool in content["tools"]}
    assert list(tools)[:4] == [
        ("measurement steps", ""),
        ("solver", "0.05"),
        ("solver", "draft"),
        ("paper's discretisation", "20 nodes, 20 steps"),
    ]
    assert all(kind == "closed form" for kind, _ in list(tools)[4:])
    assert content["tools"][0]["errors"]["force"]["largest"] == 0.0
    assert all(tool["failures"] == 0 for tool in content["tools"])
    assert [tools[key]["protocols"] for key in list(tools)[1:4]] == [2, 2, 1]
    assert all(tool["repeats"] == 2 and len(tool["run_totals"]) == 2 for tool in content["tools"][1:])
    assert all(len(tool["seconds_each"]) == tool["protocols"] for tool in content["tools"])
    assert content["complete"]
    assert len(content["missing"]) == 18


@pytest.fixture
def spend(monkeypatch):
    """Let seconds pass on a clock that moves by nothing else."""
    now = [0.0]
    monkeypatch.setattr(accuracy_cost, "CLOCK", Clock(processor=lambda: now[0], wall=lambda: now[0]))

    def spend(seconds):
        now[0] += seconds

    return spend


def test_seconds_are_those_of_the_whole_call(spend, dataset, monkeypatch):
    """A tool that says it took no time is timed all the same."""
    (case,) = cases.held_out(1, dataset)
    data = TrajectoryDataset.load(dataset)
    assert case.scene.tabor == data.protocols["tabor"][data.split(0).test[0]]
    quick = case.run(0.05)
    monkeypatch.setattr(cases, "simulate", lambda *_: spend(3.0) or quick)
    table, seconds = accuracy_cost.run([case], accuracy_cost.solver_at(0.05), 3, "slow")
    assert table.shape == (1, 122)
    assert seconds.tolist() == [[3.0]] * 3


@pytest.mark.parametrize(("each", "runs"), [(0.6 * accuracy_cost.BUDGET, 1), (0.4 * accuracy_cost.BUDGET, 2)])
def test_a_dear_tool_is_repeated_within_its_budget_only(each, runs, spend):
    calls = []
    _, seconds = accuracy_cost.run([0], lambda case: calls.append(case) or spend(each) or np.zeros(122), 5, "dear")
    assert (len(seconds), len(calls)) == (runs, runs + 1)


def test_a_tool_is_judged_by_medians_against_its_own_protocols(monkeypatch):
    exact = np.random.default_rng(0).random((3, 122))
    seconds = np.array([[1.0], [2.0], [9.0]])
    assert accuracy_cost.report("any", "", (exact[:1], seconds), exact[:1])["seconds"]["median"] == 2.0
    form = Form("last", lambda case: case == 2, lambda case: (exact[case, 0], exact[case, 2:]))
    monkeypatch.setattr(accuracy_cost, "FORMS", (form,))
    (row,) = accuracy_cost.closed_forms([0, 1, 2], exact, 1)
    assert row["errors"]["force"]["largest"] == 0.0

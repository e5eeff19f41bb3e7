"""How seconds grow with nodes, steps and the scene, on single scenes."""

import pytest

from bem.dataset.file import Dataset, load_dataset
from experiments.measurements import cost_growth


def test_growth_of_both_solvers():
    ours = cost_growth.solver_seconds(cost_growth.CENTRE, 3)
    assert ours["steps"] > 20
    assert ours["seconds"]["count"] == 3
    assert cost_growth.a_step(ours)["seconds"]["median"] == pytest.approx(ours["seconds"]["median"] / ours["steps"])
    nodes, steps = cost_growth.resolution(cost_growth.CENTRE | {"tabor": 3.2, "peak_indentation": 100.0})
    assert (nodes, steps) == (436, 1069)
    theirs = cost_growth.baseline_seconds(cost_growth.CENTRE, 20, 20, 1)
    assert theirs["completed"]
    points = [{**theirs, "nodes": n, "iterations_per_step": 2.0 * n} for n in (20, 40, 80)]
    found = cost_growth.fitted(points, "nodes")
    assert (found["exponent"], found["iterations"]) == (pytest.approx(0.0), pytest.approx(1.0))


def test_one_control_moves_its_own_number():
    usual = cost_growth.controlled(1)
    assert cost_growth.controlled(1, edge_spacing=2.0)["nodes"] < usual["nodes"]
    assert cost_growth.controlled(1, prediction=4.0)["steps"] < usual["steps"]
    assert usual["iterations_per_step"] == usual["iterations"] / usual["steps"]


def test_exponents_over_the_data_set(dataset, monkeypatch):
    found = cost_growth.over_the_data_set(dataset)
    assert set(found["exponents"]) == {"tabor", "peak_indentation", "loading_rate", "dwell_time", "unloading_rate"}
    data = load_dataset(dataset)
    power = data.protocols["tabor"] ** 2 / data.protocols["unloading_rate"]
    law = Dataset({**data.columns, "scalars/solver_seconds": power}, data.attributes, data.counts)
    monkeypatch.setattr(cost_growth, "load_dataset", lambda _: law)
    found = cost_growth.over_the_data_set(dataset)
    assert found["explained"] == pytest.approx(1.0)
    assert (found["exponents"]["tabor"], found["exponents"]["unloading_rate"]) == pytest.approx((2.0, -1.0))

"""The studies of cost and hard cases on the smallest samples that show what they do."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bem"))

import campaign_stand_in as stand_in

from bem import Elastic, HardContact, Scene, StandardLinearSolid
from bem.campaign import run_campaign
from bem.campaign_plan import Campaign
from bem.dataset_file import load_dataset
from experiments import (
    accuracy_cost,
    amortisation,
    broad_band,
    cost_growth,
    effects,
    hard_case_map,
    recommendations,
    soak,
    surrogate_map,
)
from experiments.measuring import exponent, plain, spread


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_campaign(Campaign(count=60, seed=2), path, solver=stand_in.solve)
    return path


@pytest.fixture(scope="module")
def cost(dataset, tmp_path_factory):
    folder = tmp_path_factory.mktemp("cost")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(accuracy_cost, "TRUTH_TARGET", 4e-3)
        patch.setattr(accuracy_cost, "TARGETS", (5e-2, 1.7e-2))
        patch.setattr(accuracy_cost, "RESOLUTIONS", (20, 30))
        patch.setattr(accuracy_cost, "TRUTHS", folder)
        out = folder / "cost.json"
        accuracy_cost.main(2, 1, 1, 20, 1, dataset, folder / "no models", out)
    return out


def test_plain_holds_nothing_json_cannot():
    content = {"a": np.array([1.0, np.nan]), "b": (np.int64(3), np.inf), "c": np.bool_(True)}
    assert json.dumps(plain(content), allow_nan=False) == '{"a": [1.0, null], "b": [3, null], "c": true}'


def test_spread_and_exponent():
    assert spread([1.0, 2.0, 3.0, np.nan])["median"] == 2.0
    assert spread([])["count"] == 0
    slope, error = exponent([1.0, 2.0, 4.0], [3.0, 12.0, 48.0])
    assert (slope, error) == (pytest.approx(2.0), pytest.approx(0.0, abs=1e-12))


def test_every_tool_is_measured_and_missing_models_are_named(cost):
    content = json.loads(cost.read_text(encoding="utf-8"))
    kinds = [(tool["kind"], tool["setting"]) for tool in content["tools"]]
    assert kinds == [
        ("measurement steps", ""),
        ("solver", "0.05"),
        ("solver", "draft"),
        ("paper's discretisation", "20 nodes, 20 steps"),
        ("closed form", "Hertz, rubbery"),
        ("closed form", "Lee and Radok"),
        ("closed form", "JKR, rubbery"),
    ]
    assert content["tools"][0]["errors"]["force"]["largest"] == 0.0
    assert all(tool["failures"] == 0 for tool in content["tools"])
    assert len(content["missing"]) == 18


def test_amortisation_finds_where_lines_cross(cost, dataset, tmp_path):
    out = tmp_path / "amortisation.json"
    amortisation.main(cost, dataset, tmp_path / "no models", out)
    content = json.loads(out.read_text(encoding="utf-8"))
    crossing = next(c for c in content["break_even"] if c["solver"] == "paper's solver")
    paper = {line["name"]: line for line in content["lines"]}
    at = crossing["queries"]
    assert at * paper["paper's solver"]["query_seconds"] == pytest.approx(
        paper["paper's surrogate"]["fixed_seconds"] + at * paper["paper's surrogate"]["query_seconds"]
    )
    assert 12_450 < at < 13_000
    assert (
        amortisation.break_even(amortisation.line("dear", "", 1.0, 2.0), amortisation.line("cheap", "", 0.0, 1.0))
        is None
    )
    with pytest.raises(FileNotFoundError, match="make measure-accuracy-cost"):
        amortisation.main(tmp_path / "absent.json", dataset, tmp_path, out)


def test_growth_of_both_solvers():
    ours = cost_growth.solver_seconds(cost_growth.CENTRE, 1)
    assert ours["steps"] > 20
    nodes, steps = cost_growth.resolution(cost_growth.CENTRE | {"tabor": 3.2, "peak_indentation": 100.0})
    assert (nodes, steps) == (436, 1069)
    theirs = cost_growth.baseline_seconds(cost_growth.CENTRE, 20, 20, 1)
    assert theirs["completed"]


def test_exponents_over_the_data_set(dataset):
    found = cost_growth.over_the_data_set(dataset)
    assert set(found["exponents"]) == {"tabor", "peak_indentation", "loading_rate", "dwell_time", "unloading_rate"}


def test_an_absent_effect_costs_no_vector_and_no_file():
    hertz = effects.row("Hertz", Scene(1.0, Elastic(), HardContact()), 1)
    full = effects.row("full", Scene(1.0, StandardLinearSolid(0.1)), 1)
    assert (hertz["memory_vectors"], full["memory_vectors"]) == (0, 1)
    assert hertz["files"] == ["hard_contact"]
    assert not set(hertz["files"]) & set(full["files"])
    assert hertz["error"] < 1e-4
    for name in [*effects.SHARED, *hertz["files"], *full["files"]]:
        assert (Path(effects.__file__).parents[1] / "bem" / f"{name}.py").is_file()


def test_stand_ins_name_every_simpler_scene():
    found = effects.stand_ins(1e-2)
    assert set(found["errors"]) == {"Hertz", "rubbery", "glassy", "no adhesion"}
    assert found["recommended"] == "elastic rubbery, adhesive"


@pytest.mark.parametrize("name", ["paper", "wider", "ten terms"])
def test_recommendations_are_checked(name):
    (case,) = recommendations.sample(name, 1)
    row = recommendations.checked(*case, 0.1, "force")
    assert row["kept"]
    assert recommendations.summary([row])["kept"] == 1


def test_extremes_and_map():
    named = hard_case_map.extremes()
    assert len(named) == 17
    found = hard_case_map.pair(*named["snap-in and snap-off, elastic"])
    assert (found["status"], found["jumps"], found["refined_jumps"]) == ("completed", 2, 2)
    assert found["energy"] > 0.0
    assert found["change"] < 4e-3
    points = hard_case_map.drawn("beyond", 4, 1)
    assert all(point["peak_indentation"] <= 200.0 * point["tabor"] ** -1.5 for point in points)
    assert hard_case_map.mapped(hard_case_map.drawn("inside", 1, 3)[0])["finite"]


def soak_summary(count, beyond, folder):
    out = folder / "soak.json"
    soak.main(count, beyond, 11, 1, folder / "chunks", out)
    return json.loads(out.read_text(encoding="utf-8"))


def test_soak_counts_and_continues(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "CHUNK", 10)
    content = soak_summary(20, 5, tmp_path)
    assert (content["inside"]["protocols"], content["beyond"]["protocols"]) == (20, 5)
    assert all(content[where]["raised"] == content[where]["silent"] == 0 for where in ("inside", "beyond"))

    def never(*_):
        raise AssertionError("chunks that are there must not be computed again")

    monkeypatch.setattr(soak, "simulate", never)
    assert soak_summary(20, 5, tmp_path)["inside"] == content["inside"]


def test_soak_sees_exceptions(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(soak, "simulate", broken)
    point = {name: float(values[0]) for name, values in soak.protocols("inside", 1, 0).items()}
    found = soak.soaked(point)
    assert found["raised"]
    assert found["status"] == "ZeroDivisionError: division by zero"


@pytest.mark.slow
def test_one_percent_of_the_soak(tmp_path):
    content = soak_summary(1000, 200, tmp_path)
    for where in ("inside", "beyond"):
        assert content[where]["statuses"] == {"completed": content[where]["protocols"]}
        assert content[where]["silent"] == 0
        assert content[where]["memory_growth"] < 0.05


def test_errors_of_a_surrogate_are_mapped(dataset, monkeypatch):
    data = load_dataset(dataset)
    rows = data.completed[:12]

    def predict(times, *_):
        return np.array([np.interp(t, t, np.linspace(-1.0, 1.0, 120)) for t in times])

    content, predicted = surrogate_map.over_the_box(predict, data, rows)
    monkeypatch.setattr(surrogate_map, "WORST", 3)
    found = surrogate_map.worst(content, data, predicted)
    ordered = [case["errors"]["force"] for case in found]
    assert ordered == sorted(content["errors"]["force"], reverse=True)[:3]
    assert sum(values["count"] for values in surrogate_map.shares(content).values()) >= 12
    rows = surrogate_map.out_of_range(predict, 1, 0)
    assert len(rows) == 5 * 2 * 4
    assert max(row["value"] for row in rows if row["quantity"] == "tabor") == 6.4


def test_corners_are_where_two_quantities_are_extreme():
    from bem.designs import PAPER_RANGES

    low = {name: np.array([bounds[0], np.sqrt(bounds[0] * bounds[1])]) for name, bounds in PAPER_RANGES.items()}
    np.testing.assert_array_equal(surrogate_map.edges_touched(low), [5, 0])


@pytest.mark.parametrize("n", broad_band.EXPONENTS)
def test_series_stands_for_the_power_law(n):
    material, error = broad_band.prony_fit(n)
    assert error < 1e-3
    assert material.modulus_ratio == pytest.approx(0.1, rel=1e-9)
    times = np.array([0.0, 0.5, 5.0, 50.0])
    np.testing.assert_allclose(material.creep_compliance(times), broad_band.power_law(n, times), atol=1e-3)


def test_amplification_grows_from_one_towards_the_modulus_ratio():
    material = StandardLinearSolid(broad_band.RATIO)
    slow, fast = (broad_band.pulled(material, 10.0, rate, "draft")["amplification"] for rate in (1e-3, 1e5))
    assert slow == pytest.approx(1.05, abs=0.05)
    assert 6.0 < fast < 10.0

"""The studies of cost and hard cases on the smallest samples that show what they do."""

import csv
import json
import os
import shutil
import sys
import time
from pathlib import Path

import numpy as np
import pytest

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("TF_NUM_INTRAOP_THREADS", "1")

sys.path.insert(0, str(Path(__file__).parents[1] / "bem"))

import campaign_stand_in as stand_in

from bem import Elastic, HardContact, LoadingProtocol, Scene, StandardLinearSolid
from bem.campaign import run_campaign
from bem.campaign_plan import Campaign
from bem.dataset_file import load_dataset
from experiments import (
    accuracy_cost,
    amortisation,
    broad_band,
    closed_form_tools,
    cost_growth,
    effect_files,
    effects,
    hard_case_map,
    measuring,
    recommendations,
    soak,
    solver_sample,
    surrogate_cost,
    surrogate_map,
)
from experiments.measuring import exponent, force_error, plain, spread

KINDS = [f"{name}, {kind}" for name in ("DMT-like", "JKR-like") for kind in ("elastic", "one relaxation")]


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
        patch.setattr(accuracy_cost, "BASELINE", {20: 0.5, 30: 0.5})
        patch.setattr(accuracy_cost, "TRUTHS", folder)
        out = folder / "cost.json"
        accuracy_cost.main(2, 2, 20, 1, dataset, folder / "no models", out)
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


def test_seconds_are_those_of_the_whole_call(monkeypatch):
    """A tool that says it took no time is timed all the same."""
    case = solver_sample.sample_cases(1, 0)[0]
    quick = case.run(0.05)
    monkeypatch.setattr(solver_sample, "simulate", lambda *_: time.sleep(0.01) or quick)
    table, seconds = accuracy_cost.run([case], accuracy_cost.solver_at(0.05), 3, "slow")
    assert table.shape == (1, 122)
    assert seconds.shape == (3, 1)
    assert seconds.min() >= 0.01


def test_a_dear_tool_is_not_repeated(monkeypatch):
    monkeypatch.setattr(accuracy_cost, "BUDGET", 0.015)
    calls = []
    _, seconds = accuracy_cost.run([0], lambda case: calls.append(case) or time.sleep(0.01) or np.zeros(122), 5, "dear")
    assert (len(seconds), len(calls)) == (1, 2)


def test_kept_solutions_belong_to_their_solver_accuracy_and_protocols(tmp_path, monkeypatch):
    monkeypatch.setattr(accuracy_cost, "TRUTHS", tmp_path)
    monkeypatch.setattr(accuracy_cost, "measured", lambda _, target: np.full(123, target))
    first, second = solver_sample.sample_cases(2, 0)
    accuracy_cost.refined([first], 1)
    accuracy_cost.refined([first], 1)
    assert len(list(tmp_path.iterdir())) == 1
    accuracy_cost.refined([second], 1)
    monkeypatch.setattr(accuracy_cost, "TRUTH_TARGET", 1e-2)
    accuracy_cost.refined([first], 1)
    monkeypatch.setattr(accuracy_cost, "solver_digest", lambda: "another")
    accuracy_cost.refined([first], 1)
    assert len(list(tmp_path.iterdir())) == 4


def made_case(tabor, depth, rate, dwell=0.1):
    ramps = {"peak_indentation": depth, "loading_rate": rate, "dwell_time": dwell, "unloading_rate": rate}
    return solver_sample.Case(Scene(tabor, StandardLinearSolid(0.1)), LoadingProtocol(**ramps))


@pytest.mark.parametrize(
    ("case", "inside"),
    [
        (made_case(1.0, 80.0, 0.1), {"Hertz, rubbery", "Lee and Radok, until the peak", "Maugis-Dugdale, rubbery"}),
        (made_case(1.0, 80.0, 1e4, 1e-3), {"Hertz, glassy", "Lee and Radok, until the peak"}),
        (made_case(3.0, 2.0, 0.1), {"JKR, rubbery", "Maugis-Dugdale, rubbery", "Persson-Brener, pull-off"}),
        (made_case(0.2, 2.0, 0.1), {"DMT, rubbery", "Maugis-Dugdale, rubbery"}),
        (made_case(1.0, 2.0, 5.0), set()),
    ],
)
def test_closed_forms_are_asked_in_their_regime_only(case, inside):
    assert {form.name for form in closed_form_tools.FORMS if form.meant_for(case)} >= inside
    if not inside:
        assert not any(form.meant_for(case) for form in closed_form_tools.FORMS)


def test_closed_forms_are_close_to_the_solver_where_they_are_exact():
    forms = {form.name: form for form in closed_form_tools.FORMS}
    slow, fast, short = made_case(1.0, 80.0, 0.1), made_case(1.0, 80.0, 1e4, 1e-3), made_case(3.0, 20.0, 1.0, 3.0)
    for name, case in (("Hertz, rubbery", slow), ("Hertz, glassy", fast), ("Lee and Radok, until the peak", fast)):
        _, force = forms[name].answer(case)
        exact = case.force_history(case.run("draft"))
        assert force_error(force[None], exact[None])[0] < 0.05
        assert np.isnan(force[closed_form_tools.FIRST_UNLOADING + 1 :]).all() == name.startswith("Lee")
    pull_off, force = forms["Persson-Brener, pull-off"].answer(short)
    assert pull_off == pytest.approx(short.run("standard").pull_off_force, rel=0.1)
    assert np.isnan(force).all()


def test_force_error_counts_what_is_said():
    exact = np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]])
    found = np.array([[0.5, 1.0, np.nan], [np.nan, np.nan, np.nan]])
    np.testing.assert_allclose(force_error(found, exact), [0.125, np.nan])


def test_progress_says_what_is_left(monkeypatch, capsys):
    monkeypatch.setattr(measuring, "SAID_EVERY", -1.0)
    assert list(measuring.progress(iter("abc"), "letters", 3)) == ["a", "b", "c"]
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in lines] == ["letters: 1 of 3", "letters: 2 of 3", "letters: 3 of 3"]
    assert all(line.endswith(" left") for line in lines)


@pytest.fixture(scope="module")
def models(dataset, tmp_path_factory):
    """A tiny trained model, one without weights, one whose files are not of one piece, one of another data set."""
    import keras

    from experiments import surrogate_cost
    from surrogate.architectures import common
    from surrogate.layers import AppendTabor

    def build(name, features="D"):
        sequence, tabor = common.inputs(features)
        hidden = AppendTabor(name="append")(sequence, tabor)
        return keras.Model([sequence, tabor], keras.layers.Dense(1, name="force")(hidden), name=name)

    folder = tmp_path_factory.mktemp("models")
    with pytest.MonkeyPatch.context() as patch:
        for module in ("surrogate.runs", "surrogate.backends"):
            patch.setattr(f"{module}.build", build)
        from surrogate.dataset import TrajectoryDataset
        from surrogate.recipe import Recipe
        from surrogate.runs import Run, execute, publish

        recipe = folder / "recipe.toml"
        recipe.write_text(
            'name = "test"\nseed = 3\nbatch_size = 20\nepochs = 1\nlearning_rate = 1e-3\noptimizer = "soap"\n'
            "weight_average = 0.5\ngradient_norm = 1.0\n[cosine]\nwarmup_epochs = 1\n",
            encoding="utf-8",
        )
        data = TrajectoryDataset.load(dataset)
        execute(Run("M1-concat", data, data.split(), Recipe.load(recipe)), folder / "run")
        publish(folder / "run", folder / "models" / "M1-concat")
        good = folder / "models" / "M1-concat"
        for name in ("M1-FiLM", "M1-gated", "M2-concat"):
            shutil.copytree(good, good.with_name(name))
        (good.with_name("M1-FiLM") / "model.weights.h5").unlink()
        (good.with_name("M1-gated") / "model.onnx").write_bytes(b"no model")
        run = json.loads((good / "run.json").read_text(encoding="utf-8"))
        for file in ("run.json", "scaling.json"):
            path = good.with_name("M2-concat") / file
            path.write_text(path.read_text(encoding="utf-8").replace(run["dataset_sha256"], "f" * 64), encoding="utf-8")
        assert surrogate_cost.published(folder / "models") == ["M1-concat", "M1-gated", "M2-concat"]
        yield folder / "models"


def test_surrogates_are_measured_and_what_does_not_work_is_named(models, dataset, tmp_path, monkeypatch):
    assert surrogate_cost.missing(models)[:1] == ["M1-FiLM (no model.weights.h5)"]
    assert surrogate_cost.outdated(models, dataset) == ["M2-concat"]
    monkeypatch.setattr(accuracy_cost, "TARGETS", (1.7e-2,))
    monkeypatch.setattr(accuracy_cost, "TRUTH_TARGET", 5e-2)
    monkeypatch.setattr(accuracy_cost, "BASELINE", {})
    monkeypatch.setattr(accuracy_cost, "FORMS", ())
    monkeypatch.setattr(accuracy_cost, "TRUTHS", tmp_path)
    monkeypatch.setattr(surrogate_cost, "SINGLE_CALLS", 2)
    written, write = [], accuracy_cost.write_result

    def noted(out, study, content):
        written.append(content["complete"])
        write(out, study, content)

    monkeypatch.setattr(accuracy_cost, "write_result", noted)
    out = tmp_path / "cost.json"
    accuracy_cost.main(3, 2, 0, 1, dataset, models, out)
    assert written == [False, True]
    content = json.loads(out.read_text(encoding="utf-8"))
    surrogates = [tool for tool in content["tools"] if tool["kind"] == "surrogate"]
    ways = [tool["way"] for tool in surrogates if tool["model"] == "M1-concat"]
    assert ways == ["Keras call", "ONNX single", "ONNX batch"]
    assert all(tool["protocols"] == 3 and tool["seconds"]["median"] > 0.0 for tool in surrogates)
    assert len(set(surrogates[0]["seconds_each"])) == 2  # of three protocols, the two that are timed
    assert {tool["model"] for tool in surrogates if tool["outdated"]} <= {"M2-concat"}
    assert content["outdated"] == ["M2-concat"]
    broken = [text for text in content["missing"] if text.startswith("M1-gated")]
    assert len(broken) == 1
    assert not any(tool["model"] == "M1-gated" for tool in surrogates)
    result = tmp_path / "amortisation.json"
    amortisation.main(out, dataset, models, result)
    later = json.loads(result.read_text(encoding="utf-8"))
    assert "M1-gated" in later["unmeasured"]
    assert later["outdated"] == ["M2-concat"]
    assert any(one["surrogate"] == "M1-concat, ONNX batch" for one in later["break_even"])


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
    with pytest.raises(ValueError, match="repeats must be at least 3; received 1"):
        cost_growth.main(1)


def test_exponents_over_the_data_set(dataset):
    found = cost_growth.over_the_data_set(dataset)
    assert set(found["exponents"]) == {"tabor", "peak_indentation", "loading_rate", "dwell_time", "unloading_rate"}


def test_an_absent_effect_costs_no_vector_and_no_file():
    scenes = {
        "Hertz": Scene(1.0, Elastic(), HardContact()),
        "adhesion": Scene(1.0),
        "full": Scene(1.0, StandardLinearSolid(0.1)),
    }
    rows = {name: effects.row(name, scene, 1) for name, scene in scenes.items()}
    assert [row["memory_vectors"] for row in rows.values()] == [0, 0, 1]
    assert rows["Hertz"]["error"] < 1e-4
    code = effect_files.code_of(scenes)
    own = effect_files.own_files(code)
    assert own["Hertz"] == ["hard_contact"]
    assert {"equilibrium", "tractions", "folds"} <= set(own["adhesion"])
    assert "memory" in own["full"]
    assert not {"hard_contact", "memory"} & set(own["adhesion"])
    assert "march" in effect_files.branches(code)["adhesion"]


def test_what_runs_is_noted_whatever_a_scene_is_called():
    code = effect_files.code_of({"Hertz": Scene(1.0), "rubber": Scene(1.0, adhesion=HardContact())})
    assert "equilibrium" in effect_files.own_files(code)["Hertz"]
    with pytest.raises(RuntimeError, match="tracing the scenes must succeed"):
        effect_files.code_of({"none": None})


def test_limits_of_stand_ins_are_the_outermost_that_are_safe():
    points = [{"tabor": mu, **dict.fromkeys(KINDS, error)} for mu, error in ((0.1, 0.2), (1.0, 0.01), (5.0, 0.04))]
    bands = [{"decades": d, "rate": rate, "error": 0.04 * d} for d in (1.0, 2.0) for rate in effects.SLOW_AND_FAST]
    found = {(row["stand_in"], row["instead_of"]): (row["low"], row["high"]) for row in effects.safe(points, bands)}
    assert found["JKR-like, mu = 3.2", "another range, elastic"] == (1.0, 5.0)
    assert found["DMT-like, mu = 0.2", "another range, elastic"] == (0.2, 5.0)
    assert found["one relaxation", "ten relaxations, rate 20"] == (0.0, 1.0)


def test_another_range_is_no_other_range_at_its_own_tabor_parameter():
    found = effects.of_another_range(effects.DMT_TABOR)
    assert found["DMT-like, elastic"] == 0.0
    assert found["JKR-like, elastic"] > 0.1
    assert effects.of_one_process(0.25, 20.0)["error"] < 0.01


def test_stand_ins_name_every_simpler_scene():
    found = effects.stand_ins(1e-2)
    assert set(found["errors"]) == {"Hertz", "rubbery", "glassy", "no adhesion"}
    assert found["recommended"] == "elastic rubbery, adhesive"


@pytest.mark.parametrize("name", recommendations.SAMPLES)
def test_recommendations_are_checked(name):
    (case,) = recommendations.sample(name, 1)
    row = recommendations.checked(*case, 0.1, "force")
    assert row["kept"] is (True if row["simplified"] else None)
    found = recommendations.summary([row])
    assert (found["cases"], found["simplified"], found["kept"]) == (1, row["simplified"], row["simplified"])


def test_what_is_kept_is_counted_of_what_is_simplified():
    full = {"simplified": False, "kept": None, "error": None, "ratio": None}
    simple = {"simplified": True, "kept": True, "error": 0.01, "ratio": 0.5, "full_seconds": 1.0}
    common = {"found_by": "estimate", "effects": "elastic", "seconds": 0.1}
    found = recommendations.summary([full | common, simple | common, simple | common | {"kept": False, "ratio": 2.0}])
    assert (found["simplified"], found["kept"], found["slower"], found["worst_error"]) == (2, 1, 1, 0.01)
    assert recommendations.summary([full | common])["worst_error"] is None


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


def test_extremes_are_run_more_coarsely_too():
    found = hard_case_map.extreme("jumps", *hard_case_map.extremes()["snap-in and snap-off, elastic"])
    assert set(found["coarse"]) == {"draft", "0.05"}
    assert all(one["status"] == "completed" and one["change"] < 0.5 for one in found["coarse"].values())


def test_a_lone_spike_is_told_from_peaks_and_jumps():
    peak = np.sin(np.linspace(0.0, 3.0, 40))
    assert soak.lone_spikes(peak, 1.0) == 0
    assert soak.lone_spikes(np.concatenate([peak[:20], peak[:20] - 3.0]), 1.0) == 0
    assert soak.lone_spikes(np.array([0.0, 0.0, 1.0, 0.2, 0.1, 0.0]), 1.0) == 0
    for spike in (868.0, -0.5):
        assert soak.lone_spikes(np.insert(peak, 10, spike), 1.0) == 1
    assert soak.lone_spikes(np.array([0.0, 9.0, 0.0]), 1.0) == 0


def test_a_small_soak_raises_nothing_and_keeps_its_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "CHUNK", 6)
    content = soak_summary(48, 12, tmp_path)
    inside, beyond = content["inside"], content["beyond"]
    assert inside["chunks"] == 8
    assert inside["memory_growth"] < 0.2
    assert beyond["memory_growth"] is None  # too few chunks to say
    for found in (inside, beyond):
        assert found["raised"] == found["silent"] == 0
        assert found["statuses"] == {"completed": found["protocols"]}


def test_chunks_belong_to_their_solver_accuracy_and_protocols(tmp_path, monkeypatch):
    monkeypatch.setattr(
        soak, "soaked", lambda _: {"status": "completed", "raised": False, "silent": False, "spikes": 0, "seconds": 1}
    )
    soak.chunk("inside", 0, 4, 1, tmp_path)
    soak.chunk("inside", 0, 4, 1, tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    soak.chunk("inside", 0, 4, 2, tmp_path)
    monkeypatch.setattr(soak, "ACCURACY", "draft")
    soak.chunk("inside", 0, 4, 1, tmp_path)
    monkeypatch.setattr(soak, "solver_digest", lambda: "another")
    soak.chunk("inside", 0, 4, 1, tmp_path)
    assert len(list(tmp_path.iterdir())) == 4


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
def test_one_percent_of_the_soak(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "CHUNK", 25)
    content = soak_summary(1000, 200, tmp_path)
    for where in ("inside", "beyond"):
        assert content[where]["chunks"] >= 8
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
    assert all(isinstance(case["corner"], bool) for case in found)
    rows = surrogate_map.out_of_range(predict, 1, 0)
    assert len(rows) == 5 * 2 * 4
    assert max(row["value"] for row in rows if row["quantity"] == "tabor") == 6.4


def test_a_cause_is_named_only_where_the_error_is():
    truth = np.zeros((4, 120))
    truth[:, 100:] = -1.0  # all four jump at step 99, and have their peak at the first unloading step
    predicted = truth.copy()
    predicted[0, 98:102] += 0.5
    predicted[1] += 0.5
    predicted[2, 68:71] += 0.5
    floor = np.array([0.2, 0.2, 0.2, 0.0])
    jumps = np.array([1, 1, 0, 0])
    found = surrogate_map.causes(jumps, floor, predicted, truth)
    assert found == [["jump"], [], ["narrow peak"], []]


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


def test_broad_band_file_says_terms_status_and_both_amplifications(tmp_path, monkeypatch):
    monkeypatch.setattr(broad_band, "EXPONENTS", (1.6,))
    monkeypatch.setattr(broad_band, "PRELOADS", (10.0,))
    out = tmp_path / "broad.json"
    broad_band.main(3, "draft", 1, out)
    content = json.loads(out.read_text(encoding="utf-8"))
    with out.with_suffix(".csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 3
    assert {row["status"] for row in rows} == {"completed"}
    assert {row["terms"] for row in rows} == {"7", "1"}
    assert float(rows[0]["unloading_rate"]) == 1e-6
    ratio = float(rows[0]["amplification"]) / float(rows[0]["own_amplification"])
    assert ratio == pytest.approx(content["elastic_pull_off"] / 1.5, rel=1e-4)
    assert 1.0 < ratio < 1.1

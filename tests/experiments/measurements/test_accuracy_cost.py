"""Seconds against errors of every tool on the smallest samples, closed forms included, and when a surrogate pays."""

import shutil
import types

import numpy as np
import pytest

from bem import LoadingProtocol, Scene, StandardLinearSolid
from bem._support.text_files import plain, read_json
from bem.dataset.file import load_dataset
from experiments import cases
from experiments.cases import held_out
from experiments.common import dataset_digest
from experiments.measurements import accuracy_cost, closed_forms, tools
from experiments.measurements.closed_forms import Form
from experiments.measurements.statistics import force_error
from experiments.trainings import training_costs
from surrogate.data.dataset import TrajectoryDataset
from surrogate.files import PUBLISHED, weights_sha256, write_run
from tests.experiments import models

DATASET = PUBLISHED.parent / "dataset.h5"


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A published model, one without weights, and one of another recipe."""
    folder = tmp_path_factory.mktemp("trained")
    for name in ("M1-concat", "M1-FiLM", "M2-concat"):
        shutil.copytree(PUBLISHED / "M1-concat", folder / name)
    (folder / "M1-FiLM" / "model.weights.h5").unlink()
    for name in ("trainings.h5", "split.json"):
        shutil.copy(PUBLISHED / name, folder / name)
    run = read_json(folder / "M2-concat" / "run.json")
    write_run(folder / "M2-concat", run | {"recipe": run["recipe"] | {"name": "other"}})
    return folder


@pytest.fixture(scope="module")
def cost(trained, tmp_path_factory):
    """What the measurement of accuracy and cost is for three protocols."""
    settings = {"TARGETS": (5e-2, 1.7e-2), "BASELINE": {20: 0.5, 30: 0.5}, "SINGLE_CALLS": 2, "BATCH": 4}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tools, "EXACT_TARGET", 4e-3)
        patch.setattr(tools, "KEPT", tmp_path_factory.mktemp("kept"))
        for name, value in settings.items():
            patch.setattr(accuracy_cost, name, value)
        return plain(accuracy_cost.study(DATASET, trained, count=3, repeats=2, finest=20, jobs=1))


def test_all_tools_are_measured(cost, trained):
    measured = {(tool["kind"], tool["setting"]): tool for tool in cost["tools"]}
    first, *solver, paper = list(measured)[:4]
    assert (first, [setting for _, setting in solver]) == (("measurement steps", ""), ["0.05", "draft"])
    assert paper == ("paper's discretisation", "20 nodes, 20 steps")
    assert measured[first]["errors"]["force"]["largest"] == 0.0
    assert [measured[key]["protocols"] for key in (*solver, paper)] == [3, 3, 2]
    one_at_a_time = [tool for tool in cost["tools"][1:] if not tool.get("way", "").endswith("batch")]
    assert all(tool["repeats"] == 2 and len(tool["run_totals"]) == 2 for tool in one_at_a_time)
    assert all(tool["failures"] == 0 and tool["seconds"]["median"] > 0.0 for tool in cost["tools"][1:])
    surrogates = [tool for tool in cost["tools"] if tool["kind"] == "surrogate"]
    ways = [tool["way"] for tool in surrogates if tool["model"] == "M1-concat"]
    assert ways == ["Keras call", "ONNX single", "ONNX batch"]
    assert surrogates[0]["seconds"]["count"] == 2  # of three protocols, the two that are timed
    assert {tool["model"] for tool in surrogates if tool["outdated"]} == {"M2-concat"}
    pretrained = [tool for tool in cost["tools"] if tool["kind"] in ("fast", "accurate")]
    assert [tool["setting"] for tool in pretrained] == 2 * ["NumPy single", "NumPy batch"]
    assert all(tool["errors"]["pull_off_force"]["median"] < 0.1 for tool in pretrained)
    later = training_costs.study_amortisation(cost, DATASET, trained)
    for study in (cost, later):
        assert (study["outdated"], study["missing"][0], len(study["missing"])) == (["M2-concat"], "M1-FiLM", 16)
    assert any(crossing["surrogate"] == "M1-concat, ONNX batch" for crossing in later["break_even"])


def test_tools_are_reported_by_medians(monkeypatch):
    exact = np.random.default_rng(0).random((3, 122))
    seconds = np.array([[1.0], [2.0], [9.0]])
    assert accuracy_cost.report("any", "", exact[:1], seconds, exact[:1])["seconds"]["median"] == 2.0
    monkeypatch.setattr(accuracy_cost, "FORMS", (Form("last", lambda case: case == 2, lambda case: exact[case]),))
    monkeypatch.setattr(accuracy_cost, "TARGETS", ())
    (row,) = accuracy_cost.solver_and_closed_forms([0, 1, 2], exact, 1, finest=0)
    assert (row["kind"], row["protocols"], row["errors"]["force"]["largest"]) == ("closed form", 1, 0.0)


def test_held_out_cases_are_of_the_data_set(dataset):
    (case,) = held_out(1, dataset)
    data = TrajectoryDataset.load(dataset)
    assert case.scene.tabor == data.protocols["tabor"][data.split(0).test[0]]
    assert tools.solver_at(0.05)(case).shape == (122,)
    answer = tools.answer_of(case, types.SimpleNamespace(completed=False))
    assert np.isnan(answer).all()


def test_refined_answers_depend_on_cases(dataset, tmp_path, monkeypatch):
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


def write_model(folder, dataset):
    models.write_model(folder, architecture="M1-concat", dataset_sha256=dataset_digest(dataset))
    for name in tools.FILES:
        if not (folder / name).exists():
            (folder / name).write_text(folder.name, encoding="utf-8")


def test_seconds_of_retrained_models_dropped(dataset, tmp_path):
    folder = tmp_path / "models"
    for name in ("M1-concat", "M1-FiLM", "M1-gated", "M2-concat"):
        write_model(folder / name, dataset)
    digests = {name: weights_sha256(folder / name) for name in ("M1-concat", "M1-FiLM")}
    (folder / "M1-FiLM" / "model.weights.h5").write_text("trained anew", encoding="utf-8")
    common = {"kind": "surrogate", "way": "ONNX single", "errors": {}, "seconds": {"mean": 1e-3}}
    measured = [{"model": name, "setting": name, "weights_sha256": digest} | common for name, digest in digests.items()]
    measured.append({"model": "M1-gated", "setting": "M1-gated"} | common)
    costs = training_costs.study_amortisation({"tools": measured}, dataset, folder)
    assert [line["name"] for line in costs["lines"] if line["kind"] == "surrogate"] == ["M1-concat"]
    (line,) = (line for line in costs["lines"] if line["kind"] == "surrogate")
    assert line["fixed_seconds"] == load_dataset(dataset).scalars["solver_seconds"].sum() + 120.0
    assert costs["retrained"] == ["M1-FiLM", "M1-gated"]
    assert costs["unmeasured"] == ["M2-concat"]


def test_loop_area_has_no_direction(monkeypatch):
    depth, force = np.r_[np.linspace(0.0, 1.0, 60), np.linspace(1.0, 0.0, 60)], np.repeat([2.0, 0.0], 60)
    answers = tools.from_steps(np.array([force, force[::-1]]), np.array([depth, depth]))
    assert answers[:, 1] == pytest.approx(2.0)
    monkeypatch.setattr(accuracy_cost, "timed", lambda _, repeats: [8.0] * repeats)
    monkeypatch.setattr(accuracy_cost, "BATCH", 4)
    answers = {"ONNX": lambda cases: np.ones((len(cases), 122))}
    _, seconds = accuracy_cost.timed_calls(answers, [1, 2, 3], 1, "any")["ONNX batch"]
    assert seconds.tolist() == [[2.0] * 3] * accuracy_cost.BATCH_REPEATS


def made_case(tabor, depth, rate, dwell=0.1, unloading=None):
    ramps = {"peak_indentation": depth, "loading_rate": rate, "dwell_time": dwell, "unloading_rate": unloading or rate}
    return cases.Case(Scene(tabor, StandardLinearSolid(0.1)), LoadingProtocol(**ramps))


@pytest.mark.parametrize(
    ("case", "inside"),
    [
        (made_case(1.0, 80.0, 0.1), {"Hertz, rubbery", "Lee and Radok, until the peak", "Maugis-Dugdale, rubbery"}),
        (made_case(1.0, 80.0, 1e4, 1e-3), {"Hertz, glassy", "Lee and Radok, until the peak"}),
        (made_case(3.0, 2.0, 0.1), {"JKR, rubbery", "Maugis-Dugdale, rubbery", "Persson-Brener, pull-off"}),
        (made_case(0.2, 2.0, 0.1), {"DMT, rubbery", "Maugis-Dugdale, rubbery"}),
        (made_case(1.0, 2.0, 5.0), set()),
        (made_case(1.0, 2.0, 1.0), set()),  # ramps of four retardation times are not slow
        (made_case(1.0, 2.0, 0.1, unloading=1e3), set()),
    ],
)
def test_closed_forms_answer_in_their_regime(case, inside):
    assert {form.name for form in closed_forms.FORMS if form.meant_for(case)} >= inside
    if not inside:
        assert not any(form.meant_for(case) for form in closed_forms.FORMS)


def test_closed_forms_agree_with_the_solver():
    forms = {form.name: form for form in closed_forms.FORMS}
    slow, fast, short = made_case(1.0, 80.0, 0.1), made_case(1.0, 80.0, 1e4, 1e-3), made_case(3.0, 20.0, 1.0, 3.0)
    for name, case in (("Hertz, rubbery", slow), ("Hertz, glassy", fast), ("Lee and Radok, until the peak", fast)):
        force = forms[name].answer(case)[2:]
        exact = case.on_steps(case.run("draft"))["force"]
        assert force_error(force[None], exact[None])[0] < 0.05
        assert np.isnan(force[closed_forms.FIRST_UNLOADING + 1 :]).all() == name.startswith("Lee")
    pull_off, _, *force = forms["Persson-Brener, pull-off"].answer(short)
    assert pull_off == pytest.approx(short.run("standard").pull_off_force, rel=0.1)
    assert np.isnan(force).all()


def test_break_even_is_where_lines_cross(cost, dataset, tmp_path):
    costs = training_costs.study_amortisation(cost, dataset, tmp_path / "no models")
    crossing = next(c for c in costs["break_even"] if c["solver"] == "paper's solver")
    paper = {line["name"]: line for line in costs["lines"]}
    at = crossing["queries"]
    assert at * paper["paper's solver"]["query_seconds"] == pytest.approx(
        paper["paper's surrogate"]["fixed_seconds"] + at * paper["paper's surrogate"]["query_seconds"]
    )
    assert 12_450 < at < 13_000
    dear, cheap = training_costs.line("dear", "", 1.0, 2.0), training_costs.line("cheap", "", 0.0, 1.0)
    assert training_costs.break_even(dear, cheap) is None

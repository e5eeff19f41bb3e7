"""The solver beside another revision: in processes of their own, in turn, and judged."""

from types import SimpleNamespace

import numpy as np
import pytest

from bem import Elastic, HardContact, StandardLinearSolid
from experiments.robustness import bench_solver, solver_child
from experiments.robustness.bench_solver import BEYOND, ROOT, Solver, compared, requests, table_of


@pytest.fixture(scope="module")
def solver():
    one = Solver(ROOT)
    yield one
    one.close()


@pytest.mark.parametrize("revision", ["no-such-revision", "--output=x"])
def test_an_unknown_baseline_is_refused(revision, tmp_path, monkeypatch):
    monkeypatch.setattr(bench_solver, "KEPT", tmp_path)
    with pytest.raises(ValueError, match="baseline must be a git revision; received"):
        bench_solver.source_of(revision)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", ["fine", "0", "nan"])
def test_an_unknown_accuracy_is_refused_before_anything_runs(words):
    with pytest.raises(ValueError, match="accuracy must be 'draft'"):
        bench_solver.study(baseline="HEAD", accuracy=[words])


def test_the_package_of_a_revision_is_checked_out_once(tmp_path, monkeypatch):
    monkeypatch.setattr(bench_solver, "KEPT", tmp_path)
    source = bench_solver.source_of("HEAD")
    assert (source / "bem" / "__init__.py").is_file()
    monkeypatch.setattr(bench_solver.tarfile, "open", None)
    assert bench_solver.source_of("HEAD") == source


def test_what_a_solver_raises_is_its_status(solver):
    (request,) = requests("inside", 1, 0)
    found = solver(request | {"tabor": -1.0}, "draft")
    assert found["status"].startswith("ValueError: tabor must be")
    assert np.all(np.isnan(table_of([found])))


def test_seconds_are_those_of_the_simulation_and_the_least_of_the_runs(monkeypatch):
    (request,) = requests("inside", 1, 0)
    instants = iter([0.0, 1.0, 3.5])
    monkeypatch.setattr(solver_child, "time", SimpleNamespace(process_time=lambda: next(instants)))
    monkeypatch.setattr(solver_child.bem, "simulate", lambda *_: SimpleNamespace(status="stopped", completed=False))
    assert solver_child.answer(request | {"accuracy": "draft"}) == {"seconds": 2.5, "status": "stopped"}
    answers = iter([{"seconds": seconds, "status": "completed"} for seconds in (9.0, 9.0, 3.0, 2.0, 4.0, 1.0)])
    found = compared([lambda *_: next(answers)] * 2, "stiff", "draft", [request], None, 2)  # the first load the kernels
    assert found["seconds"].tolist() == [[2.0], [1.0]]


def test_a_solver_beside_itself_errs_the_same(solver):
    inside = requests("inside", 2, 1)
    exact = table_of([solver(one, "standard") for one in inside])
    same, other = (compared([solver, solver], "inside", one, inside, exact, 1) for one in ("standard", 1.7e-2))
    beyond = compared([solver, solver], "stiff", "standard", requests("stiff", 2, 1), None, 1)
    for one in (same, other, beyond):
        assert one["not_completed"] == [0, 0]
    assert same["errors"][0]["force"]["largest"] == 0.0 < other["errors"][0]["force"]["largest"]
    assert other["errors"][0] == other["errors"][1]
    row = bench_solver.row_of(other)
    assert float(row[3].split("/")[1]) == pytest.approx(1e3 * other["seconds"][1].mean(), rel=0.01)
    assert bench_solver.row_of(same)[-1] == "0, 0, 0 / 0, 0, 0"
    assert bench_solver.row_of(beyond)[-1] == ""


def test_cost_is_compared_where_both_completed():
    answers = {1.0: ("completed", 1.0), 2.0: ("completed", 10.0), 3.0: ("stopped", 1.0), 4.0: ("completed", 1.0)}
    asked = [{"place": place} for place in answers]

    def old(request, _):
        status, seconds = answers[request["place"]]
        return {"status": status, "seconds": seconds}

    def new(request, _):
        return {"status": "not started: x" if request["place"] == 4.0 else "completed", "seconds": 5.0}

    found = compared([old, new], "stiff", "standard", asked, None, 1)
    assert (found["ratio"], found["largest_ratio"]) == (pytest.approx(10.0 / 11.0), 5.0)
    assert found["not_completed"] == [1, 1]


def test_samples_differ_in_what_they_ask_for():
    asked = {sample: requests(sample, 20, 1) for sample in BEYOND}
    scenes = {sample: [solver_child.scene_of(one) for one in several] for sample, several in asked.items()}
    assert all(isinstance(scene.material, Elastic) for scene in scenes["elastic"])
    assert all(isinstance(scene.material, StandardLinearSolid) for scene in scenes["beyond"])
    assert 0 < sum(isinstance(scene.adhesion, HardContact) for scene in scenes["stiff"]) < 20
    alike = [[{**one, "modulus_ratio": 0} for one in asked[sample]] for sample in ("elastic", "beyond")]
    assert alike[0] == alike[1]

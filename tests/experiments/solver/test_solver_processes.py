"""Solvers in processes of their own: what one raises, and which refined solutions are kept."""

from types import SimpleNamespace

import numpy as np

from experiments.solver import solver_child, solver_processes
from experiments.solver.solver_processes import ROOT, Solver


def test_what_a_solver_raises_is_its_status():
    solver = Solver(ROOT)
    (request,) = solver_processes.drawn(1, 0)
    found = solver(request | {"tabor": -1.0}, "draft")
    solver.close()
    assert found["status"].startswith("ValueError: tabor must be")
    assert np.all(np.isnan(solver_processes.results(found, 120)))


def test_kept_solutions_belong_to_their_solver_accuracy_and_protocols(tmp_path, monkeypatch):
    class StandIn:
        def __init__(self, source):
            pass

        def __call__(self, _, accuracy):
            return {"results": [accuracy] * 122}

        def close(self):
            pass

    monkeypatch.setattr(solver_processes, "KEPT", tmp_path)
    monkeypatch.setattr(solver_processes, "Solver", StandIn)
    first, second = solver_processes.drawn(2, 0)

    def kept(request, solver):
        table = solver_processes.refined([request], ROOT, solver, 1)
        assert np.all(table == solver_processes.EXACT_TARGET)
        return len(list(tmp_path.iterdir()))

    assert [kept(first, "2"), kept(first, "2"), kept(second, "2"), kept(first, "3")] == [1, 1, 2, 3]
    monkeypatch.setattr(solver_processes, "EXACT_TARGET", 1e-2)
    assert kept(first, "2") == 4


def test_seconds_are_those_of_the_simulation_and_the_least_of_the_runs(monkeypatch):
    (request,) = solver_processes.drawn(1, 0)
    instants = iter([0.0, 1.0, 3.5])
    monkeypatch.setattr(solver_child, "time", SimpleNamespace(process_time=lambda: next(instants)))
    stopped = SimpleNamespace(status="stopped", stats=SimpleNamespace(steps=1), completed=False)
    monkeypatch.setattr(solver_child.bem, "simulate", lambda *_: stopped)
    assert solver_child.answer(request | {"accuracy": "draft"})["seconds"] == 2.5
    answers = iter([{"seconds": seconds} for seconds in (9.0, 3.0, 1.0, 2.0)])  # the first loads the kernels
    found = solver_processes.in_turn({"one": lambda *_: next(answers)}, [request], "draft", 3)["one"]
    assert (found[0].tolist(), found[1]) == ([1.0], [{"seconds": 3.0}])


def test_a_target_is_met_where_the_error_is_no_larger():
    exact = np.tile(np.linspace(1.0, 2.0, 122), (4, 1))
    errors = (0.0, 0.01, 0.02, 0.5)
    answers = [{"results": (row * (1.0 + e)).tolist(), "work": {}} for row, e in zip(exact, errors, strict=True)]
    found = solver_processes.judged(np.ones(4), answers, exact, 0.015)
    assert (found["met"]["pull_off_force"], found["worst"]["hysteresis"]) == (0.5, 3)

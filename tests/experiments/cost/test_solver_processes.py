"""Solvers in processes of their own: what one raises, and which refined solutions are kept."""

import numpy as np

from experiments.cost import solver_processes
from experiments.cost.solver_processes import ROOT, Solver


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

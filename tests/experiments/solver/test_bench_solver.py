"""The solver's benchmark on three protocols, and its document."""

import json

import numpy as np
import pytest

from experiments.robustness import known_results
from experiments.solver import bench_solver
from experiments.solver import solver_processes as solvers
from experiments.timing import in_fresh_process


@pytest.fixture(scope="module")
def content():
    requests = solvers.drawn(3, 1)
    solver = solvers.Solver(solvers.ROOT)
    exact = np.array([solvers.results(solver(request, "standard"), 120) for request in requests])
    solver.close()
    return {
        "count": 3,
        "seed": 1,
        "host": "a machine",
        "command": "python -m experiments bench_solver",
        "truth_target": 4e-3,
        "yardstick_seconds": bench_solver.yardstick(3),
        "levels": bench_solver.measured(requests, exact, ("standard", 1e-2), None),
        "start_up": {"compiled before": {"import": 1.0, "first call": 1.0, "second call": 1.0}},
        "memory_bytes": in_fresh_process(bench_solver.MEMORY, 1, 1)[0],
        "known_results": [known_results.row("a force", 1.01, 1.0, "theory")],
        "persson_brener": {"median": 0.01, "largest": 0.02},
    }


def test_errors_against_itself_are_zero_and_against_another_accuracy_are_not(content):
    same, other = content["levels"]
    assert same["errors"]["force"]["largest"] == 0.0
    assert same["met"] == {"pull_off_force": 1.0, "hysteresis": 1.0, "force": 1.0}
    assert other["errors"]["force"]["largest"] > 0.0
    assert other["seconds"]["mean"] > 0.0


def test_the_difference_from_theory_is_that_of_the_rows_of_theory():
    rows = [known_results.row("a force", found, 1.0, "Persson-Brener") for found in (1.1, 1.2, 1.5)]
    found = known_results.summary([*rows, known_results.row("a force", 9.0, 1.0, "Hertz")])
    assert found == pytest.approx({"median": 0.2, "largest": 0.5})


def test_the_benchmark_becomes_a_document(content):
    text = bench_solver.markdown(content)
    for title in ("## Cost", "## Errors", "## Start-up and memory", "## Known results"):
        assert title in text
    assert "| 0.01 | 0.01 | 3 | 0 |" in text
    row = next(line for line in text.splitlines() if line.startswith("| 0.01 | 0.01 | 3 | 0 |"))
    assert float(row.split("|")[5]) == pytest.approx(1e3 * content["levels"][1]["seconds"]["mean"], rel=0.01)
    assert content["memory_bytes"] > 1e7
    json.dumps(content)

import json

import numpy as np
import pytest

from bem.protocol import default_start_indentation
from experiments.cost import bench_solver
from experiments.cost import revision_comparison as solvers
from experiments.robustness import hard_cases, known_results
from experiments.timing import in_fresh_process
from paper_figures.measurements import figure_solver_scaling


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


def test_the_benchmark_becomes_a_document(content):
    text = bench_solver.markdown(content)
    for title in ("## Cost", "## Errors", "## Start-up and memory", "## Known results"):
        assert title in text
    assert "| 0.01 | 0.01 | 3 | 0 |" in text
    assert content["memory_bytes"] > 1e7
    json.dumps(content)


def test_hard_cases_are_different_and_never_too_deep_for_a_large_tabor_parameter():
    cases = hard_cases.random_combinations(400, 1)
    assert len({tuple(case.values()) for case in cases}) == 400
    assert max(case["peak_indentation"] for case in cases if case["tabor"] > 1.0) == 100.0
    assert all(case["peak_indentation"] > default_start_indentation(case["tabor"]) for case in cases)
    assert {case["peak_indentation"] for case in cases} == {
        *hard_cases.VALUES["peak_indentation"],
        hard_cases.SHALLOWEST,
    }
    assert len(hard_cases.corners()) == 32


def test_a_hard_case_is_examined_and_summarised():
    case = dict(zip(hard_cases.VALUES, (1.0, 0.1, 10.0, 10.0, 0.0, 0.5), strict=True))
    row = hard_cases.examined({"kind": "random", **case})
    assert row["status"] == row["refined_status"] == "completed"
    assert row["change"] < 4e-3
    text = hard_cases.markdown([row], {"command": "c", "host": "h"})
    assert "| completed with finite numbers | 1 |" in text


def test_the_growth_of_the_cost_is_drawn(tmp_path):
    points = [{"nodes": n, "steps": 10.0 * n, "seconds": {"median": 1e-4 * n}} for n in (50.0, 100.0, 200.0)]
    curve = {"points": points, "exponent": 1.0}
    (tmp_path / "growth.json").write_text(json.dumps({"solver": {"nodes": curve, "steps": curve}}), encoding="utf-8")
    figure_solver_scaling.main(tmp_path / "growth.json", tmp_path)
    assert (tmp_path / "solver-scaling.pdf").is_file()

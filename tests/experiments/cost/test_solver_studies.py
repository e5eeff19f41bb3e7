import json

import numpy as np
import pytest

from bem.protocol import default_start_indentation
from experiments.cost import bench_report, bench_solver, closed_forms
from experiments.cost.solver_sample import measured, sample_cases
from experiments.robustness import hard_cases
from paper_figures.measurements import figure_solver_scaling
from tests.paper_figures.results import made


@pytest.fixture(scope="module")
def content():
    cases = sample_cases(3, 1)
    exact = np.array([measured(case, "standard") for case in cases])
    levels = [bench_solver.measure(level, cases, exact) for level in ("standard", 1e-2)]
    return {
        "count": 3,
        "seed": 1,
        "host": "a machine",
        "command": "python -m experiments.cost.bench_solver",
        "load_before": 0.0,
        "truth_target": 4e-3,
        "yardstick_seconds": bench_solver.yardstick(3),
        "levels": levels,
        "first_call": {"compiled before": {"import": 1.0, "first_call": 1.0, "second_call": 1.0}},
        "command_seconds": {"wall": 1.0, "processor": 1.0},
        "memory_bytes": 1e8,
        "closed_forms": [closed_forms.row("a force", 1.01, 1.0, "theory")],
        "persson_brener": {"median": 0.01, "largest": 0.02},
    }


def test_errors_against_itself_are_zero_and_against_another_accuracy_are_not(content):
    same, other = content["levels"]
    assert same["errors"]["force"]["max"] == 0.0
    assert same["met"] == {"pull_off_force": 1.0, "hysteresis": 1.0, "force": 1.0}
    assert other["errors"]["force"]["max"] > 0.0
    assert other["processor_seconds"]["mean"] > 0.0


def test_the_benchmark_becomes_a_document(content):
    text = bench_report.markdown(content)
    for title in ("## Cost", "## Errors", "## Start-up and memory", "## Known results"):
        assert title in text
    assert "| 0.01 | 0.01 | 3 | 0 |" in text
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
    made(figure_solver_scaling, tmp_path / "growth.json", folder=tmp_path)
    assert (tmp_path / "figure-solver-scaling.pdf").is_file()

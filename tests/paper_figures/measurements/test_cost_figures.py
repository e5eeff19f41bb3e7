"""Figures and tables of how cost grows, what training costs and when it pays, from made-up measurements."""

import numpy as np
import pytest

from bem.dataset.designs import PAPER_RANGES
from paper_figures.measurements import figure_amortisation, figure_cost_growth, figure_training_cost
from paper_figures.style import drawing
from tests.paper_figures.results import SPREAD, files_in, made, pictures, tables


def test_growth(measured, tmp_path):
    def curve(name):
        times = [{"median": 1e-3 * x, "low": 0.9e-3 * x, "high": 1.2e-3 * x} for x in (1, 2, 4)]
        points = [{name: float(x), "seconds": SPREAD | time} for x, time in zip((1, 2, 4), times, strict=True)]
        return {"points": points, "exponent": 1.0, "error": 0.0, "iterations": 0.25, "iterations_error": 0.01}

    curves = {name: curve(name) for name in figure_cost_growth.LABELS}
    box = {"exponents": dict.fromkeys(PAPER_RANGES, 0.5), "explained": 0.9, "trajectories": 60}
    path = measured({"solver": curves, "baseline": curves, "data_set": box})
    made(figure_cost_growth, path, folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-cost-growth") | tables("cost-growth")
    assert "0.25 ± 0.01" in (tmp_path / "cost-growth.md").read_text(encoding="utf-8")
    axes = drawing.figure(height=2.0).subplots()
    figure_cost_growth.draw(axes, curves["nodes"], "nodes", "solver")
    ends = [segment[:, 1] for segment in axes.collections[0].get_segments()]
    np.testing.assert_allclose(ends, [[0.9e-3 * x, 1.2e-3 * x] for x in (1, 2, 4)])


def test_amortisation_without_and_with_a_surrogate(measured, tmp_path):
    lines = [
        {"name": "solver, standard", "fixed_seconds": 0.0, "query_seconds": 0.01},
        {"name": "M1-concat, ONNX batch", "fixed_seconds": 1e3, "query_seconds": 0.001},
        {"name": "paper's solver", "fixed_seconds": 0.0, "query_seconds": 138.0},
    ]
    crossing = {"surrogate": "M1-concat, ONNX batch", "solver": "solver, standard", "queries": 1.1e5}
    never = {"surrogate": "paper's surrogate", "solver": "solver, standard", "queries": None}
    content = {"data_set_seconds": 100.0, "data_set_trajectories": 50, "missing": [], "unmeasured": ["M2-FiLM"]}
    content |= {"retrained": ["M2-gated"], "outdated": ["M1-concat"]}
    assert figure_amortisation.totals({"fixed_seconds": 3600.0, "query_seconds": 7200.0})[0] == pytest.approx(3.0)
    made(figure_amortisation, measured({**content, "lines": lines, "break_even": [crossing, never]}), folder=tmp_path)
    text = (tmp_path / "amortisation.md").read_text(encoding="utf-8")
    assert "Published but not measured: M2-FiLM. Retrained since the measurement: M2-gated. " in text
    assert "Trained differently from those compared: M1-concat." in text
    made(figure_amortisation, measured({**content, "lines": lines[:1], "break_even": []}), folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-amortisation") | tables("amortisation")
    assert "never" in "".join(
        cell for row in figure_amortisation.rows_of({"lines": lines, "break_even": [never]}) for cell in row
    )


@pytest.mark.parametrize("published", [False, True])
def test_cost_of_training(measured, tmp_path, published):
    history = {"core_minutes": [1.0, 2.0], "validation_mse": [0.5, 0.7], "best_mse": [0.5, 0.5]}
    run = {"name": "M1-concat", "epochs": 2, "core_minutes": 2.0, "test_mse": 4e-4, "history": history}
    common = {
        "paper_mse": 5e-4,
        "minutes_to_paper_mse": 1.5 if published else None,
        "missing": ["M4-FiLM"],
        "outdated": {},
        "beside": [],
        "models": [],
        "shares": [],
    }
    short = run | {"name": "M1-concat-8-epochs", "core_minutes": 1.0, "test_mse": 8e-4}
    points = [
        {"trajectories": n, "solver_seconds": 0.01 * n, "mse": 1.0 / n, "mse_sd": 0.1 / n, "folds": folds}
        for n, folds in ((10, 5), (100, 1))
    ]
    content = common | ({"models": [run], "beside": [short], "shares": points} if published else {})
    made(figure_training_cost, measured(content), folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-training-cost")
    axes = drawing.figure(height=2.0).subplots()
    figure_training_cost.draw_time(axes, content)
    held_out = [line.get_xydata()[0].tolist() for line in axes.lines if line.get_label() == "held-out, end of a run"]
    assert held_out == ([[2.0, 4e-4], [1.0, 8e-4]] if published else [])
    assert ([0.5, 0.5] in [list(line.get_ydata()) for line in axes.lines]) == published
    assert ("1.5 core-minutes" in " ".join(text.get_text() for text in axes.texts)) == published

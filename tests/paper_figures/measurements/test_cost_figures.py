"""Figures and tables of what training costs and when it pays, from made-up measurements."""

import pytest

from paper_figures.measurements import figure_amortisation, figure_training_cost
from paper_figures.style import drawing
from tests.paper_figures.results import files_in, made, pictures, tables


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


def test_cost_of_training(measured, tmp_path):
    history = {"core_minutes": [1.0, 2.0], "best_mse": [0.5, 0.5]}
    run = {"name": "M1-concat", "epochs": 2, "core_minutes": 2.0, "test_mse": 4e-4, "history": history}
    short = run | {"name": "M1-concat-8-epochs", "core_minutes": 1.0, "test_mse": 8e-4}
    content = {"paper_mse": 5e-4, "minutes_to_paper_mse": 1.5, "missing": ["M4-FiLM"], "outdated": {}}
    content |= {"models": [run], "beside": [short]}
    made(figure_training_cost, measured(content), folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-training-cost")
    axes = drawing.figure(height=2.0).subplots()
    figure_training_cost.draw_time(axes, content)
    held_out = [line.get_xydata()[0].tolist() for line in axes.lines if line.get_label() == "held-out, end of a run"]
    assert held_out == [[2.0, 4e-4], [1.0, 8e-4]]
    assert [0.5, 0.5] in [list(line.get_ydata()) for line in axes.lines]
    assert "1.5 core-minutes" in " ".join(text.get_text() for text in axes.texts)

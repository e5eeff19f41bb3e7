"""Figures and tables of what training costs and when it pays, from made-up measurements."""

import pytest

from paper_figures.measurements import figure_amortisation, figure_training_cost


def test_amortisation_and_cost_of_training():
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
    table = figure_amortisation.compose({**content, "lines": lines, "break_even": [crossing, never]})["amortisation"]
    text = table.page()
    assert "Published but not measured: M2-FiLM. Retrained since the measurement: M2-gated. " in text
    assert "Trained differently from those compared: M1-concat." in text
    assert table.rows[1][-1] == "never"
    figure_amortisation.compose({**content, "lines": lines[:1], "break_even": []})
    history = {"core_minutes": [1.0, 2.0], "best_mse": [0.5, 0.5]}
    run = {"name": "M1-concat", "epochs": 2, "core_minutes": 2.0, "test_mse": 4e-4, "history": history}
    short = run | {"name": "M1-concat-8-epochs", "core_minutes": 1.0, "test_mse": 8e-4}
    content = {"paper_mse": 5e-4, "minutes_to_paper_mse": 1.5, "missing": ["M4-FiLM"], "outdated": {}}
    content |= {"models": [run], "beside": [short]}
    (axes,) = figure_training_cost.compose(content).axes
    held_out = [line.get_xydata()[0].tolist() for line in axes.lines if line.get_label() == "held-out, end of a run"]
    assert held_out == [[2.0, 4e-4], [1.0, 8e-4]]
    assert [0.5, 0.5] in [list(line.get_ydata()) for line in axes.lines]
    assert "1.5 core-minutes" in " ".join(text.get_text() for text in axes.texts)

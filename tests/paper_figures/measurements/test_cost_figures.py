"""Figures and tables of costs, other software and pretrained models, from made-up and published measurements."""

import json

import pytest

from paper_figures.measurements import (
    figure_amortisation,
    figure_peers,
    figure_tabor_cost,
    figure_training_cost,
)
from paper_figures.tables import table_surrogates


def test_amortisation_and_cost_of_training():
    lines = [
        {"name": "solver, standard", "fixed_seconds": 0.0, "query_seconds": 0.01},
        {"name": "M1-concat, ONNX batch", "fixed_seconds": 1e3, "query_seconds": 0.001},
        {"name": "paper's solver", "fixed_seconds": 0.0, "query_seconds": 138.0},
    ]
    crossing = {"surrogate": "M1-concat, ONNX batch", "solver": "solver, standard", "queries": 1.1e5}
    never = {"surrogate": "paper's surrogate", "solver": "solver, standard", "queries": None}
    common = {"data_set_seconds": 100.0, "data_set_trajectories": 50, "missing": [], "unmeasured": ["M2-FiLM"]}
    common |= {"retrained": ["M2-gated"], "outdated": ["M1-concat"]}
    assert figure_amortisation.totals({"fixed_seconds": 3600.0, "query_seconds": 7200.0})[0] == pytest.approx(3.0)
    table = figure_amortisation.compose({**common, "lines": lines, "break_even": [crossing, never]})["amortisation"]
    text = table.page()
    assert "Published but not measured: M2-FiLM. Retrained since the measurement: M2-gated. " in text
    assert "Trained differently from those compared: M1-concat." in text
    assert table.rows[1][-1] == "never"
    figure_amortisation.compose({**common, "lines": lines[:1], "break_even": []})
    history = {"core_minutes": [1.0, 2.0], "best_mse": [0.5, 0.5]}
    run = {"name": "M1-concat", "epochs": 2, "core_minutes": 2.0, "test_mse": 4e-4, "history": history}
    short = run | {"name": "M1-concat-8-epochs", "core_minutes": 1.0, "test_mse": 8e-4}
    costs = {"paper_mse": 5e-4, "minutes_to_paper_mse": 1.5, "missing": ["M4-FiLM"], "outdated": {}}
    costs |= {"models": [run], "beside": [short]}
    (axes,) = figure_training_cost.compose(costs).axes
    held_out = [
        line.get_xydata()[0].tolist() for line in axes.lines if line.get_label() == figure_training_cost.HELD_OUT
    ]
    assert held_out == [[2.0, 4e-4], [1.0, 8e-4]]
    assert [0.5, 0.5] in [list(line.get_ydata()) for line in axes.lines]
    assert "1.5 core-minutes" in " ".join(text.get_text() for text in axes.texts)


RUNS = [
    ("tabor 1", "Adhesion", "128 x 128", 30.0, 1e-3),
    ("tabor 1", "Adhesion", "32 x 32", 1.0, 1e-2),
    ("tabor 1", "solver", "draft", 4e-3, 2e-3),
    ("tabor 3", "closed form", "JKR", 1e-3, 0.03),
    ("tabor 3", "paper's discretisation", "50 nodes", 1e-2, 0.1),
    ("Hertz", "solver", "draft", 2e-3, 1e-9),
    ("Hertz", "tamaas", "32 x 32", 2e-2, 1e-4),
]
CONTENT = {"host": "a processor", "packages": {"Adhesion": "0.1", "tamaas": "0.2"}, "start": 2.0}
CONTENT["runs"] = [dict(zip(("problem", "tool", "setting", "seconds", "error"), row, strict=True)) for row in RUNS]


def test_unresolved_errors_are_triangles():
    drawn = figure_peers.compose(CONTENT)
    names = {text.get_text() for axes in drawn.axes for text in axes.texts}
    assert names == {"draft", "32×32", "128×128", "JKR"}
    (axes,) = [
        axes for axes in figure_peers.compose(CONTENT).axes if axes.get_title() == "compression without adhesion"
    ]
    solver = [line for line in axes.lines if line.get_color() == figure_peers.STYLES["solver"]["color"]]
    assert [(line.get_marker(), line.get_markevery()) for line in solver] == [("o", []), ("v", None)]


def test_stated_accuracies_are_open_markers():
    common = {"seconds": {"median": 0.1}, "errors": {"median": 1e-3, "largest": 2e-3}, "methods": {"sharp crack": 1.0}}
    rows = [common | {"tabor": tabor, "measured": tabor < 100.0} for tabor in (3.0, 30.0, 300.0)]
    (axes,) = figure_tabor_cost.compose({"rows": rows}).axes
    faces = [line.get_markerfacecolor() for line in axes.lines if line.get_marker() == "D" and len(line.get_xdata())]
    assert [face == "white" for face in faces] == [False, False, True]


def test_table_of_surrogates(tmp_path):
    levels = {"50": 0.5, "90": 2.0, "99": 7.0}
    results = (*table_surrogates.ERROR_COLUMNS, *table_surrogates.INSIDE)
    place = {name: levels | {"covered at 0.9": 91.2} for name in results}
    place |= {"trajectories": {"count": 6000, "inside": 99.6}}
    ends = {f"at {end} tabor": {"count": 700.0} | dict.fromkeys(results, share) for end, share in SHARES.items()}
    for name in ("fast", "accurate"):
        (tmp_path / name).mkdir()
        places = {"test_sls": place, "test_edges": place | ends, "test_corners": place | ends}
        (tmp_path / name / "errors.json").write_text(json.dumps({"places": places}))
    rows = table_surrogates.rows(tmp_path)
    cells = ["standard linear solids", "6,000", *4 * ["0.5 / 2 / 7"], *5 * ["91"], "100"]
    assert (len(rows), rows[0], rows[5][:2]) == (6, ["`fast`", *cells], ["`accurate`", "corners"])
    text = table_surrogates.page_text(tmp_path)
    assert "at each of the 2 corners (700 contacts or more) at least 86, 86, 86, 86, 86 %" in text


SHARES = {"low": 88.0, "high": 86.4}
"""Percentages inside intervals at both ends of a range."""

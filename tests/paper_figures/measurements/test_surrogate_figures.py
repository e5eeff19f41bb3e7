"""Figures and table of the pretrained models, from made-up measurements."""

import pytest

from paper_figures.measurements import figure_measurement_floor, figure_surrogates
from paper_figures.style import drawing
from paper_figures.tables import table_surrogates
from tests.paper_figures.results import files_in, made, pictures, tables

ERRORS = {"p50": 0.5, "p90": 2.0, "p99": 7.0}
BANDED = {"pull_off": ERRORS, "hysteresis": ERRORS, "covered": 0.91, "covered_fast": None, "width": ERRORS}
CONTENT = {
    "count": 10,
    "coverage": 0.9,
    "fast": 100.0,
    "models": {
        "fast": {"paper": BANDED, "any": BANDED},
        "M1-concat": {"paper": {"pull_off": ERRORS, "hysteresis": ERRORS}},
    },
    "seconds": {
        "solver": {"batch": 3e-3, "single": 3e-3},
        "fast": {"batch": 1e-4, "single": 5e-4},
        "M1-concat": {"batch": 1e-3, "single": 2e-3},
    },
}


def test_measurement_floor(measured, tmp_path):
    steps = {"indentation": [20.0, 10.0, -1.0], "force": [-3.0, 1.0, 0.1]}
    kind = {"counts": [2, 1, 3], "pull_off_errors": [0.0, 1e-3, 0.2]}
    content = {
        "example": {**steps, "steps": {"uniform": steps, "physical": steps}},
        "kinds": {"uniform": kind, "physical": kind},
    }
    made(figure_measurement_floor, measured(content), folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-measurement-floor")
    axes = drawing.figure(height=2.0).subplots()
    figure_measurement_floor.draw_errors(axes, content["kinds"])
    assert [line.get_xdata().max() for line in axes.lines[:2]] == [20.0, 20.0]


def test_surrogates(measured, tmp_path):
    made(figure_surrogates, measured(CONTENT), folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-surrogates")


WHOLE = CONTENT | {
    "seconds": {
        name: row | {"gradient": 12.0 * row["batch"], "step": row["single"] / 100.0}
        for name, row in CONTENT["seconds"].items()
    },
    "gradients": {"tools": {name: {"common": ERRORS, "modulus_ratio": None} for name in CONTENT["seconds"]}},
}


def test_surrogates_have_a_panel_for_each_way_to_call_that_is_measured(measured, tmp_path):
    made(figure_surrogates, measured(WHOLE), folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-surrogates")
    few, many = figure_surrogates.compose(CONTENT), figure_surrogates.compose(WHOLE)
    assert [len(drawn.axes) for drawn in (few, many)] == [2, 4]
    stepwise, slopes = many.axes[2:]
    # The solver is the truth of a force, and has an error of its own in a gradient.
    assert [len(axes.lines) for axes in (stepwise, slopes)] == [5, 6]
    assert stepwise.lines[0].get_xdata()[0] == pytest.approx(30.0)
    assert slopes.lines[1].get_xdata()[0] == pytest.approx(36.0)
    assert slopes.lines[1].get_ydata()[0] == 0.5


def test_table_of_surrogates(measured, tmp_path):
    made(table_surrogates, measured(CONTENT), folder=tmp_path)
    assert files_in(tmp_path) == tables("table-surrogates") or files_in(tmp_path) == tables("surrogates")
    first, second, third = table_surrogates.rows(CONTENT)
    assert first[:6] == ["fast", "0.1", "0.5, 2, 7", "0.5, 2", "0.91", ""]
    assert (first[-1], second[1], third[4]) == ("30", "0.01 to 1", "")


def test_the_table_of_calls_has_the_solver_and_every_model():
    more = {"count": 7, "fine": 5e-4, **WHOLE["gradients"]}
    solver, fast, other = table_surrogates.calls(WHOLE | {"gradients": more})
    assert solver == ["solver", "3", "3", "30", "36", "0.5, 2"]
    assert (fast[0], fast[2:5]) == ("fast", ["0.5", "5", "1.2"])
    assert other[0] == "M1-concat"
    text = table_surrogates.calls_text(WHOLE | {"gradients": more, "host": "a machine", "command": "a command"})
    assert "on 7 protocols, relative to the solver at 0.0005; measured by `a command` on a machine." in text

"""Figures and table of the pretrained models, from made-up measurements."""

import numpy as np

from paper_figures.measurements import figure_inverse, figure_measurement_floor
from paper_figures.style import drawing
from paper_figures.tables import table_surrogates

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


def test_the_share_above_an_error_is_in_percent():
    steps = {"indentation": [20.0, 10.0, -1.0], "force": [-3.0, 1.0, 0.1]}
    kind = {"counts": [2, 1, 3], "pull_off_errors": [0.0, 1e-3, 0.2]}
    content = {
        "example": {**steps, "steps": {"uniform": steps, "physical": steps}},
        "kinds": {"uniform": kind, "physical": kind},
    }
    axes = drawing.figure(height=2.0).subplots()
    figure_measurement_floor.draw_errors(axes, content["kinds"])
    assert [line.get_xdata().max() for line in axes.lines[:2]] == [20.0, 20.0]


WHOLE = CONTENT | {
    "seconds": {
        name: row | {"gradient": 12.0 * row["batch"], "step": row["single"] / 100.0}
        for name, row in CONTENT["seconds"].items()
    },
    "gradients": {"tools": {name: {"common": ERRORS, "modulus_ratio": None} for name in CONTENT["seconds"]}},
}


def test_table_of_surrogates():
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


def posterior(tool):
    """Made-up densities of three parameters."""
    histogram = {"edges": [0.0, 1.0, 2.0], "density": [0.4, 0.6]}
    pair = {"x": [0.0, 1.0, 2.0], "y": [0.0, 1.0, 2.0], "density": [[0.1, 0.2], [0.3, 0.4]]}
    summary = {"mean": [1.0, 1.0, 1.1], "sd": [0.1, 0.2, 0.3], "low": [0.8] * 3, "high": [1.2] * 3}
    found = {"samples": 1000, "effective": 750.4, "summary": summary, "densities": [histogram] * 3}
    pairs = {"pairs": [{**pair, "parameters": [first, first + 1]} for first in (0, 1)]}
    return found | (pairs if tool == "surrogate" else {})


INVERSE = {
    "parameters": ["tabor", "modulus_ratio", "retardation_time"],
    "true": [1.0, 1.1, 0.9],
    "calibration": 256,
    "posteriors": {tool: posterior(tool) for tool in figure_inverse.STYLES},
    "seconds": {"surrogate": 1e-4, "solver": 4e-3},
    "searched": 5.0,
    "solver_shown": [[1.0, 1.0, 1.0], [1.1, 0.9, 1.0]],
    "curve": {"time": [0.0, 1.0], "measured": [0.1, -1.0], "mean": [0.0, -1.1]},
    "processor_share": 0.95,
    "command": "a command",
    "host": "a machine",
}


def test_levels_hold_their_share():
    levels = figure_inverse.levels_of(np.array([[0.05, 0.2], [0.0, 0.75]]))
    # 0.75 alone holds 68 %, and 95 % need the next.
    assert levels == [0.2, 0.75]


def test_the_table_of_the_inverse_problem_measures_distances_in_the_solvers_deviations():
    content = {**INVERSE, "posteriors": {**INVERSE["posteriors"]}}
    shifted = posterior("surrogate")
    shifted["summary"] = shifted["summary"] | {"mean": [1.05, 1.0, 1.1]}
    content["posteriors"]["surrogate"] = shifted
    true, first, ignored, solver = figure_inverse.rows(content)
    assert true[:4] == ["true", "1", "1.1", "0.9"]
    assert first[1] == "1.05 (0.8 to 1.2)"
    assert (first[4], ignored[4], solver[4]) == ("0.50", "0.00", "-")
    assert (first[5:], solver[7]) == (["1,000", "750", "0.100"], "4.000")
    assert "A sample of the solver costs 40 times as much" in figure_inverse.page_text(content)


def test_the_smallest_size_that_reaches_the_papers_errors_is_stated():
    """The paper states 2.2 % and 1.1 %; its best model has 473,729 parameters."""
    errors = ("pull_off", "hysteresis")
    sizes = [
        {"units": units, "parameters": 1000 * units, "paper": {key: {"p50": error} for key in errors}}
        for units, error in ((8, 4.0), (16, 0.9), (32, 0.5))
    ]
    text = table_surrogates.size_text({"count": 10, "epochs": 14, "trajectories": 32768, "lstm": sizes})
    assert "(pull-off 2.2 %, hysteresis 1.1 %) are reached by one LSTM" in text
    assert "from 16 units on, with 16,000 parameters, 30 times fewer" in text

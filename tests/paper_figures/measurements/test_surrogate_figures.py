"""Figures and tables of the pretrained models: cells and curves of published measurements, some changed."""

import numpy as np
import pytest

from experiments.places import Places
from paper_figures.measurements import figure_inverse, figure_measurement_floor
from paper_figures.style import drawing
from paper_figures.tables import table_surrogates


@pytest.fixture(scope="module")
def errors():
    return Places().read("pretrained_errors", "table-surrogates")


def test_the_share_above_an_error_is_in_percent():
    kind = {"counts": [2, 1, 3], "pull_off_errors": [0.0, 1e-3, 0.2]}
    axes = drawing.figure(height=2.0).subplots()
    figure_measurement_floor.draw_errors(axes, {"uniform": kind, "physical": kind})
    assert [line.get_xdata().max() for line in axes.lines[:2]] == [20.0, 20.0]


def test_table_of_surrogates(errors):
    levels = {"p50": 0.5, "p90": 2.0, "p99": 7.0}
    banded = dict.fromkeys(("pull_off", "hysteresis", "width"), levels) | {"covered": 0.91, "covered_fast": None}
    models = {"fast": {"paper": banded, "any": banded}, "M1-concat": {"paper": {**banded, "covered": 0.5}}}
    del models["M1-concat"]["paper"]["covered"]
    seconds = errors["seconds"] | {"solver": {"batch": 3e-3}, "fast": {"batch": 1e-4, "single": 5e-4}}
    first, second, third = table_surrogates.rows({"models": models, "seconds": seconds})
    assert first == ["fast", "0.1", "0.5, 2, 7", "0.5, 2", "0.91", "", "0.5, 2", "0.100", "0.50", "30"]
    assert (second[1], third[4], third[6]) == ("0.01 to 1", "", "")


def test_the_table_of_calls_has_the_solver_and_every_model(errors):
    times = {"batch": 3e-3, "single": 4e-3, "step": 3e-5, "gradient": 36e-3}
    tools = errors["gradients"]["tools"] | {"solver": {"common": {"p50": 0.5, "p90": 2.0}}}
    content = errors | {"seconds": errors["seconds"] | {"solver": times}, "gradients": {"tools": tools}}
    rows = table_surrogates.calls(content)
    assert rows[0] == ["solver", "3", "4", "30", "36", "0.5, 2"]
    assert [row[0] for row in rows[1:]] == list(errors["models"])


def test_levels_hold_their_share():
    levels = figure_inverse.levels_of(np.array([[0.05, 0.2], [0.0, 0.75]]))
    # 0.75 alone holds 68 %, and 95 % need the next.
    assert levels == [0.2, 0.75]


def test_the_table_of_the_inverse_problem_measures_distances_in_the_solvers_deviations():
    content = Places().read("inverse_problem", "figure-inverse")
    solver = content["posteriors"]["solver"]
    solver["summary"] = {"mean": [1.0, 1.0, 1.1], "sd": [0.1, 0.2, 0.3], "low": [0.8] * 3, "high": [1.2] * 3}
    moved = {**solver["summary"], "mean": [1.05, 1.0, 1.1]}
    content["posteriors"]["surrogate"] |= {"summary": moved, "samples": 1000, "effective": 750.4}
    content |= {"true": [1.0, 1.1, 0.9], "seconds": {"surrogate": 1e-4, "solver": 4e-3}}
    true, first, _, last = figure_inverse.rows(content)
    assert true[:4] == ["true", "1", "1.1", "0.9"]
    assert first[1] == "1.05 (0.8 to 1.2)"
    assert (first[4], last[4]) == ("0.50", "-")
    assert (first[5:], last[7]) == (["1,000", "750", "0.100"], "4.000")
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

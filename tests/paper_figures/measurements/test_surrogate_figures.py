"""Figures and tables of the pretrained models: cells and curves of published measurements, some changed."""

import numpy as np

from experiments.places import Places
from paper_figures.measurements import figure_inverse, figure_measurement_floor
from paper_figures.style import drawing
from paper_figures.tables import table_surrogates


def test_shares_above_an_error_and_levels_that_hold_a_share():
    kind = {"counts": [2, 1, 3], "pull_off_errors": [0.0, 1e-3, 0.2]}
    axes = drawing.figure(height=2.0).subplots()
    figure_measurement_floor.draw_errors(axes, {"uniform": kind, "physical": kind})
    assert [line.get_xdata().max() for line in axes.lines[:2]] == [20.0, 20.0]
    levels = figure_inverse.levels_of(np.array([[0.05, 0.2], [0.0, 0.75]]))
    # 0.75 alone holds 68 %, and 95 % need the next.
    assert levels == [0.2, 0.75]


def test_table_of_surrogates():
    levels = {"p50": 0.5, "p90": 2.0, "p99": 7.0}
    banded = dict.fromkeys(("pull_off", "hysteresis", "width"), levels) | {"covered": 0.91, "covered_fast": None}
    models = {"fast": {"paper": banded, "any": banded}, "M1-concat": {"paper": {**banded, "covered": 0.5}}}
    del models["M1-concat"]["paper"]["covered"]
    errors = Places().read("pretrained_errors", "table-surrogates")
    seconds = errors["seconds"] | {"solver": {"batch": 3e-3}, "fast": {"batch": 1e-4, "single": 5e-4}}
    first, second, third = table_surrogates.rows({"models": models, "seconds": seconds})
    assert first == ["fast", "0.1", "0.5, 2, 7", "0.5, 2", "0.91", "", "0.5, 2", "0.100", "0.50", "30"]
    assert (second[1], third[4], third[6]) == ("0.01 to 1", "", "")

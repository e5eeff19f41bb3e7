"""Feature sets at two kinds of measurement steps, from a made-up result."""

import pytest

from paper_figures.models import figure_features
from tests.paper_figures.results import HISTORY, comparison, efficiency


def errors(factor):
    levels = {"p50": 1.0 * factor, "p90": 3.0 * factor, "p99": 9.0 * factor}
    return {"count": 10, **dict.fromkeys(figure_features.READINGS, levels)}


def trained(mse, factor=None):
    training = {"validation_mse": mse, "mse": 2.0 * mse, "history": HISTORY}
    return training if factor is None else training | {"hidden": errors(factor)}


CONTENT = {
    "command": "python -m experiments feature_sets",
    "config": {"sets": ["A", "D", "E", "F"], "physical": ["D", "F"]},
    "sets": {"A": trained(0.8), "D": trained(0.4, 0.8), "E": trained(0.3, 0.7), "F": trained(0.1, 0.4)},
    "physical": {"D": trained(0.6, 0.2), "F": trained(0.2, 0.1)},
    "floor": {"uniform": errors(0.05), "physical": errors(0.01)},
}


def test_figure_compares_kinds_of_steps():
    study = comparison(["M1-concat"], by_recipe=["M1-concat"])
    drawn = figure_features.compose(CONTENT, efficiency(), study)["figure-features"]
    theirs, _, curves, pull_off = drawn.axes
    assert [line.get_label() for line in theirs.lines[::2]] == ["D: B + edge (2.0e-01)"]
    # Curves at physical steps have errors of other forces.
    assert [line.get_label()[0] for line in curves.lines[::2]] == list("ADEF")
    assert [tick.get_text() for tick in pull_off.get_xticklabels()] == ["solver's\nforces", "D", "E", "F"]
    marks = [line for line in pull_off.lines if line.get_marker() != "None"]
    assert [line.get_ydata()[0] for line in marks] == pytest.approx([0.05, 0.8, 0.7, 0.4, 0.01, 0.2, 0.1])
    assert [round(line.get_xdata()[0]) for line in marks] == [0, 1, 2, 3, 0, 1, 3]
    bars = [line.get_ydata().tolist() for line in pull_off.lines if line.get_marker() == "None"]
    assert bars[1] == pytest.approx([0.8, 2.4])
    labels = [text.get_text() for text in pull_off.get_legend().get_texts()]
    assert labels == ["uniform steps", "physical steps"]
    colors = {line.get_color() for line in marks[:4]}, {line.get_color() for line in marks[4:]}
    assert [len(group) for group in colors] == [1, 1]
    assert colors[0] != colors[1]


def test_table_has_a_row_per_set_and_steps():
    rows = figure_features.compose(CONTENT, efficiency(), comparison(["M1-concat"]))["features"].rows
    floor = ["", ""]
    assert [[row[0], row[2]] for row in rows] == [
        *([name, "uniform"] for name in "ADEF"),
        *([name, "physical"] for name in "DF"),
        *(["", steps] for steps in ("uniform", "physical")),
    ]
    assert [row[3] for row in rows] == ["1"] * 6 + floor
    assert rows[0][4:] == ["0.8", "1.6", "-", "-"]
    assert rows[4][4:] == ["0.6", "1.2", "0.2, 0.6, 1.8", "0.2, 0.6, 1.8"]
    assert rows[6][4:] == ["", "", "0.05, 0.15, 0.45", "0.05, 0.15, 0.45"]
    study = CONTENT | {"sets": {"A": trained(0.8)}, "physical": {}, "floor": {}}
    rows = figure_features.features_table(study).rows
    assert [(row[0], row[2], row[3]) for row in rows] == [
        ("A", "uniform", "1"),
        *((name, "uniform", "0") for name in "DEF"),
        *((name, "physical", "0") for name in "DF"),
    ]
    text = figure_features.page_text(CONTENT | {"physical": {"D": trained(0.6, 0.2)}})
    assert "Not all of these are trained yet: `make feature-sets`." in text

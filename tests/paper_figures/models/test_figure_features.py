"""The paper's feature sets, from a made-up result."""

from paper_figures.models import figure_features
from tests.paper_figures.results import HISTORY, comparison, efficiency


def trained(mse):
    return {"validation_mse": mse, "mse": 2.0 * mse, "history": HISTORY}


CONTENT = {"command": "python -m experiments feature_sets", "sets": {"A": trained(0.8), "D": trained(0.4)}}


def test_figure_has_both_recipes():
    study = comparison(["M1-concat"], by_recipe=["M1-concat"])
    theirs, _, ours = figure_features.compose(CONTENT, efficiency(), study)["figure-features"].axes
    assert [line.get_label() for line in theirs.lines[::2]] == ["D: B + edge (2.0e-01)"]
    assert [line.get_label()[0] for line in ours.lines[::2]] == ["A", "D"]


def test_table_has_a_row_for_each_set():
    rows = figure_features.compose(CONTENT, efficiency(), comparison(["M1-concat"]))["features"].rows
    assert [[row[0], *row[2:]] for row in rows] == [
        ["A", "1", "0.8", "1.6"],
        ["B", "0", "-", "-"],
        ["C", "0", "-", "-"],
        ["D", "1", "0.4", "0.8"],
    ]
    assert "Measured by `python -m experiments feature_sets`." in figure_features.page_text(CONTENT)

"""The tables of models, quartiles, canonical protocols and crack velocities, from small result files."""

from paper_figures.tables import table_models, table_persson_brener, table_protocols_canonical, table_quartiles
from tests.paper_figures.results import comparison


def test_tables(regimes, errors, cracks):
    first = [
        "(1)",
        "10",
        "1",
        "200",
        "0.2",
        "5",
        "658",
        "0.01",
        "0.12",
        "0.1",
        "0.006",
        "8.0e-04",
        "1.5",
        "0.5",
        "1.5",
        "0.5",
    ]
    assert table_protocols_canonical.compose(regimes).rows[0] == first
    rows = table_quartiles.compose(errors).rows
    assert rows[0][:3] == ["Q1", "paper", r"0.0853 $\pm$ 0.0229"]
    assert rows[1][:3] == ["", "its recipe", r"2 $\pm$ 1"]
    assert [row[1] for row in rows[:4]] == ["paper", "its recipe", "swift", "paper"]
    table = table_quartiles.compose(errors | {"paper": None})
    assert [row[1] for row in table.rows[:2]] == ["paper", "swift"]
    assert "3 and 3 % by swift" in table.caption
    table = table_persson_brener.compose(cracks)
    assert table.rows[1] == ["2", "1", "2", "2.2", "2", "2.1", "2.2", "2.3", "2.4"]
    assert "1.25 % beyond" in table.caption
    assert "surrogate, paper's recipe 1.0 % and 3.0 %" in table.caption
    speed = {"models": {"M1-concat": {"seconds_per_batch": {"median": 0.361}}}}
    rows = table_models.compose(comparison(["M1-concat"]), speed).rows
    theirs = ["5.00e-04", "0.0092", "0.0148", "-", "2.2", "1.1"]
    assert rows[0] == ["M1-concat, paper", "473,729", "-", *theirs, *["-"] * 6]
    errors, by = ["0.001", "0.01", "0.02", "0.7", "2", "2"], "tensorflow, processor"
    assert rows[1] == ["M1-concat", "100,000", "stated", *errors, "swift", "9,960", "3", by, "1800", "360"]
    assert rows[2] == ["M1-concat-large", "100,000", "stated", *errors, "swift", "120,000", "3", by, "1800", "-"]
    unmeasured = table_models.compose(comparison(["M1-concat"]))
    assert unmeasured.rows[1][-1] == "-"
    assert "17 of 18" in unmeasured.caption
    both = comparison(["M2-FiLM", "M1-concat"], by_recipe=["M1-concat"])
    both["beside"]["M1-concat-paper"] |= {"core_seconds": None, "device": "a GPU", "removed": "elsewhere"}
    rows = table_models.compose(both, speed | {"by_paper_recipe": {"M1-concat": {"median": 0.05}}}).rows
    # In the order of the ranking, by the paper's recipe first.
    assert [row[0] for row in rows[1:]] == ["M2-FiLM", "M1-concat-paper", "M1-concat", "M1-concat-large"]
    assert [row[2] for row in rows[1:3]] == ["guessed", "stated"]
    assert [row[-3:] for row in rows[2:4]] == [["tensorflow, a GPU †", "-", "50"], [by, "1800", "360"]]

"""The tables of models, quartiles, canonical protocols and crack velocities, from small result files."""

import csv
import json

from paper_figures.tables import table_models, table_persson_brener, table_protocols_canonical, table_quartiles
from tests.paper_figures.results import comparison, made, write


def read_csv(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_tables(tmp_path, regimes, errors, cracks):
    made(table_protocols_canonical, regimes, folder=tmp_path)
    rows = read_csv(tmp_path / "protocols-canonical.csv")
    assert rows[1] == [
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
    ]
    made(table_quartiles, errors, folder=tmp_path)
    rows = read_csv(tmp_path / "quartiles.csv")
    assert rows[1][:3] == ["Q1", "paper", r"0.0853 $\pm$ 0.0229"]
    assert rows[2][:3] == ["", "here", r"2 $\pm$ 1"]
    overall = {"pull_off_force_percent": {"median": 1.5}, "hysteresis_percent": {"median": 0.7}}
    found = json.loads(errors.read_text(encoding="utf-8"))
    caption = table_quartiles.compose(found | {"overall": found["overall"] | overall}).caption
    assert "pull-off force 1.5 %, hysteresis 0.7 %" in caption
    made(table_persson_brener, cracks, folder=tmp_path)
    assert read_csv(tmp_path / "persson-brener.csv")[2] == ["2", "1", "2", "2.2", "2", "2.1", "2.2", "2.3"]
    text = (tmp_path / "persson-brener.md").read_text(encoding="utf-8")
    assert "1.25 % beyond" in text
    assert "surrogate 1.0 % and 3.0 %" in text
    speed = write(tmp_path / "speed.json", {"models": {"M1-concat": {"seconds_per_batch": {"median": 0.361}}}})
    made(table_models, write(tmp_path / "c.json", comparison(["M1-concat"])), speed, folder=tmp_path)
    rows = read_csv(tmp_path / "models.csv")
    assert rows[1] == ["M1-concat, paper", "473,729", "5.00e-04", "0.0092", "0.0148", "-", "2.2", "1.1", *["-"] * 5]
    errors = ["0.001", "0.01", "0.02", "0.7", "2", "2"]
    assert rows[2] == ["M1-concat", "100,000", *errors, "swift", "9,960", "3", "1800", "360"]
    assert rows[3] == ["M1-concat-large", "100,000", *errors, "swift", "120,000", "3", "1800", "-"]
    made(table_models, tmp_path / "c.json", tmp_path / "unmeasured.json", folder=tmp_path)
    assert read_csv(tmp_path / "models.csv")[2][-1] == "-"
    assert "17 of 18" in (tmp_path / "models.md").read_text(encoding="utf-8")
    rows = table_models.compose(comparison(["M2-FiLM", "M1-concat"])).rows
    assert [row[0] for row in rows[1:3]] == ["M2-FiLM", "M1-concat"]  # in the order of the ranking

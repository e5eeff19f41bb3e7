"""Errors of the solver at several targets and Tabor parameters."""

from experiments.measurements import tabor_cost


def test_errors_stay_within_the_targets(monkeypatch):
    monkeypatch.setattr(tabor_cost, "TARGETS", (1.7e-2, 4e-3))
    monkeypatch.setattr(tabor_cost, "TABORS", (0.5, 300.0))
    rows = tabor_cost.study(count=2)["rows"]
    assert [row["measured"] for row in rows] == [True, True, False, False]
    assert all(0.0 < row["errors"]["largest"] <= row["target"] and row["seconds"]["median"] > 0.0 for row in rows)
    assert [list(row["methods"]) for row in rows] == [["boundary elements"]] * 2 + [["sharp crack"]] * 2

"""Random scenes of large Tabor parameters."""

from bem import ForceProtocol
from experiments.robustness import large_tabor


def test_scenes_lie_in_their_classes_and_a_simple_one_hardly_changes_under_refinement():
    rows = large_tabor.drawn(30, seed=1)
    for name, bounds in (("tabor", large_tabor.TABORS), ("rate", large_tabor.RATES)):
        assert all(bounds[0] <= row[name] <= bounds[-1] for row in rows)
    assert {row["device"] for row in rows} == set(large_tabor.DEVICES)
    by_force = next(row for row in rows if row["device"] == "force")
    assert isinstance(large_tabor.case(by_force)[1], ForceProtocol)
    row = {"device": "stage", "tabor": 10.0, "rate": 0.1, "depth": 0.5, "spring": 1.0, "modulus_ratio": 1.0}
    found = large_tabor.solved(row, refine=True)
    assert found["status"].startswith("completed")
    assert found["change"] < 0.02

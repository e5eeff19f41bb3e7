import numpy as np

from experiments.surrogates.regions import EDGES, regions


def test_each_quantity_divides_all_protocols_once():
    drawn = {name: np.geomspace(edges[0], edges[-1], 50) for name, (_, edges) in EDGES.items()}
    found = regions(drawn)
    assert found["all"].all()
    for words, edges in EDGES.values():
        parts = [rows for region, rows in found.items() if region.startswith(words)]
        assert len(parts) == len(edges) - 1
        np.testing.assert_array_equal(np.sum(parts, axis=0), 1)


def test_a_bound_belongs_to_the_region_above_and_corners_outside_to_the_nearest():
    found = regions({"tabor": np.array([0.19, 1.0, 3.25])})
    assert found["Tabor parameter 0.2 to 1"].tolist() == [True, False, False]
    assert found["Tabor parameter 1 to 2"].tolist() == [False, True, False]
    assert found["Tabor parameter 2 to 3.2"].tolist() == [False, False, True]


def test_what_all_protocols_share_and_what_none_has_divide_nothing():
    found = regions({"tabor": np.array([0.5, 0.6]), "modulus_ratio": np.array([0.1, 0.1])})
    assert list(found) == ["all", "Tabor parameter 0.2 to 1"]

"""Where a surrogate errs: over the box, at its worst, and out of range."""

import numpy as np

from bem.dataset.file import load_dataset
from experiments.surrogates import surrogate_map


def test_errors_of_a_surrogate_are_mapped(dataset, monkeypatch):
    data = load_dataset(dataset)
    rows = data.completed[:12]

    def predict(times, *_):
        return np.array([np.interp(t, t, np.linspace(-1.0, 1.0, 120)) for t in times])

    content, predicted = surrogate_map.over_the_box(predict, data, rows)
    monkeypatch.setattr(surrogate_map, "WORST", 3)
    found = surrogate_map.worst(content, data, predicted)
    ordered = [case["errors"]["force"] for case in found]
    assert ordered == sorted(content["errors"]["force"], reverse=True)[:3]
    np.testing.assert_array_equal(found[0]["force"], data.force[found[0]["index"]])
    rows = surrogate_map.out_of_range(predict, 1, 0)
    assert len(rows) == 5 * 2 * 4
    assert max(row["value"] for row in rows if row["quantity"] == "tabor") == 6.4

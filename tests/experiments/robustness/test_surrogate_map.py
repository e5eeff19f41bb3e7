"""Where a surrogate errs: over the box, at its worst, out of range, and why."""

import numpy as np

from bem.dataset.designs import PAPER_RANGES
from bem.dataset.file import load_dataset
from experiments.robustness import surrogate_map


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
    assert sum(values["count"] for values in surrogate_map.shares(content).values()) >= 12
    assert all(isinstance(case["corner"], bool) for case in found)
    rows = surrogate_map.out_of_range(predict, 1, 0)
    assert len(rows) == 5 * 2 * 4
    assert max(row["value"] for row in rows if row["quantity"] == "tabor") == 6.4


def test_a_cause_is_named_only_where_the_error_is():
    truth = np.zeros((4, 120))
    truth[:, 100:] = -1.0  # all four jump at step 99, and have their peak at the first unloading step
    predicted = truth.copy()
    predicted[0, 98:102] += 0.5
    predicted[1] += 0.5
    predicted[2, 68:71] += 0.5
    floor = np.array([0.2, 0.2, 0.2, 0.0])
    jumps = np.array([1, 1, 0, 0])
    found = surrogate_map.causes(jumps, floor, predicted, truth)
    assert found == [["jump"], [], ["narrow peak"], []]


def test_corners_are_where_two_quantities_are_extreme():
    low = {name: np.array([bounds[0], np.sqrt(bounds[0] * bounds[1])]) for name, bounds in PAPER_RANGES.items()}
    np.testing.assert_array_equal(surrogate_map.edges_touched(low), [5, 0])


def test_errors_without_a_cause_are_shared_by_place():
    causes, force = [[], [], [], ["jump"]], np.array([1.0, 2.0, 4.0, 8.0])
    found = surrogate_map.shares({"errors": {"force": force}, "corner": [True, False, False, True], "causes": causes})
    means = {name: values["mean"] for name, values in found.items() if values["count"]}
    assert means == {"jump": 8.0, "corner of the box": 1.0, "none of these": 3.0}

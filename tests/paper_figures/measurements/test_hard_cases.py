"""Where the solver and the surrogate have it hard: their maps, from made-up measurements."""

import pytest

from bem.dataset.designs import PAPER_RANGES
from paper_figures.measurements import figure_surrogate_map
from paper_figures.style import drawing
from paper_figures.tables import table_hard_cases

NUMBERS = ("jumps", "change", "work_change", "energy", "end_over_pull_off", "steps", "seconds")


def test_hard_cases_and_the_worst_of_their_energies():
    numbers = dict.fromkeys(NUMBERS, 0.1) | {"refined_status": "completed"}
    rows = [
        {"where": "inside", **numbers, "status": status, "change": change}
        for status, change in (("completed", 1e-3), ("completed", 1e-2), ("stopped", None))
    ]
    coarse = {"draft": {"status": "completed", "change": 0.05}, "0.05": {"status": "stopped", "change": None}}
    extreme = {"name": "zero dwell", "status": "completed", "coarse": coarse, **numbers}
    content = {"host": "a machine", "accuracy": "standard", "refinement": 4.0, "map": rows, "extremes": [extreme]}
    text = table_hard_cases.compose(content).page()
    assert "2 of 3 completed" in text
    assert "`make measure-soak` has not been run" in text
    named = next(line for line in text.splitlines() if "zero dwell" in line)
    assert [cell.strip() for cell in named.split("|")[6:8]] == ["5", "stopped"]
    row = dict.fromkeys(NUMBERS, 1.0) | {"status": "completed", "refined_status": "completed"}
    cells = table_hard_cases.row_of("two", [row, row | {"energy": -0.2}])
    assert cells[table_hard_cases.HEADER.index("Work over turnover")] == "-0.2"


def test_a_cell_of_the_map_is_a_median_and_a_model_trained_differently_is_told():
    drawn = drawing.figure(height=2.0)
    axes, (low, top), (bottom, high) = drawn.subplots(), PAPER_RANGES["tabor"], PAPER_RANGES["unloading_rate"]
    protocols = {"tabor": [low, low, low, top], "unloading_rate": [high, high, high, bottom]}
    test = {"protocols": protocols, "errors": {"force": [0.01, 0.02, 0.06, 0.1]}}
    figure_surrogate_map.draw_map(drawn, axes, test, "tabor", "unloading_rate")
    cells = axes.collections[0].get_array()
    assert (cells[-1, 0], cells[0, -1]) == pytest.approx((2.0, 10.0))
    case = {"index": 7, "errors": {"force": 0.1, "pull_off_force": 0.2}}
    content = {"model": "M1-concat", "host": "h", "outdated": ["split", "recipe"], "worst": [case], "out_of_range": []}
    table = figure_surrogate_map.worst_table(content)
    assert list(table.rows[0]) == ["worst 1 (no. 7)", "1", "10", "20"]
    assert "trained differently from those compared, with another split and recipe." in table.caption


def test_the_soak_is_shown_among_the_hard_cases():
    found = {"protocols": 100, "raised": 0, "silent": 1, "spikes": 2, "largest_spike_share": 3e-5}
    found |= {"statuses": {"completed": 99, "stopped": 1}, "slowest_seconds": 2.0, "memory_growth": 0.003}
    rows = table_hard_cases.soak_rows({"inside": found, "beyond": found | {"memory_growth": None}})
    assert all(len(row) == len(table_hard_cases.HEADER) for row in rows)
    name, status = rows[0][:2]
    assert name.startswith("soak inside the box: 0 exceptions, 1 silent non-finite, 2 with a lone spike (3e-05 of the ")
    assert name.endswith("range of the force at most), memory growth 0.3 %")
    assert status == "99 of 100 completed"
    calm = table_hard_cases.soak_rows({"inside": found | {"spikes": 0}})[0][0]
    assert "0 with a lone spike, memory" in calm
    assert "memory growth not measured" in rows[1][0]

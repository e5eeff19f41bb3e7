"""Where the solver has it hard, and where a simpler scene suffices, from made-up measurements."""

from pathlib import Path

import pytest

from experiments.common import read_result
from paper_figures.measurements import figure_effects
from paper_figures.style import drawing
from paper_figures.tables import table_hard_cases

NUMBERS = ("jumps", "change", "work_change", "energy", "end_over_pull_off", "steps", "seconds")


def test_hard_cases_and_worst_energy():
    numbers = dict.fromkeys(NUMBERS, 0.1) | {"refined_status": "completed"}
    rows = [
        {"where": "inside", **numbers, "status": status, "change": change}
        for status, change in (("completed", 1e-3), ("completed", 1e-2), ("stopped", None))
    ]
    coarse = {"draft": {"status": "completed", "change": 0.05}, "0.05": {"status": "stopped", "change": None}}
    extreme = {"name": "zero dwell", "status": "completed", "coarse": coarse, **numbers}
    study = {"host": "a machine", "accuracy": "standard", "refinement": 4.0, "map": rows, "extremes": [extreme]}
    text = table_hard_cases.compose(study).page()
    assert "2 of 3 completed" in text
    assert "`make measure-soak` has not been run" in text
    named = next(line for line in text.splitlines() if "zero dwell" in line)
    assert [cell.strip() for cell in named.split("|")[6:8]] == ["5", "stopped"]
    row = dict.fromkeys(NUMBERS, 1.0) | {"status": "completed", "refined_status": "completed"}
    cells = table_hard_cases.row_of("two", [row, row | {"energy": -0.2}])
    assert cells[table_hard_cases.HEADER.index("Work over turnover")] == "-0.2"


def test_soak_is_shown_among_hard_cases():
    soak = {"protocols": 100, "raised": 0, "silent": 1, "spikes": 2, "largest_spike_share": 3e-5}
    soak |= {"statuses": {"completed": 99, "stopped": 1}, "slowest_seconds": 2.0, "memory_growth": 0.003}
    rows = table_hard_cases.soak_rows({"inside": soak, "beyond": soak | {"memory_growth": None}})
    assert all(len(row) == len(table_hard_cases.HEADER) for row in rows)
    name, status = rows[0][:2]
    assert name.startswith("soak inside the box: 0 exceptions, 1 silent non-finite, 2 with a lone spike (3e-05 of the ")
    assert name.endswith("range of the force at most), memory growth 0.3 %")
    assert status == "99 of 100 completed"
    calm = table_hard_cases.soak_rows({"inside": soak | {"spikes": 0}})[0][0]
    assert "0 with a lone spike, memory" in calm
    assert "memory growth not measured" in rows[1][0]


def test_the_tolerance_is_a_line():
    axes = drawing.figure(height=2.0).subplots()
    figure_effects.draw_stand_ins(axes, read_result(Path("published/measurements/effects.json")) | {"tolerance": 0.07})
    assert any(list(line.get_ydata()) == pytest.approx([7.0, 7.0]) for line in axes.lines)

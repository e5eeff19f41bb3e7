"""Where the solver and the surrogate have it hard: their maps, from made-up measurements."""

import numpy as np
import pytest

from bem.dataset.designs import PAPER_RANGES
from paper_figures.measurements import figure_hard_cases, figure_surrogate_map
from paper_figures.style import drawing
from tests.paper_figures.results import SPREAD, UNKNOWN, files_in, made, pictures, tables


def test_hard_cases(measured, tmp_path):
    numbers = {
        "refined_status": "completed",
        "change": 1e-3,
        "work_change": 1e-3,
        "energy": 0.1,
        "end_over_pull_off": 0.5,
        "jumps": 3,
        "steps": 100,
        "seconds": 0.01,
    }
    rows = [
        {"where": "inside", "tabor": mu, "unloading_rate": 1.0 / mu, "status": status, **numbers, "change": change}
        for mu, status, change in ((0.5, "completed", 1e-3), (1.0, "completed", 1e-2), (2.0, "stopped", None))
    ]
    coarse = {"draft": {"status": "completed", "change": 0.05}, "0.05": {"status": "stopped", "change": None}}
    extreme = {"name": "zero dwell", "status": "completed", "coarse": coarse, **numbers}
    path = measured({"accuracy": "standard", "refinement": 4.0, "map": rows, "extremes": [extreme]})
    soak = tmp_path / "soak.json"
    made(figure_hard_cases, path, soak, folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-hard-cases") | tables("hard-cases")
    text = (tmp_path / "hard-cases.md").read_text(encoding="utf-8")
    assert "2 of 3 completed" in text
    assert "`make soak` has not been run" in text
    named = next(line for line in text.splitlines() if "zero dwell" in line)
    assert [cell.strip() for cell in named.split("|")[6:8]] == ["5", "stopped"]


def test_crosses_are_on_what_did_not_complete(kept):
    drawn = drawing.figure(height=2.0)
    axes, rate = drawn.subplots(), {"unloading_rate": 1.0}
    rows = [{"tabor": mu, "status": "completed", "steps": 10.0 * mu, **rate} for mu in (0.5, 1.0)]
    figure_hard_cases.draw(drawn, axes, [*rows, {"tabor": 2.0, "status": "stopped", **rate}], "steps")
    assert list(axes.lines[0].get_xdata()) == [2.0]


def test_the_worst_energy_is_the_least():
    numbers = ("jumps", "change", "work_change", "energy", "end_over_pull_off", "steps", "seconds")
    row = dict.fromkeys(numbers, 1.0) | {"status": "completed", "refined_status": "completed"}
    cells = figure_hard_cases.row_of("two", [row, row | {"energy": -0.2}])
    assert cells[figure_hard_cases.HEADER.index("Work over turnover")] == "-0.2"


def test_a_cell_of_the_map_is_the_median_of_its_trajectories(kept):
    drawn = drawing.figure(height=2.0)
    axes, (low, top), (bottom, high) = drawn.subplots(), PAPER_RANGES["tabor"], PAPER_RANGES["unloading_rate"]
    protocols = {"tabor": [low, low, low, top], "unloading_rate": [high, high, high, bottom]}
    test = {"protocols": protocols, "errors": {"force": [0.01, 0.02, 0.06, 0.1]}}
    figure_surrogate_map.draw_map(drawn, axes, test, "tabor", "unloading_rate")
    cells = axes.collections[0].get_array()
    assert (cells[-1, 0], cells[0, -1]) == pytest.approx((2.0, 10.0))


def test_the_soak_is_shown_among_the_hard_cases():
    found = {
        "protocols": 100,
        "raised": 0,
        "silent": 1,
        "spikes": 2,
        "largest_spike_share": 3e-5,
        "statuses": {"completed": 99, "stopped": 1},
        "slowest_seconds": 2.0,
        "memory_growth": 0.003,
    }
    rows = figure_hard_cases.soak_rows({"inside": found, "beyond": found | {"memory_growth": None}})
    assert all(len(row) == len(figure_hard_cases.HEADER) for row in rows)
    name, status = rows[0][:2]
    assert name.startswith("soak inside the box: 0 exceptions, 1 silent non-finite, 2 with a lone spike (3e-05 of the ")
    assert name.endswith("range of the force at most), memory growth 0.3 %")
    assert status == "99 of 100 completed"
    calm = figure_hard_cases.soak_rows({"inside": found | {"spikes": 0}})[0][0]
    assert "0 with a lone spike, memory" in calm
    assert "memory growth not measured" in rows[1][0]


def test_surrogate_map(measured, tmp_path):
    generator = np.random.default_rng(0)
    protocols = {name: np.geomspace(low, high, 30).tolist() for name, (low, high) in PAPER_RANGES.items()}
    found = {"force": generator.uniform(0.01, 0.1, 30).tolist()}
    case = {
        "protocol": dict.fromkeys(PAPER_RANGES, 1.0),
        "index": 7,
        "errors": {"force": 0.1, "pull_off_force": 0.2},
        "causes": ["jump"],
        "corner": True,
        "force": [0.0, 1.0],
        "predicted": [0.1, 0.9],
    }
    out = [
        {"quantity": name, "side": side, "beyond": beyond, "errors": dict.fromkeys(("force", "pull_off_force"), SPREAD)}
        for name in PAPER_RANGES
        for side in ("above", "below")
        for beyond in (0.0, 0.05, 0.2, 1.0)
    ]
    path = measured(
        {
            "model": "M1-concat",
            "outdated": ["split", "recipe"],
            "test": {"protocols": protocols, "errors": found},
            "by_cause": {"jump": SPREAD, "narrow peak": UNKNOWN | {"count": 0}},
            "worst": [case] * 3,
            "out_of_range": out,
        }
    )
    made(figure_surrogate_map, path, folder=tmp_path)
    wanted = pictures("figure-surrogate-map", "figure-surrogate-worst") | tables("surrogate-map")
    assert files_in(tmp_path) == wanted
    text = (tmp_path / "surrogate-map.md").read_text(encoding="utf-8")
    assert len([line for line in text.splitlines() if line.startswith("| ")]) == 2 + 3 + 5 * 2 * 4
    assert "tabor above by 100 %" in text
    assert "trained differently from those compared, with another split and recipe." in text

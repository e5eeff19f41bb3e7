"""Figures and tables of costs, other software, pretrained models and hard cases; what is published is drawn."""

import json

import numpy as np
import pytest

from experiments.places import Places
from paper_figures.__main__ import function_of, modules
from paper_figures.measurements import cost, effects, solver, surrogates
from paper_figures.style import drawing
from paper_figures.style.writing import Table
from tests.paper_figures.results import SPREAD, UNKNOWN


def test_amortisation_and_cost_of_training():
    lines = [
        {"name": "solver, standard", "fixed_seconds": 0.0, "query_seconds": 0.01},
        {"name": "M1-concat, ONNX batch", "fixed_seconds": 1e3, "query_seconds": 0.001},
        {"name": "paper's solver", "fixed_seconds": 0.0, "query_seconds": 138.0},
    ]
    crossing = {"surrogate": "M1-concat, ONNX batch", "solver": "solver, standard", "queries": 1.1e5}
    never = {"surrogate": "paper's surrogate", "solver": "solver, standard", "queries": None}
    content = {"data_set_seconds": 100.0, "data_set_trajectories": 50, "missing": [], "unmeasured": ["M2-FiLM"]}
    content |= {"retrained": ["M2-gated"], "outdated": ["M1-concat"]}
    assert cost.totals({"fixed_seconds": 3600.0, "query_seconds": 7200.0})[0] == pytest.approx(3.0)
    table = cost.figure_amortisation({**content, "lines": lines, "break_even": [crossing, never]})["amortisation"]
    text = table.page()
    assert "Published but not measured: M2-FiLM. Retrained since the measurement: M2-gated. " in text
    assert "Trained differently from those compared: M1-concat." in text
    assert table.rows[1][-1] == "never"
    cost.figure_amortisation({**content, "lines": lines[:1], "break_even": []})
    history = {"core_minutes": [1.0, 2.0], "best_mse": [0.5, 0.5]}
    run = {"name": "M1-concat", "epochs": 2, "core_minutes": 2.0, "test_mse": 4e-4, "history": history}
    short = run | {"name": "M1-concat-8-epochs", "core_minutes": 1.0, "test_mse": 8e-4}
    content = {"paper_mse": 5e-4, "minutes_to_paper_mse": 1.5, "missing": ["M4-FiLM"], "outdated": {}}
    content |= {"models": [run], "beside": [short]}
    (axes,) = cost.figure_training_cost(content).axes
    held_out = [line.get_xydata()[0].tolist() for line in axes.lines if line.get_label() == "held-out, end of a run"]
    assert held_out == [[2.0, 4e-4], [1.0, 8e-4]]
    assert [0.5, 0.5] in [list(line.get_ydata()) for line in axes.lines]
    assert "1.5 core-minutes" in " ".join(text.get_text() for text in axes.texts)


RUNS = [
    ("tabor 1", "Adhesion", "128 x 128", 30.0, 1e-3),
    ("tabor 1", "Adhesion", "32 x 32", 1.0, 1e-2),
    ("tabor 1", "solver", "draft", 4e-3, 2e-3),
    ("tabor 3", "closed form", "JKR", 1e-3, 0.03),
    ("tabor 3", "paper's discretisation", "50 nodes", 1e-2, 0.1),
    ("Hertz", "solver", "draft", 2e-3, 1e-9),
    ("Hertz", "tamaas", "32 x 32", 2e-2, 1e-4),
]
CONTENT = {"host": "a processor", "packages": {"Adhesion": "0.1", "tamaas": "0.2"}, "start": 2.0}
CONTENT["runs"] = [dict(zip(("problem", "tool", "setting", "seconds", "error"), row, strict=True)) for row in RUNS]


def test_the_ends_of_curves_are_named_and_an_error_that_is_not_resolved_is_a_triangle():
    drawn = cost.figure_peers(CONTENT)
    names = {text.get_text() for axes in drawn.axes for text in axes.texts}
    assert names == {"draft", "32×32", "128×128", "JKR"}
    (axes,) = [axes for axes in cost.figure_peers(CONTENT).axes if axes.get_title() == "compression without adhesion"]
    solver = [line for line in axes.lines if line.get_color() == cost.STYLES["solver"]["color"]]
    assert [(line.get_marker(), line.get_markevery()) for line in solver] == [("o", []), ("v", None)]


def test_shares_above_an_error_and_levels_that_hold_a_share():
    kind = {"counts": [2, 1, 3], "pull_off_errors": [0.0, 1e-3, 0.2]}
    axes = drawing.figure(height=2.0).subplots()
    surrogates.draw_errors(axes, {"uniform": kind, "physical": kind})
    assert [line.get_xdata().max() for line in axes.lines[:2]] == [20.0, 20.0]
    levels = surrogates.levels_of(np.array([[0.05, 0.2], [0.0, 0.75]]))
    # 0.75 alone holds 68 %, and 95 % need the next.
    assert levels == [0.2, 0.75]


def test_table_of_surrogates():
    errors = {"pull_off": [0.5, 2.0, 7.0], "hysteresis": [0.5, 2.0, 9.0]}
    banded = errors | {"inside/pull_off": 0.91, "inside/hysteresis": 0.88, "width/pull_off": [0.5, 2.0, 9.0]}
    places = {"models": {"fast": {"paper": banded, "box": banded}, "M1-concat": {"paper": errors}}}
    seconds = {"solver": {"batch": 3e-3}} | {name: {"batch": 1e-4, "single": 5e-4} for name in ("fast", "M1-concat")}
    first, second, third = surrogates.rows(places, {"seconds": seconds})
    assert first == ["fast", "0.01 to 1", "0.5, 2, 7", "0.5, 2", "0.91, 0.88", "0.5, 2", "0.100", "0.50", "30"]
    assert (second[1], third[4], third[5]) == ("0.1", "", "")


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
    text = solver.table_hard_cases(content).page()
    assert "2 of 3 completed" in text
    assert "`make measure-soak` has not been run" in text
    named = next(line for line in text.splitlines() if "zero dwell" in line)
    assert [cell.strip() for cell in named.split("|")[6:8]] == ["5", "stopped"]
    row = dict.fromkeys(NUMBERS, 1.0) | {"status": "completed", "refined_status": "completed"}
    cells = solver.row_of("two", [row, row | {"energy": -0.2}])
    assert cells[solver.HEADER.index("Work over turnover")] == "-0.2"


def test_the_soak_is_shown_among_the_hard_cases():
    found = {"protocols": 100, "raised": 0, "silent": 1, "spikes": 2, "largest_spike_share": 3e-5}
    found |= {"statuses": {"completed": 99, "stopped": 1}, "slowest_seconds": 2.0, "memory_growth": 0.003}
    rows = solver.soak_rows({"inside": found, "beyond": found | {"memory_growth": None}})
    assert all(len(row) == len(solver.HEADER) for row in rows)
    name, status = rows[0][:2]
    assert name.startswith("soak inside the box: 0 exceptions, 1 silent non-finite, 2 with a lone spike (3e-05 of the ")
    assert name.endswith("range of the force at most), memory growth 0.3 %")
    assert status == "99 of 100 completed"
    calm = solver.soak_rows({"inside": found | {"spikes": 0}})[0][0]
    assert "0 with a lone spike, memory" in calm
    assert "memory growth not measured" in rows[1][0]


SHOWN = [name for name, module in modules().items() if ".measurements." in module]
SEVERAL = {
    "table-accuracy-cost": {"accuracy-cost", "fastest-tool"},
    "figure-amortisation": {"figure-amortisation", "amortisation"},
}
"""Names of what is drawn, where it is more than one thing."""


def published(name):
    path = Places().path(name)
    if not path.is_file():
        pytest.skip("the measurement is not published here")
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", SHOWN)
def test_what_is_published_is_drawn(name, tmp_path):
    function = function_of(name)
    products = function(**Places().arguments(function, name))
    products = products if isinstance(products, dict) else {name: products}
    assert products.keys() == SEVERAL.get(name, {name})
    for stem, product in products.items():
        if isinstance(product, Table):
            assert not stem.startswith("figure-")
            assert {len(row) for row in product.rows} == {len(product.header)}
            product.save(stem, tmp_path)
            # A contact without adhesion has no pull-off force, by which the table of hard cases divides.
            missing = "nan" in (tmp_path / f"{stem}.md").read_text(encoding="utf-8").lower()
            assert missing == (stem == "table-hard-cases")
        else:
            assert stem.startswith("figure-")
            assert all(axes.has_data() or not axes.axison for axes in product.axes)


def test_tolerances_are_in_percent_and_recommendations_counted_of_those_simplified():
    axes = drawing.figure(height=2.0).subplots()
    effects.draw_stand_ins(axes, published("effects") | {"tolerance": 0.07})
    assert any(list(line.get_ydata()) == pytest.approx([7.0, 7.0]) for line in axes.lines)
    numbers = {"kept": 4, "cases": 20, "worst_error": 0.2, "simplified": 5, "by_estimate": 1, "slower": 1}
    row = {"sample": "paper", "quantity": "pull_off_force", "tolerance": 0.1, **numbers}
    row |= dict.fromkeys(("full_seconds", "ratio", "seconds"), SPREAD)
    none = row | dict.fromkeys(("kept", "simplified", "slower"), 0) | {"worst_error": None}
    none |= {"full_seconds": UNKNOWN, "ratio": UNKNOWN}
    some, nothing = ([cell(one) for cell in effects.COLUMNS.values()] for one in (row, none))
    assert {"4 of 5", "0.02 (0.06)"} <= set(some)
    assert {"0 of 0", "-"} <= set(nothing)

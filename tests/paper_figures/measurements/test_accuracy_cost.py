"""The figure and tables of accuracy against cost, from a made-up measurement."""

import json
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.text import Text

from paper_figures.measurements import figure_accuracy_cost
from paper_figures.style.drawing import paper_seconds
from paper_figures.tables import table_accuracy_cost
from tests.paper_figures.results import SPREAD, UNKNOWN
from tests.processes import ROOT


def tool(group, setting, error=0.01, **more):
    spread = SPREAD | {"median": error}
    return {
        "kind": group,
        "setting": setting,
        "protocols": 3,
        "repeats": 2,
        "failures": 0,
        "seconds": SPREAD if group != "measurement steps" else UNKNOWN,
        "run_totals": [1.0, 1.1],
        "errors": dict.fromkeys(("pull_off_force", "hysteresis", "force"), spread),
        **more,
    }


TOOLS = [
    tool("measurement steps", ""),
    tool("solver", "standard"),
    tool("paper's discretisation", "50 nodes, 50 steps", protocols=1),
    tool("closed form", "Hertz, rubbery", error=1.7, protocols=2),
]
for number, family in enumerate(("M1-concat", "M2-FiLM", "M3-FiLM", "M4-FiLM"), start=1):
    TOOLS.append(tool("surrogate", f"{family}, ONNX batch", error=0.01 * number, way="ONNX batch", model=family))
CONTENT = {"protocols": 3, "repeats": 2, "truth_target": 7e-5, "tools": TOOLS}


def test_accuracy_and_cost():
    study = CONTENT | {"host": "a machine", "missing": ["M2-FiLM"], "outdated": ["M1-concat"]}
    text = table_accuracy_cost.compose(study)["accuracy-cost"].page()
    assert "Not published when this was measured: M2-FiLM. Trained differently from those compared: M1-concat." in text
    assert text.count("20 (10-30)") == 7
    hertz = next(line for line in text.splitlines() if "Hertz" in line)
    assert [cell.strip() for cell in hertz.split("|")[3:6]] == ["2 (3)", "2", "0"]
    assert hertz.split("|")[-3].strip() == "170 / 5"
    assert hertz.split("|")[7].strip() == "9.5"
    seconds = paper_seconds()
    assert seconds["paper's solver (mean)"] == pytest.approx(138.2, abs=0.1)
    assert seconds["paper's surrogate"] == 0.16


def test_fewer_protocols_have_open_markers():
    runs = [{"tool": "Adhesion", "problem": "tabor 1", "seconds": 2.0, "error": 0.1}]
    (axes,) = figure_accuracy_cost.compose(CONTENT, {"runs": runs}).axes
    points = {tuple(point): line for line in axes.lines for point in line.get_xydata() if line.get_marker() != "None"}
    median, extremes = 100.0 * SPREAD["median"], [(0.02, float(number)) for number in (1, 2, 3, 4)]
    stated = (paper_seconds()["paper's surrogate"], 2.2)
    assert set(points) == {(0.02, median), *extremes, (2.0, 10.0), stated}
    assert [line.get_markerfacecolor() for line in axes.lines].count("white") == 1
    assert [1.0, 5.0] in [list(line.get_ydata()) for line in axes.lines]  # from the median to the 95th percentile


def touching(axes):
    """Names that a marker or a line of the axes touches."""
    size = axes.figure.dpi / 72
    boxes = {text.get_text(): Text.get_window_extent(text) for text in axes.texts}
    touched = set()
    for line in axes.lines:
        points = line.get_transform().transform(line.get_xydata())
        drawn = line.get_linestyle() != "None" and line.get_linewidth() > 0.0
        path = np.array([a + share * (b - a) for a, b in pairwise(points) if drawn for share in np.linspace(0, 1, 500)])
        radius = 0.5 * line.get_markersize() * size if line.get_marker() != "None" else 0.0
        for name, box in boxes.items():
            for places, margin in ((points if radius else points[:0], radius), (path, 0.0)):
                inside = [box.padded(margin).contains(*point) for point in places]
                touched |= {name} if any(inside) else set()
    return touched


def test_no_name_touches_a_marker_or_a_line():
    paths = [ROOT / f"published/measurements/{name}.json" for name in ("accuracy_cost", "peers")]
    drawn = figure_accuracy_cost.compose(*(json.loads(path.read_text(encoding="utf-8")) for path in paths))
    drawn.canvas.draw()
    assert [touching(axes) for axes in drawn.axes] == [set()]


def timed_tool(group, setting, seconds, p95, **more):
    timed = tool(group, setting, **more)
    timed["seconds"] = SPREAD | {"median": seconds}
    timed["errors"] = dict.fromkeys(timed["errors"], SPREAD | {"p95": p95})
    return timed


def test_fastest_tool_keeps_the_error():
    choose = table_accuracy_cost.fastest
    tools = [
        timed_tool("solver", "draft", 2e-3, 0.01),
        timed_tool("solver", "standard", 8e-3, 0.002),
        timed_tool("surrogate", "M1, ONNX batch", 1e-4, 0.02, way="ONNX batch", model="M1"),
        timed_tool("surrogate", "M1, ONNX single", 4e-3, 0.02, way="ONNX single", model="M1"),
        timed_tool("closed form", "Hertz", 1e-5, 0.001) | {"protocols": 2},
        timed_tool("solver", "broken", 1e-5, 0.001) | {"failures": 1},
    ]
    assert choose(tools, "force", 0.05, batch=True) == "M1, ONNX batch (0.1 ms)"
    assert choose(tools, "force", 0.05, batch=False) == "solver, draft (2 ms)"
    assert choose(tools, "force", 0.01, batch=True) == "solver, draft (2 ms)"
    assert choose(tools, "force", 0.005, batch=True) == "solver, standard (8 ms)"
    assert choose(tools, "force", 0.001, batch=True) == "none"

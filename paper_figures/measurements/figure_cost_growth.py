"""Figure and table: growth of the cost with nodes, steps, Tabor parameter, peak indentation and unloading rate.

The figure reads the measurement of `experiments.measurements.cost_growth`.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing
from paper_figures.style.cost_style import KINDS, sparse_ticks
from paper_figures.style.writing import Table, caption, number

LABELS = {
    "nodes": "nodes",
    "steps": "time steps",
    "tabor": r"Tabor parameter $\mu$",
    "peak_indentation": r"peak indentation $\hat\delta_l$",
    "unloading_rate": r"unloading rate $\hat v_U$",
}
PAPER_SAYS = {
    "nodes": "2, and $N_\\mathrm{iter}$",
    "steps": "1",
    "tabor": "grows",
    "peak_indentation": "grows",
    "unloading_rate": "grows as the rate falls",
}
TOOLS = {"solver": "solver", "baseline": "paper's discretisation"}


def draw(axes: Axes, curve: dict[str, Any], name: str, kind: str) -> None:
    """Draw the measured medians and the fitted power."""
    points = sorted(curve["points"], key=lambda point: point[name])
    x = np.array([point[name] for point in points])
    y = np.array([point["seconds"]["median"] for point in points])
    power = curve["exponent"]
    style = KINDS[kind]
    through = np.exp(np.mean(np.log(y) - power * np.log(x)))
    low, high = (np.array([point["seconds"][name] for point in points]) for name in ("low", "high"))
    axes.errorbar(x, y, [y - low, high - y], linestyle="", markersize=3.5, elinewidth=0.7, **style)
    axes.set(xscale="log", yscale="log")
    axes.loglog(x, y, color=style["color"], linewidth=0.9)
    axes.loglog(
        x, through * x**power, color=style["color"], linewidth=0.9, linestyle=":", label=drawing.written(power, "+.2f")
    )
    axes.set_xlabel(LABELS[name])


def rows_of(content: dict[str, Any]) -> list[list[str]]:
    """One row for each quantity: exponents with standard errors."""
    box = content["data_set"]["exponents"]
    rows = []
    for name, label in LABELS.items():
        cells = [label]
        for tool in TOOLS:
            curve = content[tool][name]
            cells += [_power(curve["exponent"], curve["error"]), _power(curve["iterations"], curve["iterations_error"])]
        rows.append([*cells, number(box[name], 2) if name in box else "-", PAPER_SAYS[name]])
    return rows


def _power(slope: float, error: float) -> str:
    return f"{slope:.2f} ± {error:.2f}"


def compose(cost_growth: Any) -> dict[str, Figure | Table]:
    """Draw the figure and write the table."""
    drawn = drawing.figure(height=4.0)
    panels = drawn.subplots(2, 3)
    for axes, name, panel in zip(panels.flat, LABELS, "abcde", strict=False):
        for tool, kind in TOOLS.items():
            draw(axes, cost_growth[tool][name], name, kind)
        axes.set_ylabel("time of a step (s)" if name == "nodes" else "time (s)")
        sparse_ticks(axes)
        # The lines of this panel leave room between them only, which is widest on the right.
        place = {"loc": "center right", "bbox_to_anchor": (1.0, 0.45)} if name == "unloading_rate" else {"loc": "best"}
        axes.legend(title="fitted power", **place)
        drawing.letter(axes, panel)
    last = panels[1, 2]
    box = cost_growth["data_set"]["exponents"]
    last.barh(range(len(box)), list(box.values()), color=drawing.BLACK)
    last.axvline(0.0, color="0.4", linewidth=0.6)
    last.set_yticks(range(len(box)), [name.replace("_", " ").replace("tabor", "Tabor parameter") for name in box])
    last.invert_yaxis()
    last.set_xlabel("power over the data set (solver)")
    drawing.letter(last, "f")
    handles = [panels[0, 0].plot([], [], label=kind, **KINDS[kind])[0] for kind in TOOLS.values()]
    drawn.legend(handles=handles, loc="outside lower center", ncol=2)
    return {"figure-cost-growth": drawn, "cost-growth": exponents_table(cost_growth)}


def exponents_table(content: dict[str, Any]) -> Table:
    """Table of the fitted powers and the paper's statement."""
    box = content["data_set"]
    return Table(
        [
            "Quantity",
            "Solver",
            "Its iterations a step",
            "Paper's discretisation",
            "Its iterations a step",
            "Solver, over the data set",
            "Paper's statement",
        ],
        rows_of(content),
        caption(
            "cost-growth", host=content["host"], trajectories=box["trajectories"], explained=100 * box["explained"]
        ),
    )

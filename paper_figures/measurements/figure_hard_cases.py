"""Figure and table: the solver over the paper's box, far beyond it, and at named extremes.

The figure reads the measurement of `experiments.robustness.hard_case_map`, and that of `experiments.robustness.soak` if
there is one.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from bem.dataset.designs import PAPER_RANGES
from paper_figures.style import drawing
from paper_figures.style.writing import Table, number, percent

COLOURED = {
    "steps": "time steps",
    "seconds": "time (s)",
    "change": "change when refined (%)",
    "jumps": "jumps",
}
SCALE = {"change": 100.0}


def draw(drawn: Figure, axes: Axes, rows: list[dict[str, Any]], name: str) -> None:
    """Draw all protocols over Tabor parameter and unloading rate, coloured by one quantity; crosses are unfinished."""
    unfinished = [row for row in rows if row["status"] != "completed"]
    known = [row for row in rows if row["status"] == "completed" and row[name] is not None]
    known.sort(key=lambda row: row[name])
    value = np.array([row[name] for row in known], dtype=float) * SCALE.get(name, 1.0)
    if name == "jumps":
        norm, value = BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3), np.minimum(value, 2.0)
    else:
        norm = LogNorm(*np.percentile(np.maximum(value, 1e-6), [2.0, 100.0]))
    where = [row["tabor"] for row in known], [row["unloading_rate"] for row in known]
    colors = ListedColormap(["0.8", drawing.BLUE, drawing.VERMILION]) if name == "jumps" else "viridis"
    points = axes.scatter(*where, c=value, norm=norm, cmap=colors, s=7, linewidth=0)
    axes.plot(
        [row["tabor"] for row in unfinished],
        [row["unloading_rate"] for row in unfinished],
        "x",
        color=drawing.VERMILION,
        markersize=5,
    )
    (left, right), (bottom, top) = PAPER_RANGES["tabor"], PAPER_RANGES["unloading_rate"]
    axes.add_patch(Rectangle((left, bottom), right - left, top - bottom, fill=False, color="0.3", linewidth=0.8))
    axes.set(xscale="log", yscale="log", xlabel=r"Tabor parameter $\mu$", ylabel=r"unloading rate $\hat v_U$")
    bar = drawn.colorbar(points, ax=axes, label=COLOURED[name])
    if name == "jumps":
        bar.set_ticks([0, 1, 2], labels=["0", "1", "2 or more"])


def _extreme(rows: list[dict[str, Any]], key: str, worst: Callable[[list[float]], float] = max) -> float:
    values = [row[key] for row in rows if row[key] is not None]
    return float(worst(values)) if values else float("nan")


def _counted(rows: list[dict[str, Any]], key: str) -> str:
    if len(rows) == 1:
        return rows[0][key]
    return f"{sum(row[key] == 'completed' for row in rows)} of {len(rows)} completed"


def _coarse(rows: list[dict[str, Any]], accuracy: str) -> str:
    if len(rows) > 1 or "coarse" not in rows[0]:
        return "-"
    found = rows[0]["coarse"][accuracy]
    return percent(found["change"]) if found["status"] == "completed" else found["status"]


COLUMNS: dict[str, Callable[[list[dict[str, Any]]], str]] = {
    "Status": lambda rows: _counted(rows, "status"),
    "Status, refined": lambda rows: _counted(rows, "refined_status"),
    "Jumps": lambda rows: number(_extreme(rows, "jumps")),
    "Change of pull-off force (%)": lambda rows: percent(_extreme(rows, "change")),
    "Change, draft (%)": lambda rows: _coarse(rows, "draft"),
    "Change, 0.05 (%)": lambda rows: _coarse(rows, "0.05"),
    "Change of work (%)": lambda rows: percent(_extreme(rows, "work_change")),
    "Work over turnover": lambda rows: number(_extreme(rows, "energy", min), 2),
    "End over pull-off force": lambda rows: number(_extreme(rows, "end_over_pull_off"), 2),
    "Steps": lambda rows: number(_extreme(rows, "steps"), 5),
    "Time (s)": lambda rows: number(_extreme(rows, "seconds"), 2),
}
"""Column heads, and functions that write the cell of one case, or of the worst of several."""
HEADER = ["Case", *COLUMNS]


def row_of(name: str, rows: list[dict[str, Any]]) -> list[str]:
    """One row of the table."""
    return [name, *(cell(rows) for cell in COLUMNS.values())]


def soak_rows(soak: dict[str, Any]) -> list[list[str]]:
    """Rows of the soak; the columns of a refinement stay empty."""
    rows = []
    for where, words in (("inside", "inside the box"), ("beyond", "beyond the box"), ("stiff", "of stiff contacts")):
        if where not in soak:
            continue
        found = soak[where]
        growth = found["memory_growth"]
        memory = "not measured" if growth is None else f"{percent(growth)} %"
        spikes = f"{found['spikes']} with a lone spike"
        if found["spikes"]:
            spikes += f" ({number(found['largest_spike_share'], 1)} of the range of the force at most)"
        name = (
            f"soak {words}: {found['raised']} exceptions, {found['silent']} silent non-finite, "
            f"{spikes}, memory growth {memory}"
        )
        status = f"{found['statuses'].get('completed', 0)} of {found['protocols']} completed"
        rows.append([name, status, *["-"] * (len(HEADER) - 3), number(found["slowest_seconds"], 2)])
    return rows


def compose(hard_case_map: Any, soak: Any = None) -> dict[str, Figure | Table]:
    """Draw the map and write the table."""
    drawn = drawing.figure(height=4.6)
    panels = drawn.subplots(2, 2)
    for axes, name, panel in zip(panels.flat, COLOURED, "abcd", strict=True):
        draw(drawn, axes, hard_case_map["map"], name)
        drawing.letter(axes, panel)
    return {"figure-hard-cases": drawn, "hard-cases": worst_table(hard_case_map, soak)}


def worst_table(content: dict[str, Any], soak: dict[str, Any] | None) -> Table:
    """Table of the worst cases of the map, the extremes, and the soak."""
    groups = {where: [row for row in content["map"] if row["where"] == where] for where in ("inside", "beyond")}
    rows = [row_of(f"{where} the box, worst of {len(group)}", group) for where, group in groups.items() if group]
    rows += [row_of(row["name"], [row]) for row in content["extremes"]]
    soaked = " `make soak` has not been run."
    if soak is not None:
        rows += soak_rows(soak)
        soaked = f" The soak ran at {soak['accuracy']} accuracy on {soak['host']}; its time is that of the slowest."
    return Table(
        HEADER,
        rows,
        f"The solver at {content['accuracy']} accuracy in difficult cases, and refined by dividing the target by "
        f"{content['refinement']:g}. A negative work over turnover would mean that energy is created. Rows of several "
        "cases show the worst of each column. Change, draft and 0.05: change of the pull-off force at those accuracies "
        f"from the refined one. Measured on {content['host']}.{soaked}",
    )

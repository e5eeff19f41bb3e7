"""Figures and table: errors of a surrogate over the box and out of range, and its worst trajectories.

The figures read the measurement of `experiments.surrogates.surrogate_map`.
"""

from itertools import zip_longest
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator
from scipy.stats import binned_statistic_2d

from bem.dataset.designs import PAPER_RANGES
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, median_and_p95, percent

LABELS = {name: f"{name.replace('_', ' ')} {symbol}" for name, symbol in drawing.SYMBOLS.items()}
LABELS["tabor"] = r"Tabor parameter $\mu$"
COLORS = (drawing.BLUE, drawing.RED, drawing.GREEN, drawing.VIOLET, drawing.ORANGE)
BINS = 6


def draw_map(drawn: Figure, axes: Axes, test: dict[str, Any], across: str, up: str) -> None:
    """Draw the median force error in cells of two quantities."""
    x, y = (np.log10(test["protocols"][name]) for name in (across, up))
    edges = [np.linspace(*np.log10(PAPER_RANGES[name]), BINS + 1) for name in (across, up)]
    error = 100.0 * np.array(test["errors"]["force"])
    cell = binned_statistic_2d(x, y, error, "median", bins=edges).statistic
    mesh = axes.pcolormesh(10.0 ** edges[0], 10.0 ** edges[1], cell.T, norm=LogNorm())
    axes.set(xscale="log", yscale="log", xlabel=LABELS[across], ylabel=LABELS[up])
    drawing.log_labels(axes.xaxis)
    bar = drawn.colorbar(mesh, ax=axes, label="median force error (%)")
    bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 4.0, 6.0)))
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    bar.minorticks_off()


def draw_out_of_range(axes: Axes, rows: list[dict[str, Any]]) -> None:
    """Draw the median force error over the distance of one quantity beyond its bound."""
    for name, color in zip(drawing.SYMBOLS, COLORS, strict=True):
        for side, line in (("above", "-"), ("below", ":")):
            points = [row for row in rows if row["quantity"] == name and row["side"] == side]
            x = [100.0 * point["beyond"] for point in points]
            y = [100.0 * point["errors"]["force"]["median"] for point in points]
            label = drawing.SYMBOLS[name] if side == "above" else None
            axes.plot(x, y, color=color, linestyle=line, marker=".", label=label)
    axes.set_xscale("symlog", linthresh=5.0)
    axes.set_xticks([0, 5, 20, 100], labels=["0", "5", "20", "100"])
    axes.set(yscale="log", xlabel="beyond the bound (%)", ylabel="median force error (%)")
    drawing.log_labels(axes.yaxis)
    axes.legend(ncol=2, title="full: above, dotted: below")


def compose(surrogate_map: Any) -> dict[str, Figure | Table]:
    """Draw both figures and write the table."""
    drawn, panels = drawing.panels(1, 3, height=2.3)
    draw_map(drawn, panels[0], surrogate_map["test"], "tabor", "unloading_rate")
    draw_map(drawn, panels[1], surrogate_map["test"], "peak_indentation", "loading_rate")
    draw_out_of_range(panels[2], surrogate_map["out_of_range"])
    figures = {"figure-surrogate-map": drawn, "figure-surrogate-worst": draw_worst_cases(surrogate_map)}
    return {**figures, "surrogate-map": worst_table(surrogate_map)}


def draw_worst_cases(content: dict[str, Any]) -> Figure:
    """Draw the worst trajectories over their measurement steps, one panel each, so that short phases are visible."""
    drawn = drawing.figure(height=6.6)
    panels = drawn.subplots(5, 4)
    for axes, case in zip_longest(panels.flat, content["worst"]):
        if case is None:
            axes.set_axis_off()
            continue
        axes.plot(case["force"], color=drawing.BLACK, linewidth=0.9)
        axes.plot(case["predicted"], color=models_style.color(content["model"]), linewidth=0.9)
        protocol = case["protocol"]
        axes.set_title(rf"$\mu={protocol['tabor']:.3g}$, $\hat\delta_l={protocol['peak_indentation']:.3g}$")
    drawn.supxlabel("measurement step")
    drawn.supylabel(drawing.FORCE)
    drawn.legend(panels.flat[0].lines, ("solver", content["model"]), loc="outside upper center", ncols=2)
    return drawn


def worst_table(content: dict[str, Any]) -> Table:
    """Table of the worst trajectories and of the errors out of range."""
    other = " and ".join(content.get("outdated", []))
    rows = []
    for place, case in enumerate(content["worst"], start=1):
        errors = [percent(case["errors"][name]) for name in ("force", "pull_off_force")]
        rows.append([f"worst {place} (no. {case['index']})", "1", *errors])
    for row in content["out_of_range"]:
        errors = [median_and_p95(row["errors"][name]) for name in ("force", "pull_off_force")]
        name = f"{row['quantity'].replace('_', ' ')} {row['side']} by {100.0 * row['beyond']:g} %"
        rows.append([name, str(row["errors"]["force"]["count"]), *errors])
    old = f" The model was trained differently from those compared, with another {other}." if other else ""
    return Table(
        ["Trajectories", "Protocols", "Force error (%)", "Pull-off error (%)"],
        rows,
        caption("surrogate-map", model=content["model"], host=content["host"], old=old),
    )

"""Figure: error against processor seconds on the same elastic sphere, for the solver and other software.

There is one panel for each problem. Lines join the settings of a tool, from coarse to fine; closed forms are named. An
error below `LEAST` is drawn there, with an arrow.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterMathtext, LogLocator, NullLocator

from bem.results.plots import COLOURS
from paper_figures.style import drawing
from paper_figures.style.drawing import KINDS

STYLES = {
    **{tool: KINDS[tool] for tool in ("solver", "paper's discretisation", "closed form")},
    "Adhesion": {"color": COLOURS["Adhesion"], "marker": "D"},
    "tamaas": {"color": COLOURS["tamaas"], "marker": "^"},
}
TITLES = {
    "tabor 1": r"largest tension, $\mu = 1$",
    "tabor 3": r"largest tension, $\mu = 3$",
    "Hertz": "compression without adhesion",
}
LEAST = 1e-4
"""Least error drawn, in percent; smaller ones are not resolved by the solution with which all tools are compared."""
ENDS = {"solver": ("draft", "reference"), "Adhesion": ("32 x 32", "128 x 128"), "tamaas": ("32 x 32", "256 x 256")}
"""Settings that are named in the panels."""
RIGHT, BELOW, LEFT = (5, 0, "left", "center"), (0, -5, "center", "top"), (-5, 0, "right", "center")
SIDES = {"JKR": RIGHT, "DMT": RIGHT} | dict.fromkeys(("Maugis-Dugdale", "reference", "128×128", "256×256"), BELOW)
"""Position of a name: offset in points, and alignment; other names are to the left."""


def draw(axes: Axes, runs: list[dict[str, Any]]) -> None:
    """Draw all tools of one problem."""
    for tool, style in STYLES.items():
        points = [run for run in runs if run["tool"] == tool]
        seconds = [run["seconds"] for run in points]
        errors = [max(100.0 * run["error"], LEAST) for run in points]
        line = "" if tool == "closed form" else "-"
        resolved = [index for index, error in enumerate(errors) if error > LEAST]
        axes.plot(seconds, errors, linestyle=line, linewidth=1.0, markersize=4, markevery=resolved, **style)
        for run, second, error in zip(points, seconds, errors, strict=True):
            if error == LEAST:
                axes.plot(second, error, "v", color=style["color"], markersize=5)
            if tool == "closed form" or run["setting"] in ENDS.get(tool, ()):
                text = run["setting"].replace(" x ", "×")
                across, up, ha, va = SIDES.get(text, LEFT)
                drawing.note(axes, text, (second, error), (across, up), ha=ha, va=va, color=style["color"])
    axes.set(xscale="log", yscale="log", xlabel="time, one core (s)", xlim=(3e-6, 3e2), ylim=(0.25 * LEAST, 60.0))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=12))
        axis.set_major_formatter(LogFormatterMathtext())
        axis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_locator(LogLocator(base=100.0))


def compose(peers: Any) -> Figure:
    """Draw the figure."""
    drawn, panels = drawing.panels(1, len(TITLES), sharey=True, height=2.9)
    for axes, (problem, title) in zip(panels, TITLES.items(), strict=True):
        draw(axes, [run for run in peers["runs"] if run["problem"] == problem])
        axes.set_title(title)
    panels[0].set_ylabel("error (%)")
    handles = [
        panels[0].plot([], [], label=tool, markersize=4, linewidth=0 if tool == "closed form" else 1.0, **style)[0]
        for tool, style in STYLES.items()
    ]
    drawn.legend(handles=handles, loc="outside lower center", ncol=len(handles))
    return drawn

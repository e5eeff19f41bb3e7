"""Figure: seconds per trajectory against the error of the pull-off force, for every tool that gives one.

Markers are medians over the same held-out protocols, open where there are fewer of them; thin lines extend to the 95th
percentile of the error, except for the 18 paper models. Surrogates are called in batches, the pretrained ones also one
at a time. Other software solves an elastic sphere. The figure reads the measurements of
`experiments.measurements.accuracy_cost` and `experiments.measurements.peers`.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem.results.plots import COLOURS
from paper_figures.style import drawing, models_style
from paper_figures.style.drawing import KINDS, paper_seconds
from surrogate.files import PRETRAINED

NAMED = {"draft": 9, "standard": -5, "reference": -5}
"""Accuracies of the solver that are named, and how far beside: the pretrained models are on the left of `draft`."""
PEER = "Adhesion"


def draw(axes: Axes, tools: list[dict[str, Any]]) -> None:
    """Draw the tools of this repository; the solver and the paper's discretisation are lines."""
    most = max(tool["protocols"] for tool in tools)
    for group in ("solver", "paper's discretisation", *PRETRAINED):
        points = [tool for tool in tools if tool["kind"] == group]
        places = [place(tool) for tool in points]
        look = {"linestyle": "" if group in PRETRAINED else "-", "linewidth": 1.0, "markersize": 3.5}
        axes.plot(*zip(*places, strict=True), label=group, **KINDS[group] | look)
        for tool, (seconds, error) in zip(points, places, strict=True):
            color, high = KINDS[group]["color"], 100.0 * tool["errors"]["pull_off_force"]["p95"]
            axes.plot([seconds] * 2, [error, high], color=color, linewidth=0.5)
            if tool["protocols"] < most:
                axes.plot(seconds, error, markersize=3.5, markerfacecolor="white", **KINDS[group])
            if group == "solver" and tool["setting"] in NAMED:
                beside(axes, tool["setting"], (seconds, error), color, NAMED[tool["setting"]])
    for tool in tools:
        if tool.get("model") and tool["way"] == "ONNX batch":
            axes.plot(*place(tool), "o", color=models_style.color(tool["model"]), markersize=2.4)
        if tool["kind"] == "measurement steps":
            level = 100.0 * tool["errors"]["pull_off_force"]["median"]
            axes.axhline(level, color="0.6", linewidth=0.7, linestyle="--", zorder=0)
            beside(axes, "120 steps", (6e-3, level), "0.4", 5, 6)


def draw_others(axes: Axes, peers: dict[str, Any]) -> None:
    """Draw other software, and what the paper states of its solver and its surrogate."""
    runs = [run for run in peers["runs"] if run["tool"] == PEER and run["problem"] == "tabor 1"]
    places = [(run["seconds"], 100.0 * run["error"]) for run in runs]
    look = {"color": COLOURS[PEER], "marker": "D", "markersize": 3.5, "linewidth": 1.0}
    axes.plot(*zip(*places, strict=True), label=f"{PEER}, elastic", **look)
    stated = paper_seconds()
    at = stated["paper's surrogate"], drawing.paper_values("reference_model")["pull_off_force_percent"]
    axes.plot(*at, "*", color=drawing.PAPER, markersize=6)
    beside(axes, "paper's surrogate", at, drawing.PAPER, 0, 12)
    solver = stated["paper's solver (mean)"]
    axes.axvline(solver, color=drawing.PAPER, linewidth=0.8, linestyle=":")
    drawing.beside(axes, solver, "paper's solver (mean)", height=0.5, shift=2, rotation=90, color=drawing.PAPER)


def beside(axes: Axes, text: str, at: tuple[float, float], color: str, right: float, up: float = 0.0) -> None:
    """Write a name some points to the right of a marker, or to its left, and above it."""
    drawing.note(axes, text, at, (right, up), ha="right" if right < 0 else "left", va="center", color=color)


def place(tool: dict[str, Any]) -> tuple[float, float]:
    """Median seconds, and median error of the pull-off force in percent."""
    return tool["seconds"]["median"], 100.0 * tool["errors"]["pull_off_force"]["median"]


def compose(accuracy_cost: Any, peers: Any) -> Figure:
    """Draw the figure."""
    drawn = drawing.figure(width=drawing.COLUMN, height=3.4)
    axes = drawn.subplots()
    axes.set(xscale="log", yscale="log", xlim=(1e-4, 1e3), ylim=(1e-4, 1e2))
    axes.set(xlabel="processor time of a trajectory (s)", ylabel="error of the pull-off force (%)")
    draw_others(axes, peers)
    draw(axes, accuracy_cost["tools"])
    handles = [*axes.get_legend_handles_labels()[0], *models_style.family_handles()]
    drawn.legend(handles=handles, loc="outside lower center", ncols=4, columnspacing=1.0, handlelength=1.4)
    return drawn

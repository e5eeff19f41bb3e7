"""Seconds and errors of every tool on the same held-out protocols, from `experiments.measurements.accuracy_cost`."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem._support.wording import markdown_table
from bem.plots import COLOURS
from paper_figures.style import drawing, models_style
from paper_figures.style.drawing import KINDS, paper_seconds
from paper_figures.style.models_style import REFERENCE
from paper_figures.style.writing import Table, caption, left_out, median_and_p95, milliseconds, number, percent

NAMED = {"draft": 9, "standard": -5, "reference": -5}
"""Accuracies of the solver that are named, and how far beside: the pretrained models are on the left of `draft`."""
PEER = "Adhesion"
PRETRAINED = ("fast", "accurate")


def draw(axes: Axes, tools: list[dict[str, Any]]) -> None:
    """Draw the tools of this repository; the solver and the paper's discretisation are lines."""
    most = max(tool["protocols"] for tool in tools)
    for kind in ("solver", "paper's discretisation", *PRETRAINED):
        points = [tool for tool in tools if tool["kind"] == kind]
        places = [place(tool) for tool in points]
        look = {"linestyle": "" if kind in PRETRAINED else "-", "linewidth": 1.0, "markersize": 3.5}
        axes.plot(*zip(*places, strict=True), label=kind, **KINDS[kind] | look)
        for tool, (seconds, error) in zip(points, places, strict=True):
            color, high = KINDS[kind]["color"], 100.0 * tool["errors"]["pull_off_force"]["p95"]
            axes.plot([seconds] * 2, [error, high], color=color, linewidth=0.5)
            if tool["protocols"] < most:
                axes.plot(seconds, error, markersize=3.5, markerfacecolor="white", **KINDS[kind])
            if kind == "solver" and tool["setting"] in NAMED:
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


def figure_accuracy_cost(accuracy_cost: Any, peers: Any) -> Figure:
    """Figure: seconds per trajectory against the error of the pull-off force, for every tool that gives one.

    Markers are medians over the same held-out protocols, open where there are fewer of them; thin lines extend to the
    95th percentile of the error, except for the 18 paper models. Surrogates are called in batches, the pretrained ones
    also one at a time. Other software solves an elastic sphere. The figure reads the measurements of
    `experiments.measurements.accuracy_cost` and `experiments.measurements.peers`.
    """
    drawn = drawing.figure(width=drawing.COLUMN, height=3.4)
    axes = drawn.subplots()
    axes.set(xscale="log", yscale="log", xlim=(1e-4, 1e3), ylim=(1e-4, 1e2))
    axes.set(xlabel="processor time of a trajectory (s)", ylabel="error of the pull-off force (%)")
    draw_others(axes, peers)
    draw(axes, accuracy_cost["tools"])
    handles = [*axes.get_legend_handles_labels()[0], *models_style.family_handles()]
    drawn.legend(handles=handles, loc="outside lower center", ncols=4, columnspacing=1.0, handlelength=1.4)
    return drawn


CHOICES = [
    "Error wanted (%)",
    "Force, one at a time",
    "Force, many at once",
    "Pull-off force, one at a time",
    "Pull-off force, many at once",
]
LACKING = {"missing": "Not published when this was measured", "outdated": "Trained differently from those compared"}
WANTED = (0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4)
ERRORS = {"pull_off_force": "Pull-off error (%)", "force": "Force error (%)", "hysteresis": "Hysteresis error (%)"}


def run_to_run(tool: dict[str, Any]) -> str:
    """Spread of the seconds of whole runs in percent; '-' if there is only one."""
    totals = tool["run_totals"]
    timed = tool["seconds"]["median"] is not None and len(totals) > 1
    return percent(np.ptp(totals) / np.median(totals)) if timed else "-"


COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Tool": lambda tool: tool["kind"],
    "Setting": lambda tool: tool["setting"],
    "Protocols (timed)": lambda tool: f"{tool['protocols']} ({tool['seconds']['count']})",
    "Repeats": lambda tool: str(tool["repeats"]),
    "Failed": lambda tool: str(tool["failures"]),
    "Time (ms), median (quartiles)": lambda tool: milliseconds(tool["seconds"]),
    "Run to run (%)": run_to_run,
    **{head: lambda tool, name=name: median_and_p95(tool["errors"][name]) for name, head in ERRORS.items()},
}
"""Column heads, and functions that write the cell of one tool; '-' for a quantity that it does not give."""


def fastest(tools: list[dict[str, Any]], quantity: str, wanted: float, *, batch: bool) -> str:
    """The tool with the smallest median time whose 95th percentile of the error is at most `wanted`, and its time.

    Only tools that were measured on every protocol without a failure are considered; with `batch`, those that predict
    many trajectories at once are included.
    """
    most = max(tool["protocols"] for tool in tools)
    able = [
        tool
        for tool in tools
        if tool["protocols"] == most
        and not tool["failures"]
        and tool["seconds"]["median"] is not None
        and tool["errors"][quantity]["p95"] is not None
        and tool["errors"][quantity]["p95"] <= wanted
        and (batch or tool.get("way") != "ONNX batch")
    ]
    if not able:
        return "none"
    best = min(able, key=lambda tool: tool["seconds"]["median"])
    name = best["setting"] if best["kind"] == "surrogate" else f"{best['kind']}, {best['setting']}"
    return f"{name} ({number(1e3 * best['seconds']['median'])} ms)"


def choices(tools: list[dict[str, Any]]) -> list[list[str]]:
    """One row for each wanted error."""
    asked = [(quantity, batch) for quantity in ("force", "pull_off_force") for batch in (False, True)]
    return [
        [number(100.0 * wanted), *(fastest(tools, quantity, wanted, batch=batch) for quantity, batch in asked)]
        for wanted in WANTED
    ]


def page_text(accuracy_cost: Any) -> str:
    """The table of the fastest tools as Markdown, for docs/cost.md."""
    protocols, refined = accuracy_cost["protocols"], _refined(accuracy_cost)
    few = f", {refined} of which have a refined solution" if refined < protocols else ""
    words = f"Measured on {protocols} held-out protocols{few}, one core of {accuracy_cost['host']}."
    return f"{markdown_table(CHOICES, choices(accuracy_cost['tools']))}\n\n{words}{left_out(accuracy_cost, LACKING)}"


def solver_text(accuracy_cost: Any) -> str:
    """Cost and errors of the solver at each accuracy, as Markdown, for docs/solver-benchmark.md."""
    rows = []
    for tool in accuracy_cost["tools"]:
        if tool["kind"] != "solver":
            continue
        cells = [number(1e3 * tool["seconds"][of]) for of in ("mean", "median", "p95", "largest")]
        cells += [
            " / ".join(percent(tool["errors"][quantity][of]) for of in ("median", "p95", "largest"))
            for quantity in ERRORS
        ]
        rows.append([tool["setting"], f"{tool['target']:g}", str(tool["failures"]), *cells])
    header = ["Accuracy", "Target", "Failed", "Mean (ms)", "Median (ms)", "95th (ms)", "Largest (ms)", *ERRORS.values()]
    table = markdown_table(header, rows, "lrrrrrr")
    return f"{table}\n\n{accuracy_cost['protocols']} held-out protocols, one core of {accuracy_cost['host']}."


def calls_text(accuracy_cost: Any) -> str:
    """What each way to call the reference model costs, as Markdown, for docs/control.md."""
    ways = [tool for tool in accuracy_cost["tools"] if tool.get("model") == REFERENCE]
    slowest = max(tool["seconds"]["median"] for tool in ways)
    cells = [
        [tool["way"], f"{1e3 * tool['seconds']['median']:.3f}", f"{slowest / tool['seconds']['median']:.1f}"]
        for tool in ways
    ]
    header = ["way", "ms per trajectory", "times faster than model.predict"]
    measured = f"Measured on one core of {accuracy_cost['host']}."
    return f"{REFERENCE}, on one core\n\n{markdown_table(header, cells, 'lrr')}\n\n{measured}"


def _refined(content: dict[str, Any]) -> int:
    """Number of protocols whose refined solution completed, so that their errors are known."""
    return max(tool["errors"]["force"]["count"] for tool in content["tools"])


def table_accuracy_cost(accuracy_cost: Any) -> dict[str, Table]:
    """Tables: seconds and errors of every tool on the same held-out protocols, and the fastest tool for a wanted error.

    `make docs-numbers` also writes the second table into docs/cost.md. The tables read the measurement of
    `experiments.measurements.accuracy_cost`.
    """
    content = accuracy_cost
    paper = ", ".join(f"{name} {number(seconds)} s" for name, seconds in paper_seconds().items())
    about = {"protocols": content["protocols"], "host": content["host"], "left_out": left_out(content, LACKING)}
    truth = {"target": number(content["truth_target"]), "refined": _refined(content)}
    words = caption("accuracy-cost", paper=paper, **about, **truth)
    return {
        "accuracy-cost": Table.of(COLUMNS, content["tools"], words),
        "fastest-tool": Table(CHOICES, choices(content["tools"]), caption("fastest-tool", **about)),
    }

"""What trainings and other software cost: amortisation, core minutes of training, and peers."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterMathtext, LogLocator, NullLocator

from bem.plots import COLOURS
from paper_figures.style import drawing, models_style
from paper_figures.style.drawing import KINDS
from paper_figures.style.models_style import REFERENCE, color
from paper_figures.style.writing import Table, caption, left_out, number, percent

QUERIES = np.geomspace(1.0, 1e8, 400)
LINES = {
    "solver, draft": (COLOURS["draft"], "-"),
    "solver, standard": (drawing.BLACK, "-"),
    "solver, reference": (drawing.BLACK, ":"),
    f"{REFERENCE}, Keras call": (color(REFERENCE), ":"),
    f"{REFERENCE}, ONNX single": (color(REFERENCE), "--"),
    f"{REFERENCE}, ONNX batch": (color(REFERENCE), "-"),
    "paper's solver": (drawing.PAPER, "-"),
    "paper's surrogate": (drawing.PAPER, "--"),
}


def totals(line: dict[str, Any]) -> np.ndarray:
    """Core hours for each number in `QUERIES`, of the same shape."""
    return (line["fixed_seconds"] + QUERIES * line["query_seconds"]) / 3600.0


def figure_amortisation(amortisation: Any) -> dict[str, Figure | Table]:
    """Figure and table: core time of data set, training and queries by the number of queries, and break-even numbers.

    The figure reads the result of `experiments.trainings.amortisation`.
    """
    lines = {line["name"]: line for line in amortisation["lines"]}
    drawn = drawing.figure(height=3.0)
    axes = drawn.subplots()
    for name, (shade, style) in LINES.items():
        if name in lines:
            axes.loglog(QUERIES, totals(lines[name]), color=shade, linestyle=style, label=name)
    for one in amortisation["break_even"]:
        if one["surrogate"] in LINES and one["solver"] in LINES and one["queries"]:
            at = one["queries"]
            height = (lines[one["solver"]]["query_seconds"] * at) / 3600.0
            edge = {"markersize": 4, "markeredgecolor": "white", "markeredgewidth": 0.5}
            axes.plot(at, height, "o", color=LINES[one["surrogate"]][0], zorder=4, **edge)
    size = amortisation["data_set_trajectories"]
    axes.axvline(size, color="0.7", linewidth=0.7, zorder=0)
    drawing.beside(axes, size, "size of the data set", height=1.0, shift=-2, rotation=90, color="0.4")
    axes.set(xlabel="queries", ylabel="core time in all (h)", xlim=(1, 1e8))
    axes.set_ylim(bottom=1e-5)
    drawn.legend(loc="outside right upper")
    said = {
        "missing": "Not published yet",
        "unmeasured": "Published but not measured",
        "retrained": "Retrained since the measurement",
        "outdated": "Trained differently from those compared",
    }
    errors = {name: percent(line["errors"]["force"]["median"]) for name, line in lines.items() if line.get("errors")}
    rows = [
        [
            *(word for name in (one["surrogate"], one["solver"]) for word in (name, errors.get(name, "-"))),
            "never" if one["queries"] is None else number(one["queries"]),
        ]
        for one in amortisation["break_even"]
    ]
    minutes = number(amortisation["data_set_seconds"] / 60.0)
    table = Table(
        ["Surrogate", "Its force error (%)", "Instead of", "Its force error (%)", "Break-even (queries)"],
        rows,
        caption("amortisation", minutes=minutes, left_out=left_out(amortisation, said)),
    )
    return {"figure-amortisation": drawn, "amortisation": table}


LEGIBLE = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}
"""The background of words that may lie on a curve."""
GREY = {"color": "0.65", "linewidth": 0.7}


def figure_training_cost(training_cost: Any) -> Figure:
    """Figure: error against core minutes of training.

    Curves are validation errors. Held-out errors, measured once at the end of a training, are marked at its core
    minutes. The figure reads the result of `experiments.trainings.training_cost`; a line above it names the trainings
    that are not published yet.

    The curves of the other architectures are grey and behind that of the reference model; the paper's error is a line.
    """
    drawn = drawing.figure(width=drawing.COLUMN, height=3.0)
    axes, content = drawn.subplots(), training_cost
    for model in sorted(content["models"], key=lambda one: one["name"] == REFERENCE):
        history = model["history"]
        first = model["name"] == REFERENCE
        style = {"color": models_style.color(REFERENCE), "linewidth": 1.4} if first else GREY
        label = f"{REFERENCE}, validation so far" if first else "other architectures, validation so far"
        axes.loglog(history["core_minutes"], history["best_mse"], label=label, **style)
    references = [model for model in content["models"] if model["name"] == REFERENCE]
    longest_left = max((run["core_minutes"] for run in references), default=float("inf"))
    for run in [*references, *content["beside"]]:
        at = (run["core_minutes"], run["test_mse"])
        axes.loglog(*at, label="held-out, end of a run", zorder=4, **models_style.marker(REFERENCE))
        words = run["name"].removeprefix(REFERENCE).replace("-paper", "-paper's recipe").replace("-", " ").strip()
        # Names of trainings that took no longer than the reference are to the left, the others to the right.
        shift, side = (-5, "right") if words and run["core_minutes"] <= longest_left else (5, "left")
        look = {"ha": side, "va": "center", "bbox": LEGIBLE, "zorder": 3.5}
        drawing.note(axes, words or f"{run['epochs']} epochs", at, (shift, 0), **look)
    axes.axhline(content["paper_mse"], color=drawing.PAPER, linewidth=0.8, linestyle="--", label="paper's held-out")
    reached = content["minutes_to_paper_mse"]
    if reached is not None:
        axes.axvline(reached, color=models_style.color(REFERENCE), linewidth=0.6, linestyle=":", zorder=1)
        text = f"{reached:.2g} core-minutes to\nthe paper's error"
        drawing.beside(axes, reached, text, height=0.97, shift=4, bbox=LEGIBLE)
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    frame = {"frameon": True, "framealpha": 1.0, "edgecolor": "none"}
    axes.legend(unique.values(), unique.keys(), loc="lower left", **frame)
    low, high = axes.get_ylim()
    axes.set_xlim(right=4.0 * axes.get_xlim()[1])
    axes.set(xlabel="training (core-minutes)", ylabel="MSE of the scaled force", ylim=(low / 60.0, high))
    if absent := [*training_cost["missing"], *training_cost["outdated"]]:
        drawn.suptitle(f"not published yet: {', '.join(absent)}", color="0.4")
    return drawn


STYLES = {
    **{kind: KINDS[kind] for kind in ("solver", "paper's discretisation", "closed form")},
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
        resolved = [place for place, error in enumerate(errors) if error > LEAST]
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


def figure_peers(peers: Any) -> Figure:
    """Figure: error against processor seconds on the same elastic sphere, for the solver and other software.

    There is one panel for each problem. Lines join the settings of a tool, from coarse to fine; closed forms are named.
    An error below `LEAST` is drawn there, with an arrow. The figure reads the measurement of
    `experiments.measurements.peers`.
    """
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


PROBLEMS = {"tabor 1": "Tension, Tabor 1", "tabor 3": "Tension, Tabor 3", "Hertz": "Compression, no adhesion"}
TOOLS = ("closed form", "solver", "paper's discretisation", "Adhesion", "tamaas")


def table_peers(peers: Any) -> Table:
    """Table: seconds and errors on the same elastic sphere, for the solver and other software.

    `make docs-numbers` also writes the table into docs/cost.md. It reads the measurement of
    `experiments.measurements.peers`.
    """
    found: dict[tuple[str, str], dict[str, str]] = {}
    for run in peers["runs"]:
        cell = f"{number(100.0 * run['error'], 2)} % in {number(run['seconds'], 2)} s"
        found.setdefault((run["tool"], run["setting"]), {})[run["problem"]] = cell
    sizes = {key: int(size) if (size := key[1].split()[0]).isdigit() else 0 for key in found}
    ordered = sorted(found, key=lambda key: (TOOLS.index(key[0]), sizes[key]))
    packages = ", ".join(f"{name} {version}" for name, version in peers["packages"].items())
    return Table(
        ["Tool", "Setting", *PROBLEMS.values()],
        [[*key, *(found[key].get(problem, "-") for problem in PROBLEMS)] for key in ordered],
        caption("peers", start=number(peers["start"]), packages=packages, host=peers["host"]),
    )


def peers_text(peers: Any) -> str:
    """The table for docs/cost.md."""
    return table_peers(peers).page()

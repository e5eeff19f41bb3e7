"""Figure: the posterior of three parameters from one noisy force curve, with a surrogate and with the solver.

`page_text` is the table of docs/surrogate-models.md.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem._support.wording import markdown_table
from bem.plots import COLOURS, FORCE_LABEL
from paper_figures.style import drawing
from paper_figures.style.writing import number

LABELS = {
    "tabor": r"Tabor parameter $\mu$",
    "modulus_ratio": "modulus ratio $k$",
    "retardation_time": "retardation time (s)",
}
WORDS = {"tabor": "Tabor parameter", "modulus_ratio": "Modulus ratio", "retardation_time": "Retardation time (s)"}
STYLES = {
    "surrogate": {"color": COLOURS["fast"], "linewidth": 1.4},
    "surrogate, its error ignored": {"color": drawing.ORANGE, "linewidth": 1.0, "linestyle": "--"},
    "solver": {"color": drawing.BLACK, "linewidth": 0.9},
}
LEVELS = (0.95, 0.68)


def draw_density(axes: Axes, content: dict[str, Any], index: int) -> None:
    """Densities of one parameter, and its true value."""
    for tool, posterior in content["posteriors"].items():
        found = posterior["densities"][index]
        axes.stairs(found["density"], found["edges"], label=tool, **STYLES[tool])
    axes.axvline(content["true"][index], color=drawing.RED, linestyle=":", label="true")
    axes.set(xlabel=LABELS[content["parameters"][index]], yticks=[], ylim=(0.0, None))


def levels_of(density: np.ndarray) -> list[float]:
    """Heights of a histogram above which `LEVELS` of it lie, rising."""
    ordered = np.sort(density.ravel())[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    return [float(ordered[np.searchsorted(held, level)]) for level in LEVELS]


def draw_pair(axes: Axes, content: dict[str, Any], pair: dict[str, Any]) -> None:
    """Regions of 68 and 95 % of the surrogate's posterior, samples of the solver's, and the true values."""
    x, y = (0.5 * (np.array(pair[name][1:]) + pair[name][:-1]) for name in "xy")
    density = np.array(pair["density"]).T
    axes.contourf(x, y, density, [*levels_of(density), np.inf], colors=drawing.tints(COLOURS["fast"], 3)[:2])
    first, second = pair["parameters"]
    solver = np.array(content["solver_shown"])
    axes.plot(solver[:, first], solver[:, second], ".", color=drawing.BLACK, markersize=1.2)
    axes.plot(content["true"][first], content["true"][second], "+", color=drawing.RED, markersize=9.0)
    axes.set(xlabel=LABELS[content["parameters"][first]], ylabel=LABELS[content["parameters"][second]])


def compose(inverse_problem: Any) -> Figure:
    """Draw the figure."""
    drawn, panels = drawing.panels(2, 3, height=4.4)
    for index, axes in enumerate(panels[:3]):
        draw_density(axes, inverse_problem, index)
    panels[0].set_ylabel("posterior density")
    axes, curve = panels[3], inverse_problem["curve"]
    axes.plot(curve["time"], curve["measured"], ".", color="0.6", markersize=2.5, label="measured")
    axes.plot(curve["time"], curve["mean"], color=drawing.BLACK, linewidth=1.0, label="at the mean")
    drawing.zero_line(axes)
    axes.set(xlabel="time (s)", ylabel=FORCE_LABEL)
    axes.legend(loc="upper left")
    for axes, pair in zip(panels[4:], inverse_problem["posteriors"]["surrogate"]["pairs"], strict=True):
        draw_pair(axes, inverse_problem, pair)
    handles, labels = panels[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return drawn


def page_text(inverse_problem: Any) -> str:
    """The table for a page, one row for the truth and one for each posterior, and how it was made."""
    seconds, solver = inverse_problem["seconds"], inverse_problem["posteriors"]["solver"]["summary"]
    rows = [["true", *(number(value, 4) for value in inverse_problem["true"]), "", "", "", ""]]
    for tool, posterior in inverse_problem["posteriors"].items():
        summary = posterior["summary"]
        cells = [
            f"{number(mean, 4)} ({number(low, 4)} to {number(high, 4)})"
            for mean, low, high in zip(summary["mean"], summary["low"], summary["high"], strict=True)
        ]
        away = max(abs(a - b) / sd for a, b, sd in zip(summary["mean"], solver["mean"], solver["sd"], strict=True))
        counts = [f"{posterior['samples']:,}", f"{posterior['effective']:,.0f}"]
        # One pass over the samples gives both posteriors of the surrogate.
        price = 1e3 * seconds[tool.partition(",")[0]]
        rows.append([tool, *cells, "-" if tool == "solver" else f"{away:.2f}", *counts, f"{price:.3f}"])
    head = ["Posterior of", *(WORDS[name] for name in inverse_problem["parameters"])]
    head += ["Largest distance from the solver's mean (sd)", "Samples", "Effective samples", "Time of a sample (ms)"]
    return (
        f"{markdown_table(head, rows, 'lrrrrrrr')}\n\n"
        f"Means and 95 % intervals. A sample of the solver costs {seconds['solver'] / seconds['surrogate']:.0f} times "
        f"as much. Before, search and {inverse_problem['calibration']} simulations for the surrogate's error took "
        f"{inverse_problem['searched']:.0f} s of processor time. Measured by `{inverse_problem['command']}` "
        f"on {inverse_problem['host']}; the process had {inverse_problem['processor_share']:.0%} of its core."
    )

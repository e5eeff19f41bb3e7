"""Style of the figures of cost: one colour and marker for each tool, and the paper's own seconds."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from bem.plots import COLOURS
from paper_figures.style import drawing

KINDS = {
    "solver": {"color": drawing.BLACK, "marker": "o"},
    "paper's discretisation": {"color": drawing.PAPER, "marker": "s"},
    "closed form": {"color": COLOURS["closed form"], "marker": "X"},
    "fast": {"color": COLOURS["fast"], "marker": "P"},
    "accurate": {"color": COLOURS["accurate"], "marker": "P"},
    "Keras call": {"color": drawing.BLACK, "marker": "v"},
    "ONNX single": {"color": drawing.BLACK, "marker": "^"},
    "ONNX batch": {"color": drawing.BLACK, "marker": "D"},
}
"""A surrogate has the colour of its family in place of that of the way it is called."""


FORCE_ERROR = r"force error, mean $|\Delta\hat P|$ / range (%)"
"""Axis label of `experiments.measurements.harness.force_error` in percent."""


def kind_of(tool: dict[str, Any]) -> str:
    """Key of `KINDS` of a tool; that of a surrogate of the paper is the way it is called."""
    return tool["way"] if tool["kind"] == "surrogate" else tool["kind"]


def paper_seconds() -> dict[str, float]:
    """Mean seconds of one trajectory in the paper, by its solver and by its surrogate."""
    paper = drawing.paper_values("dataset")
    return {
        "paper's solver (mean)": 3600.0 * paper["cpu_hours"] / paper["trajectories"],
        "paper's surrogate": drawing.paper_values("cost")["surrogate_seconds"],
    }


def mark_paper(axes: Axes, *, height: float = 0.98) -> None:
    """Draw labelled vertical lines at the paper's seconds."""
    for name, seconds in paper_seconds().items():
        axes.axvline(seconds, color=drawing.PAPER, linewidth=0.8, linestyle=":")
        drawing.beside(axes, seconds, name, height=height, shift=2, rotation=90, color=drawing.PAPER)


def sparse_ticks(axes: Axes) -> None:
    """Set ticks at 1, 2 and 5 on a logarithmic x axis of less than two decades, which has few powers of ten."""
    low, high = axes.get_xlim()
    if high < 100.0 * low:
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())

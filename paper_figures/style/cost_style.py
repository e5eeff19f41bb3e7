"""Style of the figures of cost: one colour and marker for each tool, and the paper's own seconds."""

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
}


def paper_seconds() -> dict[str, float]:
    """Mean seconds of one trajectory in the paper, by its solver and by its surrogate."""
    paper = drawing.paper_values("dataset")
    return {
        "paper's solver (mean)": 3600.0 * paper["cpu_hours"] / paper["trajectories"],
        "paper's surrogate": drawing.paper_values("cost")["surrogate_seconds"],
    }


def sparse_ticks(axes: Axes) -> None:
    """Set ticks at 1, 2 and 5 on a logarithmic x axis of less than two decades, which has few powers of ten."""
    low, high = axes.get_xlim()
    if high < 100.0 * low:
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())

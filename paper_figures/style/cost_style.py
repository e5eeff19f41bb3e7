"""Style of the figures of cost: one colour and marker for each tool, and the paper's own seconds."""

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

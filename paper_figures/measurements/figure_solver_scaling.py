"""Figure: growth of the solver's cost with nodes and with steps, measured by `experiments.solver.cost_growth`."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter, ScalarFormatter

from paper_figures.style import drawing

BOUND_IN_NODES, BOUND_IN_STEPS = 2.2, 1.0


def draw(axes: Axes, x: np.ndarray, y: np.ndarray, *, fitted: float, bound: float, ticks: list[float]) -> None:
    """Draw the measured points, their fitted power, and the power `bound` through the first point."""
    order = np.argsort(x)
    x, y = x[order], y[order]
    through = np.exp(np.mean(np.log(y) - fitted * np.log(x)))
    axes.loglog(x, through * x**fitted, color=drawing.BLUE, label=f"fitted power {fitted:.2f}")
    axes.loglog(x, y[0] * (x / x[0]) ** bound, "--", color="0.5", label=f"power {bound:g}")
    axes.loglog(x, y, "o", color=drawing.BLUE, markersize=4, label="measured")
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(ScalarFormatter())
        axis.set_minor_formatter(NullFormatter())
    axes.legend()


def columns(curve: dict[str, Any], name: str) -> tuple[np.ndarray, np.ndarray]:
    """One quantity and the median seconds of all points of a curve, each of shape (points,)."""
    points = curve["points"]
    return np.array([point[name] for point in points]), np.array([point["seconds"]["median"] for point in points])


def compose(cost_growth: Any) -> Figure:
    """Draw the figure."""
    solver = cost_growth["solver"]
    drawn = drawing.figure(height=2.8)
    left, right = drawn.subplots(1, 2)
    x, seconds = columns(solver["nodes"], "nodes")
    fitted = solver["nodes"]["exponent"]
    draw(left, x, 1e6 * seconds, fitted=fitted, bound=BOUND_IN_NODES, ticks=[50, 100, 200, 400])
    left.set(xlabel="mean number of nodes", ylabel=r"processor time per step ($\mu$s)")
    x, seconds = columns(solver["steps"], "steps")
    fitted = solver["steps"]["exponent"]
    draw(right, x, 1e3 * seconds, fitted=fitted, bound=BOUND_IN_STEPS, ticks=[100, 200, 500, 1000])
    right.set(xlabel="steps", ylabel="processor time (ms)")
    drawing.letters((left, right))
    return drawn

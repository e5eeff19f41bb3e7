"""Figure: what uniform and physical measurement steps hold of the pull-off force.

Left, both on a narrow peak; right, the share of hidden protocols whose highest step is further from the pull-off force
than an error.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem._support.wording import markdown_table
from paper_figures.style import drawing

READINGS = {
    "pull_off": "Highest step",
    "pull_off_parabola": "Top of a parabola",
    "hysteresis_trapezoids": "Hysteresis, trapezoids",
    "hysteresis_cubics": "Hysteresis, monotone cubics",
}
LEAST = 1e-5
"""Errors below are drawn there."""


def draw_example(axes: Axes, example: dict[str, Any]) -> None:
    """The peak, and the steps on it."""
    depth, force = np.array(example["indentation"]), np.array(example["force"])
    axes.plot(depth, force, color=drawing.BLACK, linewidth=0.8, label="solver")
    for name, steps in example["steps"].items():
        look = {"linestyle": "", "markersize": 2.5, **drawing.STEPS[name]}
        axes.plot(steps["indentation"], steps["force"], label=name, **look)
    top = int(force.argmax())
    axes.set(
        xlabel=drawing.INDENTATION,
        ylabel=drawing.FORCE,
        xlim=(depth[0] + 0.3, depth[top] - 3.0 * (depth[0] - depth[top])),
        ylim=(-0.4 * force[top], 1.2 * force[top]),
    )
    axes.legend(loc="upper right")


def draw_errors(axes: Axes, kinds: dict[str, Any]) -> None:
    """How often the error exceeds a size."""
    for name, record in kinds.items():
        errors = np.maximum(np.sort(record["pull_off_errors"])[::-1], LEAST)
        share = np.arange(1, errors.size + 1) / errors.size
        points = "+".join(map(str, record["counts"]))
        axes.loglog(100.0 * errors, share, color=drawing.STEPS[name]["color"], label=f"{name}, {points}")
    for share in (0.1, 0.01):
        axes.axhline(share, color="0.7", linewidth=0.5, linestyle=":")
    axes.set(xlabel="error of the highest step (%)", ylabel="share of protocols above", ylim=(1e-3, 1.0))
    axes.legend(loc="lower left")


def page_text(measurement_floor: Any) -> str:
    """A table of the errors for a page, in percent."""
    rows = []
    for name, record in measurement_floor["kinds"].items():
        cells = [record[reading] for reading in READINGS]
        texts = [", ".join(f"{cell[level]:.2g}" for level in ("p50", "p90", "p99")) for cell in cells]
        rows.append([name, " + ".join(map(str, record["counts"])), *texts])
    table = markdown_table(["Steps", "Points", *READINGS.values()], rows, "llrrrr")
    return f"{table}\n\nMeasured by `{measurement_floor['command']}`."


def compose(measurement_floor: Any) -> Figure:
    """Draw the figure."""
    drawn, (left, right) = drawing.panels(1, 2, height=2.6)
    draw_example(left, measurement_floor["example"])
    draw_errors(right, measurement_floor["kinds"])
    return drawn

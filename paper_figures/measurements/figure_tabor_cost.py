"""Figure: seconds against error at Tabor parameters of 3, 30 and 300.

Markers are medians over random cycles, of the method that answers most of them; thin lines reach to the largest error.
They are open where the error is the accuracy that the trajectories state. The figure reads the measurement of
`experiments.measurements.tabor_cost`.
"""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing

MARKERS = {"boundary elements": "o", "sharp crack": "D"}
COLOURS = {3.0: drawing.SKY, 30.0: drawing.BLUE, 300.0: drawing.BLACK}
LABELS = (
    (3.0, -1, "$\\mu=3$\nboundary elements", (6, 0), {"ha": "left", "va": "center"}),
    (30.0, -1, "$\\mu=30$\nboundary elements", (-8, 0), {"ha": "right", "va": "center"}),
    (30.0, 0, "sharp crack", (-6, 4), {"ha": "right", "va": "bottom"}),
    (300.0, 0, "$\\mu=300$, accuracy\nas stated", (0, -10), {"ha": "left", "va": "top"}),
)
"""Words beside the first or the last target of a Tabor parameter, their shift in points and their alignment."""


def method_of(row: dict[str, Any]) -> str:
    """The method that answers most of the cycles of a row."""
    return max(row["methods"], key=row["methods"].__getitem__)


def draw_tabor(axes: Axes, rows: Sequence[dict[str, Any]], color: str) -> None:
    """Draw the rows of one Tabor parameter, a line and a marker for each target."""
    places = [(row["seconds"]["median"], 100.0 * row["errors"]["median"]) for row in rows]
    axes.plot(*zip(*places, strict=True), color=color, linewidth=1.0)
    for row, (seconds, error) in zip(rows, places, strict=True):
        axes.plot([seconds] * 2, [error, 100.0 * row["errors"]["largest"]], color=color, linewidth=0.5)
        face = color if row["measured"] else "white"
        axes.plot(seconds, error, MARKERS[method_of(row)], color=color, markerfacecolor=face, markersize=4.0)


def compose(tabor_cost: Any) -> Figure:
    """Draw the figure."""
    drawn = drawing.figure(width=drawing.COLUMN, height=2.6)
    axes = drawn.subplots()
    for tabor, color in COLOURS.items():
        draw_tabor(axes, [row for row in tabor_cost["rows"] if row["tabor"] == tabor], color)
    for tabor, index, text, shift, style in LABELS:
        row = [row for row in tabor_cost["rows"] if row["tabor"] == tabor][index]
        at = (row["seconds"]["median"], 100.0 * row["errors"]["median"])
        drawing.note(axes, text, at, shift, linespacing=1.3, **style)
    axes.set(xscale="log", yscale="log", ylim=(1e-4, 3.0))
    axes.set(xlabel="processor time of a trajectory (s)", ylabel="error of the pull-off force (%)")
    return drawn

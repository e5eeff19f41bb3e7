"""Figure: seconds against error at Tabor parameters of 3, 30 and 300.

Markers are medians over random cycles, of the method that answers most of them; thin lines reach to the largest error.
They are open where the error is the accuracy that the trajectories state. The figure reads the measurement of
`experiments.measurements.tabor_cost`.
"""

from typing import Any

from matplotlib.figure import Figure

from paper_figures.style import drawing

MARKERS = {"boundary elements": "o", "sharp crack": "D"}
COLOURS = {3.0: drawing.SKY, 30.0: drawing.BLUE, 300.0: drawing.BLACK}


def compose(tabor_cost: Any) -> Figure:
    """Draw the figure."""
    drawn = drawing.figure(width=drawing.COLUMN, height=2.9)
    axes = drawn.subplots()
    for tabor, color in COLOURS.items():
        rows = [row for row in tabor_cost["rows"] if row["tabor"] == tabor]
        places = [(row["seconds"]["median"], 100.0 * row["errors"]["median"]) for row in rows]
        axes.plot(*zip(*places, strict=True), color=color, linewidth=1.0, label=rf"$\mu={tabor:g}$")
        for row, (seconds, error) in zip(rows, places, strict=True):
            axes.plot([seconds] * 2, [error, 100.0 * row["errors"]["largest"]], color=color, linewidth=0.5)
            marker = MARKERS[max(row["methods"], key=row["methods"].__getitem__)]
            face = color if row["measured"] else "white"
            axes.plot(seconds, error, marker, color=color, markerfacecolor=face, markersize=4.0)
    for method, marker in MARKERS.items():
        axes.plot([], [], marker, color="0.4", markersize=4.0, label=method)
    axes.plot([], [], "D", color="0.4", markerfacecolor="white", markersize=4.0, label="accuracy as stated")
    axes.set(xscale="log", yscale="log", ylim=(1e-4, 5.0))
    axes.set(xlabel="processor time of a trajectory (s)", ylabel="error of the pull-off force (%)")
    drawn.legend(loc="outside lower center", ncols=3, columnspacing=1.0, handlelength=1.4)
    return drawn

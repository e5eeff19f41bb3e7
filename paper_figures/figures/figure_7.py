"""Figure 7: distributions of the held-out errors of pull-off force and hysteresis, and their relation.

Bars are stacked by quartile of the force MSE and show shares of all held-out trajectories. The first bin also holds the
smaller errors. The model is the one trained by the paper's recipe; a line shows the distribution for `swift`.
"""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter

from paper_figures.style import drawing, models_style

QUARTILES = ("Q1", "Q2", "Q3", "Q4")
COLORS = [to_hex(color) for color in colormaps["viridis"](np.linspace(0.9, 0.0, len(QUARTILES)))]
LOWEST, BINS_PER_DECADE = 1e-2, 6
BARS = 0.7
"""Share of the panel's height that bars and lines occupy; the legend is above them."""
OUTLINE = [withStroke(linewidth=2.1, foreground="white")]
"""Of lines that cross dark bars."""
LABELS = {
    "pull_off_force_percent": "pull-off force error (%)",
    "hysteresis_percent": "hysteresis error (%)",
    "nmae_percent": "force NMAE (%)",
}


def draw_distribution(axes: Axes, statistics: dict[str, Any], column: str, ours: dict[str, Any] | None) -> None:
    """Stacked shares in logarithmic bins, with median and 90th percentile marked, and the outline of those by ours."""
    values = np.array(statistics["per_trajectory"][column])
    quartile = np.array(statistics["per_trajectory"]["quartile"])
    top = 10.0 ** np.ceil(np.log10(max(values.max(), 10.0)))
    decades = np.log10(top / LOWEST)
    bins = np.geomspace(LOWEST, top, round(BINS_PER_DECADE * decades) + 1)
    parts = [np.clip(values[quartile == q], LOWEST, None) for q in range(4)]
    weights = [np.full(len(errors), 100.0 / len(values)) for errors in parts]
    sums, _, _ = axes.hist(parts, bins=bins, weights=weights, stacked=True, color=COLORS)
    highest = sums[-1].max()
    if ours:
        by_ours = np.clip(ours["per_trajectory"][column], LOWEST, top)
        shares, _ = np.histogram(by_ours, bins, weights=np.full(len(by_ours), 100.0 / len(by_ours)))
        label = f"swift, median {ours['overall'][column]['median']:.2g} %"
        highest = max(highest, shares.max())
        axes.stairs(shares, bins, color="0.35", linewidth=0.9, label=label, path_effects=OUTLINE)
    axes.set(xscale="log", xlabel=LABELS[column], ylabel="share of trajectories (%)")
    drawing.log_labels(axes.xaxis)
    mark_lowest(axes.xaxis)
    overall = statistics["overall"][column]
    for name, style, text in (("median", "-.", "median"), ("p90", "--", "90th percentile")):
        label = f"{text} {overall[name]:.2g} %"
        look = {"color": drawing.BLACK, "linestyle": style, "linewidth": 0.9, "path_effects": OUTLINE}
        axes.axvline(overall[name], ymax=BARS, label=label, **look)
    axes.set_ylim(0.0, highest / BARS)
    axes.legend(loc="upper left")


def draw_relation(axes: Axes, statistics: dict[str, Any], x: str, y: str, correlation: float) -> None:
    """Scatter of two errors, one point for each trajectory, coloured by quartile."""
    columns = statistics["per_trajectory"]
    quartile = np.array(columns["quartile"])
    across, up = (np.clip(np.array(columns[name]), LOWEST, None) for name in (x, y))
    look = {"markersize": 3.0, "markeredgewidth": 0, "alpha": 0.75, "rasterized": True}
    for q, (name, color) in enumerate(zip(QUARTILES, COLORS, strict=True)):
        rows = quartile == q
        axes.plot(across[rows], up[rows], ".", color=color, label=name, **look)
    axes.set(xscale="log", yscale="log", xlabel=LABELS[x], ylabel=LABELS[y])
    axes.set_title(f"rank correlation {drawing.written(correlation, '.2f')}", loc="right")
    for axis, values in ((axes.xaxis, across), (axes.yaxis, up)):
        drawing.log_labels(axis)
        if values.min() <= LOWEST:
            mark_lowest(axis)


def mark_lowest(axis: Axis) -> None:
    """Say at the lowest tick that smaller errors are drawn there too."""
    usual = axis.get_major_formatter()
    axis.set_major_formatter(
        FuncFormatter(lambda value, at: ("≤" if value <= 1.01 * LOWEST else "") + usual(value, at))
    )


def compose(error_statistics: Any) -> Figure:
    """Draw figure 7."""
    by_recipe = models_style.recipes(error_statistics)
    (recipe, shown), ours = next(iter(by_recipe.items())), by_recipe.get("swift")
    ours = ours if recipe == "paper" else None
    drawn, panels = drawing.panels(2, 2, height=5.0)
    force, loop, waveform = LABELS
    draw_distribution(panels[0], shown, force, ours)
    draw_distribution(panels[1], shown, loop, ours)
    draw_relation(panels[2], shown, force, loop, shown["spearman"]["pull_off_and_hysteresis"])
    draw_relation(panels[3], shown, force, waveform, shown["spearman"]["pull_off_and_nmae"])
    marks = [Patch(color=color, label=name) for name, color in zip(QUARTILES, COLORS, strict=True)]
    title = f"{models_style.label(error_statistics['config']['model'], recipe)}; quartile of the force MSE"
    drawn.legend(handles=marks, loc="outside upper center", ncols=4, title=title)
    return drawn

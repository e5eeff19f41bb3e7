"""FMS transfer: one trajectory predicted at other numbers of measurement steps, and errors over the held-out set.

The paper shows one trajectory only; the second panel is additional.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style

COLORS = (drawing.ORANGE, drawing.BLUE, drawing.VIOLET, drawing.GREEN, drawing.SKY, drawing.RED)
"""Of the numbers of measurement steps, in their order."""


def draw_sample(axes: Axes, sample: dict[str, Any], model: str) -> None:
    """Draw the solver's force as a line, and each prediction as the model's markers in its own colour."""
    drawing.zero_line(axes)
    axes.plot(sample["native"]["indentation"], sample["native"]["force"], color=drawing.BLACK, label="solver")
    for (total, prediction), color in zip(sample["predictions"].items(), COLORS, strict=False):
        look = models_style.step_marker(model) | {"markersize": 4.2, "color": color, "markeredgecolor": color}
        axes.plot(prediction["indentation"], prediction["predicted"], label=f"$N = {total}$", **look)
    axes.set(xlabel=drawing.INDENTATION, ylabel=drawing.FORCE)
    axes.set_title(f"sample ({sample['sample']})", loc="right")
    axes.legend(loc="best")


def draw_test_set(axes: Axes, test_set: dict[str, Any], color: str) -> None:
    """Draw median and 90th percentile of the force NMAE over the held-out set, for each number of steps."""
    totals = list(test_set["errors"])
    places = np.arange(len(totals))
    for shift, (name, text, shade) in enumerate((("median", "median", 1.0), ("p90", "90th percentile", 0.45))):
        heights = [test_set["errors"][total]["nmae_percent"][name] for total in totals]
        bars = axes.bar(places + 0.38 * (shift - 0.5), heights, 0.36, color=color, alpha=shade, label=text)
        axes.bar_label(bars, labels=[f"{height:#.2g}".rstrip(".") for height in heights], padding=1)
    axes.set_xticks(places, totals)
    axes.set(xlabel="measurement steps $N$", ylabel="force NMAE (%)")
    axes.set_title(f"{test_set['trajectories']} held-out trajectories", loc="right")
    axes.margins(y=0.2)
    axes.legend(loc="upper center")


def compose(fms_transfer: Any) -> Figure:
    """Draw both panels."""
    drawn, (first, second) = drawing.panels(1, 2, height=2.7)
    model = fms_transfer["config"]["model"]
    recipe, transfer = next(iter(models_style.recipes(fms_transfer).items()))
    draw_sample(first, transfer["sample"], model)
    draw_test_set(second, transfer["test_set"], models_style.color(model))
    drawn.suptitle(models_style.label(model, recipe), fontsize="medium")
    return drawn

"""FMS transfer: one trajectory predicted at other numbers of measurement steps, and errors over the held-out set.

The paper shows one trajectory only; the last panel is additional.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style


def draw_sample(axes: Axes, sample: dict[str, Any], total: str, model: str) -> None:
    """Draw the solver's force as a line, and the prediction on one number of steps as the model's markers."""
    drawing.zero_line(axes)
    axes.plot(sample["native"]["indentation"], sample["native"]["force"], color=drawing.BLACK, label="solver")
    prediction, look = sample["predictions"][total], models_style.step_marker(model)
    axes.plot(prediction["indentation"], prediction["predicted"], label=f"$N = {total}$", **look)
    axes.set(xlabel=drawing.INDENTATION)
    axes.set_title(f"$N={total}$", loc="right")


def draw_test_set(axes: Axes, test_set: dict[str, Any], color: str) -> None:
    """Draw median and 90th percentile of the force NMAE over the held-out set, for each number of steps."""
    totals = list(test_set["errors"])
    places = np.arange(len(totals))
    for shift, (name, text, shade) in enumerate((("median", "median", 1.0), ("p90", "90th percentile", 0.45))):
        widths = [test_set["errors"][total]["nmae_percent"][name] for total in totals]
        bars = axes.barh(places + 0.38 * (shift - 0.5), widths, 0.36, color=color, alpha=shade, label=text)
        numbers = [f"{width:#.2g}".rstrip(".") for width in widths]
        # The bars of the second number, for which the model was trained, are the shortest.
        axes.bar_label(
            bars, [f"{text} {number}" if place == 1 else number for place, number in enumerate(numbers)], padding=2
        )
    axes.set_yticks(places, [f"$N={total}$" for total in totals])
    axes.tick_params(axis="y", length=0)
    axes.set(xlabel="force NMAE (%)", ylim=(len(totals) - 0.5, -0.5))
    axes.set_title(f"{test_set['trajectories']} trajectories", loc="right")
    axes.margins(x=0.15)


def compose(fms_transfer: Any) -> Figure:
    """Draw a panel for each number of steps, and the errors."""
    recipe, transfer = next(iter(models_style.recipes(fms_transfer).items()))
    model, sample = fms_transfer["config"]["model"], transfer["sample"]
    samples = len(sample["predictions"])
    drawn = drawing.figure(height=2.3)
    *first, last = drawn.subplots(1, samples + 1, width_ratios=[1.0] * samples + [1.15])
    drawing.letters([*first, last])
    for axes, total in zip(first, sample["predictions"], strict=True):
        axes.sharey(first[0])
        draw_sample(axes, sample, total, model)
        axes.tick_params(labelleft=axes is first[0])
    first[0].set_ylabel(drawing.FORCE)
    draw_test_set(last, transfer["test_set"], models_style.color(model))
    drawn.suptitle(f"sample ({sample['sample']}): solver (line) and {models_style.label(model, recipe)} (markers)")
    return drawn

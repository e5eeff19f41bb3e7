"""Held-out errors of every seed: points for the trainings, bars for the bootstrap interval over the test set.

Families are side by side, with their conditionings in the order of the paper. Markers and colours are those of all
figures.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from experiments.trainings.ranking import COLUMNS
from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import CONDITIONINGS, PAPER_FAMILIES, paper_names

SHOWN = {
    "test_mse": "held-out MSE",
    "pull_off_percent": "median pull-off error (%)",
    "hysteresis_percent": "median hysteresis error (%)",
}
"""Metrics and their labels, one panel each."""
APART = 0.27
"""Distance between the conditionings of a family; the distance between families is one."""
WIDTH = 0.22
LEAST_SPAN = 6.0
"""Least ratio of the upper to the lower end of an axis."""


def error_of(model: dict[str, Any], metric: str) -> float:
    """An error of a model in `model_comparison`, of the name that it has in `ranking`."""
    column = COLUMNS[metric]
    return model["test"][column]["median"] if "percent" in column else model[column]


def limits(ranking: Any, metric: str, by_recipe: dict[str, Any]) -> tuple[float, float]:
    """Ends of an axis that shows all seeds and intervals of the paper's models, and at least two labels."""
    spreads = [ranking["spread"][name][metric] for name in paper_names() if name in ranking["spread"]]
    ends = [value for spread in spreads for value in spread.values()] or [1.0]
    ends += [error_of(model, metric) for model in by_recipe.values()]
    low, high = min(ends) / 1.2, max(ends) * 1.2
    wider = max(1.0, np.sqrt(LEAST_SPAN * low / high))
    return low / wider, high * wider


def draw_errors(axes: Axes, ranking: Any, metric: str, by_recipe: dict[str, Any]) -> None:
    """Draw seeds and intervals of all models in one panel, and their errors by the paper's recipe."""
    for position, family in enumerate(PAPER_FAMILIES):
        for shift, conditioning in zip((-APART, 0.0, APART), CONDITIONINGS, strict=True):
            name = f"{family}-{conditioning}"
            if name in by_recipe:
                axes.plot(position + shift, error_of(by_recipe[name], metric), **models_style.recipe_marker(name))
            rows, spread = ranking["models"].get(name, []), ranking["spread"].get(name, {}).get(metric)
            if not rows:
                continue
            at = position + shift
            low, high = spread["low"], spread["high"]
            axes.bar(at, high - low, WIDTH, bottom=low, color=models_style.color(name), alpha=0.35, linewidth=0)
            axes.plot([at - 0.5 * WIDTH, at + 0.5 * WIDTH], [spread["median"]] * 2, color="0.2", linewidth=0.7)
            # Side by side, so that equal seeds remain visible.
            across = at + 0.07 * (np.arange(len(rows)) - 0.5 * (len(rows) - 1))
            look = models_style.marker(name) | {"markersize": 0.62 * models_style.SIZES[conditioning]}
            axes.plot(across, [row[metric] for row in rows], label=name, zorder=3, **look)
        if position:
            axes.axvline(position - 0.5, color="0.88", linewidth=0.6, zorder=0)
    axes.set(xlim=(-0.5, len(PAPER_FAMILIES) - 0.5), xticks=range(len(PAPER_FAMILIES)), yscale="log")
    axes.set_xticklabels(PAPER_FAMILIES)
    axes.tick_params(axis="x", length=0, which="both")
    axes.set_ylabel(SHOWN[metric])
    axes.set_ylim(limits(ranking, metric, by_recipe))
    drawing.log_labels(axes.yaxis)


def compose(ranking: Any, model_comparison: Any) -> Figure:
    """Draw the errors by family."""
    by_recipe = models_style.trained_by_paper_recipe(model_comparison)
    drawn, panels = drawing.panels(1, len(SHOWN), height=2.9)
    for axes, metric in zip(panels, SHOWN, strict=True):
        draw_errors(axes, ranking, metric, by_recipe)
    handles = [
        *models_style.conditioning_handles(),
        models_style.recipe_handle(),
        Line2D([], [], color="0.2", linewidth=0.7, label="median over seeds"),
        Patch(
            color="0.5", alpha=0.35, linewidth=0, label=f"{100 * ranking['confidence']:g} % interval over the test set"
        ),
    ]
    drawn.legend(handles=handles, loc="outside upper center", ncols=len(handles), columnspacing=1.4, handlelength=1.4)
    return drawn

"""Held-out errors of every seed, a row for each model: ticks for the trainings, bars for the bootstrap interval.

The models are in the order of their mean squared error, the best above. Colours are those of all figures.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.trainings.ranking import COLUMNS
from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import paper_names

SHOWN = {
    "test_mse": "held-out MSE",
    "pull_off_percent": "median pull-off error (%)",
    "hysteresis_percent": "median hysteresis error (%)",
}
"""Metrics and their labels, one panel each; the first is that of the order."""
HEIGHT = 0.62
"""Height of a bar; the distance between models is one."""
LEAST_SPAN = 6.0
"""Least ratio of the upper to the lower end of an axis."""
THEIRS = {"marker": "o", "markersize": 4.2, "linestyle": "", "color": "white", "markeredgewidth": 0.9, "zorder": 4}
"""Look of the trainings by the paper's recipe."""


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


def ordered(ranking: Any) -> list[str]:
    """The paper's models by the median of their mean squared errors, without seeds in the paper's order at the end."""
    metric, spread = next(iter(SHOWN)), ranking["spread"]
    return sorted(paper_names(), key=lambda name: spread[name][metric]["median"] if name in spread else np.inf)


def draw_errors(axes: Axes, ranking: Any, metric: str, by_recipe: dict[str, Any]) -> None:
    """Draw seeds and intervals of all models in one panel, and their errors by the paper's recipe."""
    for place, name in enumerate(ordered(ranking)):
        color = models_style.color(name)
        if name in by_recipe:
            axes.plot(error_of(by_recipe[name], metric), place, markeredgecolor=color, **THEIRS)
        if not (rows := ranking["models"].get(name, [])):
            continue
        spread = ranking["spread"][name][metric]
        axes.barh(
            place, spread["high"] - spread["low"], HEIGHT, left=spread["low"], color=color, alpha=0.3, linewidth=0
        )
        ticks = {"marker": "|", "markersize": 5.0, "markeredgewidth": 1.1, "linestyle": ""}
        axes.plot([row[metric] for row in rows], [place] * len(rows), color=color, label=name, zorder=3, **ticks)
        if name in by_recipe:
            axes.plot([spread["median"], error_of(by_recipe[name], metric)], [place] * 2, color=color, linewidth=0.5)
    axes.set(xscale="log", xlabel=SHOWN[metric], ylim=(len(paper_names()) - 0.4, -1.5))
    axes.tick_params(axis="y", length=0)
    axes.set_xlim(limits(ranking, metric, by_recipe))
    drawing.log_labels(axes.xaxis)


def write_key(panels: Sequence[Axes], ranking: Any, by_recipe: dict[str, Any]) -> None:
    """Write beside the marks of the first model what they are."""
    first = ordered(ranking)[0]
    share = f"bar: {100 * ranking['confidence']:g} % interval over the test set"
    for axes, metric, text in zip(panels, SHOWN, ("ticks: seeds by swift", "", share), strict=True):
        if text and first in ranking["spread"]:
            drawing.note(axes, text, (ranking["spread"][first][metric]["low"], 0), (0, 6), ha="left", va="bottom")
    if first in by_recipe:
        at = (error_of(by_recipe[first], next(iter(SHOWN))), 0)
        drawing.note(panels[0], "paper’s recipe", at, (5, 0), ha="left", va="center")


def compose(ranking: Any, model_comparison: Any) -> Figure:
    """Draw the errors by model; bold are the names of those that are level with the best of the paper."""
    by_recipe = models_style.trained_by_paper_recipe(model_comparison)
    drawn, panels = drawing.panels(1, len(SHOWN), height=3.5, sharey=True)
    for axes, metric in zip(panels, SHOWN, strict=True):
        draw_errors(axes, ranking, metric, by_recipe)
    write_key(panels, ranking, by_recipe)
    panels[0].set_yticks(range(len(paper_names())), ordered(ranking))
    for label in panels[0].get_yticklabels():
        level = label.get_text() in ranking["claims"]["best_model"]["level"]
        label.set_fontweight("bold" if level else "normal")
    return drawn

"""The errors of every seed, and what they decide of the paper's rankings."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from experiments.trainings.ranking import COLUMNS
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number
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


def error_of(found: dict[str, Any], metric: str) -> float:
    """An error of a model in `model_comparison`, of the name that it has in `ranking`."""
    column = COLUMNS[metric]
    return found["test"][column]["median"] if "percent" in column else found[column]


def limits(ranking: Any, metric: str, by_recipe: dict[str, Any]) -> tuple[float, float]:
    """Ends of an axis that shows all seeds and intervals of the paper's models, and at least two labels."""
    spreads = [ranking["spread"][name][metric] for name in paper_names() if name in ranking["spread"]]
    ends = [value for spread in spreads for value in spread.values()] or [1.0]
    ends += [error_of(found, metric) for found in by_recipe.values()]
    low, high = min(ends) / 1.2, max(ends) * 1.2
    wider = max(1.0, np.sqrt(LEAST_SPAN * low / high))
    return low / wider, high * wider


def draw_errors(axes: Axes, ranking: Any, metric: str, by_recipe: dict[str, Any]) -> None:
    """Draw seeds and intervals of all models in one panel, and their errors by the paper's recipe."""
    for place, family in enumerate(PAPER_FAMILIES):
        for shift, conditioning in zip((-APART, 0.0, APART), CONDITIONINGS, strict=True):
            name = f"{family}-{conditioning}"
            if name in by_recipe:
                axes.plot(place + shift, error_of(by_recipe[name], metric), **models_style.recipe_marker(name))
            rows, spread = ranking["models"].get(name, []), ranking["spread"].get(name, {}).get(metric)
            if not rows:
                continue
            at = place + shift
            low, high = spread["low"], spread["high"]
            axes.bar(at, high - low, WIDTH, bottom=low, color=models_style.color(name), alpha=0.35, linewidth=0)
            axes.plot([at - 0.5 * WIDTH, at + 0.5 * WIDTH], [spread["median"]] * 2, color="0.2", linewidth=0.7)
            # Side by side, so that equal seeds remain visible.
            across = at + 0.07 * (np.arange(len(rows)) - 0.5 * (len(rows) - 1))
            look = models_style.marker(name) | {"markersize": 0.62 * models_style.SIZES[conditioning]}
            axes.plot(across, [row[metric] for row in rows], label=name, zorder=3, **look)
        if place:
            axes.axvline(place - 0.5, color="0.88", linewidth=0.6, zorder=0)
    axes.set(xlim=(-0.5, len(PAPER_FAMILIES) - 0.5), xticks=range(len(PAPER_FAMILIES)), yscale="log")
    axes.set_xticklabels(PAPER_FAMILIES)
    axes.tick_params(axis="x", length=0, which="both")
    axes.set_ylabel(SHOWN[metric])
    axes.set_ylim(limits(ranking, metric, by_recipe))
    drawing.log_labels(axes.yaxis)


def figure_ranking(ranking: Any, model_comparison: Any) -> Figure:
    """Held-out errors of every seed: points for the trainings, bars for the bootstrap interval over the test set.

    Families are side by side, with their conditionings in the order of the paper. Markers and colours are those of all
    figures.
    """
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


METRICS = {
    "test_mse": "MSE",
    "test_mae": "MAE",
    "test_dtw_rmse": "DTW-RMSE",
    "pull_off_percent": "Pull-off, median (%)",
    "hysteresis_percent": "Hysteresis, median (%)",
}
SAYS = {
    "best_model": "best model",
    "second_family": "strongest other family",
    "concatenation_suffices": "concatenation suffices",
    "best_input": "best input representation",
    "d_better_than_c": "D better than C",
}


def says(claim: str) -> str:
    """A ranking in words."""
    kind, _, family = claim.partition("/")
    return f"best conditioning of {family}" if family else SAYS[kind]


def chance_text(chance: float, resamples: int) -> str:
    """A probability as text, with a bound where the number of resamples limits it."""
    least = max(1e-3, 1.0 / resamples)
    if least < chance < 1.0 - least:
        return f"{chance:.3f}"
    return f"> {1.0 - least:.3f}" if chance > 0.5 else f"< {least:.3f}"


def errors_table(ranking: Any, by_recipe: dict[str, Any]) -> Table:
    """One row for each model that has a seed, best first; `by_recipe` are the errors by the paper's recipe.

    Errors are medians over the seeds, with their interval in brackets, and the extremes if there are several seeds.
    """
    rows = []
    for name, spread in sorted(ranking["spread"].items(), key=lambda pair: pair[1]["test_mse"]["median"]):
        count, cells = len(ranking["models"][name]), []
        for one in (spread[metric] for metric in METRICS):
            cells.append(f"{number(one['median'])} [{number(one['low'])}, {number(one['high'])}]")
            cells[-1] += f", seeds {number(one['min'])} to {number(one['max'])}" if count > 1 else ""
        first = [name, number(by_recipe[name]) if name in by_recipe else "-", f"{count} of {ranking['seeds_expected']}"]
        rows.append([*first, *cells, number(spread["validation_mse"]["median"])])
    left_out = " ".join(f"{label} is {sentence}." for label, sentence in ranking["left_out"].items())
    words = caption("ranking", confidence=100 * ranking["confidence"], resamples=ranking["resamples"])
    header = ["Model", "MSE by the paper's recipe", "Seeds", *METRICS.values(), "Validation MSE"]
    return Table(header, rows, f"{words} {left_out}".strip())


def orders_table(ranking: Any) -> Table:
    """One row for each ranking, followed by one for each of its orders that the seeds decide."""
    rows = []
    for name, claim in ranking["claims"].items():
        pairs = [pair for pair in ranking["pairs"] if pair["claim"] == name]
        decided = [pair for pair in pairs if pair["probability"]["test_mse"] is not None]
        rows.append([says(name), f"{claim['paper']} first", f"{len(decided)} of {len(pairs)}", "-", claim["decision"]])
        rows += [
            [
                "",
                f"{pair['better']} before {pair['worse']}",
                " and ".join(map(str, pair["seeds"])),
                chance_text(pair["probability"]["test_mse"], ranking["resamples"]),
                pair["decision"],
            ]
            for pair in decided
        ]
    sure = ranking["confidence"]
    words = caption("ranking-orders", resamples=ranking["resamples"], confidence=sure, tail=1.0 - sure)
    return Table(["Ranking", "Order", "Seeds, or orders decided", "P", "Decision"], rows, words)


def table_ranking(ranking: Any, model_comparison: Any) -> dict[str, Table]:
    """Tables: errors of each model over its seeds, and the paper's rankings with the probability of each order."""
    by_recipe = model_comparison["by_paper_recipe"]["mse"]
    return {"ranking": errors_table(ranking, by_recipe), "ranking-orders": orders_table(ranking)}

"""Input representations and training-set size: validation curves of the feature sets, and of nested training shares.

Below them, the feature sets by `swift`. `page_text` is the table of docs/surrogate-models.md.
"""

from typing import Any

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem._support.wording import markdown_table
from experiments.published_models import PAPER_TRAINED_INPUTS, REFERENCE
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number

STYLES = {
    "A": {"color": drawing.RED, "marker": "o"},
    "B": {"color": drawing.ORANGE, "marker": "o"},
    "C": {"color": drawing.VIOLET, "marker": "o"},
    "D": {"color": drawing.BLUE, "marker": "o"},
}
LABELS = {
    "A": "time, indentation",
    "B": "A + velocity",
    "C": "B + acceleration",
    "D": "B + edge",
}
FOLD = 0


def draw_feature_sets(axes: Axes, sets: dict[str, Any], ranking: Any = None) -> None:
    """One curve for each feature set, or a band if it has two seeds; the legend gives the least validation error."""
    names = [name for name in LABELS if name in sets]
    for name in names:
        count, label = models_style.seeds_of(ranking, f"features-{name}"), f"{name}: {LABELS[name]}"
        if count >= models_style.SEVERAL:
            curves = ranking["curves"][f"features-{name}"]
            low, high = min(map(min, curves)), max(map(min, curves))
            text = f"{label} ({low:.1e} to {high:.1e}, {count} seeds)"
            models_style.draw_curves_of_seeds(axes, curves, STYLES[name], text)
        else:
            text = f"{label} ({sets[name]['validation_mse']:.1e})"
            models_style.draw_curve(axes, sets[name]["history"], STYLES[name], text)
    _legend_below(axes)


def _legend_below(axes: Axes, **options: Any) -> None:
    """The legend under a panel, where it hides no curve."""
    axes.legend(loc="upper center", bbox_to_anchor=(0.45, -0.2), **options)


def features_table(feature_sets: dict[str, Any], ranking: Any = None) -> Table:
    """One row for each feature set: errors over the seeds if there are two, or of one training."""
    rows = []
    for name, inputs in LABELS.items():
        training = feature_sets["sets"].get(name)
        count = models_style.seeds_of(ranking, f"features-{name}")
        if count >= models_style.SEVERAL:
            spread = ranking["spread"][f"features-{name}"]
            errors = [range_text(spread[metric]) for metric in ("validation_mse", "test_mse")]
        else:
            count = int(training is not None)
            errors = [number(training[metric]) if training else "-" for metric in ("validation_mse", "mse")]
        rows.append([name, inputs, str(count), *errors])
    return Table(["Set", "Inputs", "Trainings", "Validation MSE", "Held-out MSE"], rows, caption("features"))


def page_text(feature_sets: Any) -> str:
    """The table for a page."""
    table = features_table(feature_sets)
    rows = [[*row[:2], *row[3:]] for row in table.rows]
    heads = [*table.header[:2], *table.header[3:]]
    return f"{markdown_table(heads, rows, 'llrr')}\n\nOne training each. Measured by `{feature_sets['command']}`."


def range_text(spread: dict[str, float]) -> str:
    """Median over the seeds, and the extremes if they differ."""
    text = number(spread["median"])
    same = spread["min"] == spread["max"]
    return text if same else f"{text} ({number(spread['min'])} to {number(spread['max'])})"


def draw_shares(axes: Axes, efficiency: dict[str, Any]) -> None:
    """One curve for each share of the training part, from the first fold; the whole part in black."""
    shares, shades = efficiency["shares"], colormaps["viridis"]
    curves = [("100 %", drawing.BLACK, efficiency["full"])]
    for index, share in enumerate(shares):
        curves.append((f"{share['percent']:.3g} %", shades(0.9 * (index + 1) / len(shares)), share["folds"][FOLD]))
    for label, color, trained in curves:
        models_style.draw_curve(axes, trained["history"], {"color": color, "marker": "o"}, label)
    _legend_below(axes, ncols=2, title="share of the training trajectories")


def draw_by_paper_recipe(axes: Axes, comparison: Any) -> None:
    """One curve for each of the paper's feature sets, of its training by the paper's recipe."""
    for name, published in PAPER_TRAINED_INPUTS.items():
        if training := comparison["beside"].get(published):
            text = f"{name}: {LABELS[name]} ({training['validation_mse']:.1e})"
            models_style.draw_curve(axes, training["history"], STYLES[name], text)
    _legend_below(axes)


def compose(
    feature_sets: Any, data_efficiency: Any, model_comparison: Any, ranking: Any = None
) -> dict[str, Figure | Table]:
    """Draw the trainings by the paper's recipe and the shares; below, those by `swift`, their errors, and a table."""
    by_paper_recipe = bool(set(PAPER_TRAINED_INPUTS.values()) & model_comparison["beside"].keys())
    drawn, panels = drawing.panels(1, 2 + by_paper_recipe, height=3.0)
    for axes in panels:
        axes.set(xlabel="epoch", ylabel="validation MSE", yscale="log")
        axes.set_title(models_style.label(REFERENCE, "swift").partition(", ")[2], loc="right")
    if by_paper_recipe:
        draw_by_paper_recipe(panels[0], model_comparison)
        panels[0].set_title(models_style.label(REFERENCE, "paper").partition(", ")[2], loc="right")
    draw_shares(panels[1], data_efficiency)
    draw_feature_sets(panels[2 * by_paper_recipe], feature_sets["sets"], ranking)
    return {"figure-features": drawn, "features": features_table(feature_sets, ranking)}

"""Input representations and training-set size: validation curves of the feature sets, and of nested training shares."""

from typing import Any

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, number

STYLES = {"A": drawing.VERMILION, "B": drawing.ORANGE, "C": drawing.PURPLE, "D": drawing.BLUE}
LABELS = {"A": "time, indentation", "B": "A + velocity", "C": "B + acceleration", "D": "B + edge"}
FOLD = 0


def draw_feature_sets(axes: Axes, sets: dict[str, Any] | None, ranking: Any = None) -> None:
    """One curve for each feature set, or a band if it has two seeds; the legend gives the least validation error."""
    names = [name for name in LABELS if name in (sets or {}) or models_style.seeds_of(ranking, f"features-{name}")]
    if not names:
        _absent(axes, "make feature-sets")
        return
    for name in names:
        count, label = models_style.seeds_of(ranking, f"features-{name}"), f"{name}: {LABELS[name]}"
        if count >= models_style.SEVERAL or name not in (sets or {}):
            curves = ranking["curves"][f"features-{name}"]
            low, high = min(map(min, curves)), max(map(min, curves))
            words = (
                f"{label} ({low:.1e} to {high:.1e}, {count} seeds)" if count > 1 else f"{label} ({low:.1e}, one seed)"
            )
            models_style.draw_curves_of_seeds(axes, curves, _look(STYLES[name]), words)
            continue
        trained = sets[name] if sets else {}
        words = f"{label} ({trained['validation_mse']:.1e})"
        models_style.draw_curve(axes, trained["history"], _look(STYLES[name]), words)
    axes.legend(loc="upper right")


def features_table(sets: dict[str, Any], ranking: Any = None) -> Table:
    """One row for each feature set: its errors over the seeds if it has two, otherwise those of one training."""
    rows = []
    for name, inputs in LABELS.items():
        count = models_style.seeds_of(ranking, f"features-{name}")
        if count >= models_style.SEVERAL or (count and name not in sets):
            spread = ranking["spread"][f"features-{name}"]
            errors = [range_text(spread[metric]) for metric in ("validation_mse", "test_mse")]
        elif name in sets:
            count, errors = 1, [number(sets[name][metric]) for metric in ("validation_mse", "mse")]
        else:
            count, errors = 0, ["-", "-"]
        rows.append([name, inputs, str(count), *errors])
    caption = (
        "Input representations of M1-concat, trained for the same number of epochs. Errors of several seeds: median, "
        "then the least and the largest. `make table-ranking` says which order of them holds."
    )
    return Table(["Set", "Inputs", "Trainings", "Validation MSE", "Held-out MSE"], rows, caption)


def range_text(spread: dict[str, float]) -> str:
    """Median over the seeds, and the extremes if they differ."""
    text = number(spread["median"])
    same = spread["min"] == spread["max"]
    return text if same else f"{text} ({number(spread['min'])} to {number(spread['max'])})"


def draw_shares(axes: Axes, content: dict[str, Any] | None) -> None:
    """One curve for each share of the training part, from the first fold; the whole part in black."""
    if content is None:
        _absent(axes, "make data-efficiency")
        return
    shares = content["shares"]
    shades = colormaps["viridis"]
    models_style.draw_curve(axes, content["full"]["history"], _look(drawing.BLACK), "100 %")
    for index, one in enumerate(shares):
        look = _look(shades(0.9 * (index + 1) / len(shares)))
        models_style.draw_curve(axes, one["folds"][FOLD]["history"], look, f"{one['percent']:.3g} %")
    axes.legend(loc="upper right", ncols=2)


def _look(color: Any) -> dict[str, Any]:
    return {"color": color, "marker": "o"}


def _absent(axes: Axes, command: str) -> None:
    axes.set(xlim=(0.0, 1.0), ylim=(1e-4, 1.0), xticks=[])
    drawing.absent(axes, f"not trained yet:\n`{command}`")


def compose(feature_sets: Any = None, data_efficiency: Any = None, ranking: Any = None) -> dict[str, Figure | Table]:
    """Draw the published trainings of both panels, and write the errors of the first panel as a table.

    Raises:
        FileNotFoundError: Nothing is published for either panel.
    """
    if (
        feature_sets is None
        and data_efficiency is None
        and not any(models_style.seeds_of(ranking, f"features-{name}") for name in LABELS)
    ):
        raise FileNotFoundError(
            "neither feature_sets.json nor data_efficiency.json is published; `make feature-sets data-efficiency` "
            "makes them"
        )
    drawn = drawing.figure(height=2.8)
    first, second = drawn.subplots(1, 2)
    for axes, name in ((first, "a"), (second, "b")):
        axes.set(xlabel="epoch", ylabel="validation MSE", yscale="log")
        drawing.letter(axes, name)
    draw_feature_sets(first, feature_sets and feature_sets["sets"], ranking)
    draw_shares(second, data_efficiency)
    table = features_table(feature_sets["sets"] if feature_sets else {}, ranking)
    return {"figure-features": drawn, "features": table}

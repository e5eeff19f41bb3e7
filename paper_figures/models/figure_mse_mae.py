"""Held-out MSE against MAE of every trained model; the colour is the family, the marker the conditioning."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style


def draw_models(
    axes: Axes, models: dict[str, Any], x: str, y: str, ranking: Any = None, *, factor: float = 1.0
) -> None:
    """Draw one marker for each model, or median and range of its seeds if it has two; `factor` scales parameters."""
    for name, found in models.items():
        place = factor * found[x] if x == "parameters" else f"test_{x}"
        if not models_style.draw_spread(axes, ranking, name, place, f"test_{y}"):
            axes.plot(factor * found[x], found[y], label=name, zorder=3, **models_style.marker(name))


def compose(model_comparison: Any, ranking: Any = None) -> Figure:
    """Draw the trained models, with the spread over their seeds, and the paper's best model."""
    paper = drawing.paper_values("reference_model")
    drawn = drawing.figure(width=drawing.COLUMN, height=3.4)
    axes = drawn.subplots()
    axes.plot(paper["mse"], paper["mae"], **models_style.paper_marker(paper["name"]))
    draw_models(axes, model_comparison["models"], "mse", "mae", ranking)
    axes.set(
        xscale="log", yscale="log", xlabel="held-out MSE of the scaled force", ylabel="held-out MAE of the scaled force"
    )
    axes.margins(0.15)
    for axis in (axes.xaxis, axes.yaxis):
        drawing.log_labels(axis)
    drawn.legend(
        handles=models_style.handles(paper["name"]),
        loc="outside upper center",
        ncols=5,
        columnspacing=1.0,
        handlelength=1.2,
    )
    note = models_style.notes(
        models_style.missing_note(model_comparison["missing"], model_comparison["differences"]),
        *models_style.spread_lines(ranking, list(model_comparison["models"]), width=80),
    )
    if note:
        drawn.supxlabel(note, fontsize=5.5, color="0.4")
    return drawn

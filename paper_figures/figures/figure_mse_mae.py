"""Held-out MSE against MAE of every trained model: colour for the family, marker for the conditioning."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style


def draw_models(axes: Axes, models: dict[str, Any], x: str, y: str, *, factor: float = 1.0) -> None:
    """One marker for each model; `factor` multiplies the abscissa."""
    for name, found in models.items():
        axes.plot(factor * found[x], found[y], label=name, zorder=3, **models_style.marker(name))


def compose(model_comparison: Any) -> Figure:
    """Draw the models that are trained, beside the paper's best."""
    paper = drawing.paper_values("reference_model")
    drawn = drawing.figure(width=drawing.COLUMN, height=3.4)
    axes = drawn.subplots()
    axes.plot(paper["mse"], paper["mae"], **models_style.paper_marker(paper["name"]))
    draw_models(axes, model_comparison["models"], "mse", "mae")
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
    note = models_style.missing_note(model_comparison["missing"], model_comparison["differences"])
    if note:
        drawn.supxlabel(note, fontsize=5.5, color="0.4")
    return drawn

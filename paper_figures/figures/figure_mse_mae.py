"""Held-out MSE against MAE of every trained model: colour for the family, marker for the conditioning."""

from pathlib import Path
from typing import Annotated, Any

import typer
from matplotlib.axes import Axes

from bem._support.command_line import run_main
from paper_figures.style import drawing, models_style

RESULT = Path("results/studies/model_comparison.json")


def draw_models(axes: Axes, models: dict[str, Any], x: str, y: str, *, factor: float = 1.0) -> None:
    """One marker for each model; `factor` multiplies the abscissa."""
    for name, found in models.items():
        axes.plot(factor * found[x], found[y], label=name, zorder=3, **models_style.marker(name))


def main(
    result: Annotated[Path, typer.Option(help="Result file of the model comparison.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the figure goes.")] = drawing.FIGURES,
) -> None:
    """Draw the models that are trained, beside the paper's best."""
    content = drawing.read_result(result, "make figure-mse-mae")
    paper = drawing.paper_values("reference_model")
    drawn = drawing.figure(width=drawing.COLUMN, height=3.4)
    axes = drawn.subplots()
    axes.plot(paper["mse"], paper["mae"], **models_style.paper_marker(paper["name"]))
    draw_models(axes, content["models"], "mse", "mae")
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
    note = models_style.missing_note(content["missing"], content["differences"])
    if note:
        drawn.supxlabel(note, fontsize=5.5, color="0.4")
    drawing.save(drawn, "figure-mse-mae", folder)


if __name__ == "__main__":
    run_main(main)

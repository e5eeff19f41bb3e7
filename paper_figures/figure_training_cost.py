"""Figure: error against core minutes of training, and against the trajectories it was trained on.

Reads the result of `experiments.training_cost`; what is not published yet is named in the panels.
"""

from pathlib import Path
from typing import Annotated, Any

import typer
from matplotlib.axes import Axes

from paper_figures import drawing

RESULT = Path("published/measurements/training_cost.json")
REFERENCE_MODEL = "M1-concat"


def draw_time(axes: Axes, models: list[dict[str, Any]]) -> None:
    """Best validation error so far over core minutes; the reference model in colour, the others behind it."""
    for model in sorted(models, key=lambda one: one["name"] == REFERENCE_MODEL):
        history = model["history"]
        first = model["name"] == REFERENCE_MODEL
        style = {"color": drawing.BLUE, "linewidth": 1.4} if first else {"color": "0.75", "linewidth": 0.7}
        label = REFERENCE_MODEL if first else "other architectures"
        axes.loglog(history["core_minutes"], history["best_mse"], label=label, **style)
        if first:
            axes.loglog(history["core_minutes"], history["validation_mse"], color=drawing.SKY, linewidth=0.5, zorder=1)
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    axes.legend(unique.values(), unique.keys())
    axes.set(xlabel="training (core minutes)", ylabel="validation error (MSE, scaled force)")


def draw_shares(axes: Axes, points: list[dict[str, Any]]) -> None:
    """Test error over trajectories, with the solver seconds they took above."""
    if not points:
        axes.text(
            0.5,
            0.5,
            "shares of the data set\nnot trained yet",
            transform=axes.transAxes,
            ha="center",
            va="center",
            color="0.4",
        )
        axes.set(xticks=[], yticks=[])
        return
    count = [point["trajectories"] for point in points]
    error, deviation = ([point[name] for point in points] for name in ("mse", "mse_sd"))
    axes.errorbar(count, error, yerr=deviation, color=drawing.BLUE, marker="o", markersize=4, capsize=2)
    axes.set(xscale="log", yscale="log", xlabel="training trajectories", ylabel="held-out error (MSE, scaled force)")
    each = points[-1]["solver_seconds"] / points[-1]["trajectories"]
    above = axes.secondary_xaxis("top", functions=(lambda n: n * each, lambda s: s / each))
    above.set_xlabel("solver seconds to make them")


def main(
    result: Annotated[Path, typer.Option(help="Result file of the cost of training.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the figure goes.")] = drawing.FIGURES,
) -> None:
    """Draw the figure."""
    content = drawing.read_result(result, "make measure-training-cost")
    drawn = drawing.figure(height=2.8)
    left, right = drawn.subplots(1, 2)
    if content["models"]:
        draw_time(left, content["models"])
    else:
        left.text(0.5, 0.5, "no model published yet", transform=left.transAxes, ha="center", color="0.4")
        left.set(xticks=[], yticks=[])
    draw_shares(right, content["shares"])
    for axes, name in ((left, "a"), (right, "b")):
        drawing.letter(axes, name)
    drawing.save(drawn, "figure-training-cost", folder)


if __name__ == "__main__":
    typer.run(main)

"""Held-out MSE against MAE of every trained model; the colour is the family, the marker the conditioning.

The first panel is of the trainings by the paper's recipe, the second of those by `swift`, with the spread of seeds.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import paper_names


def draw_models(
    axes: Axes, models: dict[str, Any], x: str, y: str, ranking: Any = None, *, factor: float = 1.0
) -> None:
    """Draw one marker for each of the models; one with two seeds in `ranking` as their median and range.

    `factor` scales parameters.
    """
    for name, model in reversed(models.items()):  # the first in front
        position = factor * model[x] if x == "parameters" else f"test_{x}"
        if not models_style.draw_spread(axes, ranking, name, position, f"test_{y}"):
            axes.plot(factor * model[x], model[y], label=name, zorder=3, **models_style.marker(name))


def compose(model_comparison: Any, ranking: Any = None) -> Figure:
    """Draw the trained models by each recipe, with the spread over seeds, and the paper's best model."""
    paper = drawing.paper_values("reference_model")
    recipe, trained = models_style.leading(model_comparison)
    parts = {recipe: (trained, ranking if recipe == "swift" else None)} | {
        "swift": (model_comparison["models"], ranking)
    }
    drawn, panels = drawing.panels(1, len(parts), height=3.2)
    panels[0].plot(paper["mse"], paper["mae"], **models_style.paper_marker(paper["name"]))
    for axes, (name, (models, seeds)) in zip(panels, parts.items(), strict=True):
        draw_models(axes, models, "mse", "mae", seeds)
        axes.set(xscale="log", yscale="log", xlabel="held-out MSE of the scaled force")
        axes.set_ylabel("held-out MAE of the scaled force")
        axes.set_title("paper’s recipe" if name == "paper" else "swift", loc="right")
        axes.margins(0.1)
        drawing.log_labels(axes.xaxis)
        drawing.log_labels(axes.yaxis)
    drawn.legend(
        handles=models_style.handles(), loc="outside upper center", ncols=11, columnspacing=0.9, handlelength=1.2
    )
    models_style.write_states(drawn, model_comparison, ranking, paper_names())
    return drawn

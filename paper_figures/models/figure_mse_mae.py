"""Held-out MSE against MAE of every trained model; the colour is the family, the marker the conditioning.

The second panel is the part of the first that holds the models that are trained by our recipe.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import paper_names


def draw_models(axes: Axes, comparison: Any, x: str, y: str, ranking: Any = None, *, factor: float = 1.0) -> None:
    """Draw one marker for each training by the paper's recipe and for each by ours, in `model_comparison`.

    A model with two seeds is drawn as their median and range; `factor` scales parameters.
    """
    for name, model in models_style.trained_by_paper_recipe(comparison).items():
        axes.plot(factor * model[x], model[y], **models_style.recipe_marker(name))
    for name, model in comparison["models"].items():
        position = factor * model[x] if x == "parameters" else f"test_{x}"
        if not models_style.draw_spread(axes, ranking, name, position, f"test_{y}"):
            axes.plot(factor * model[x], model[y], label=name, zorder=3, **models_style.marker(name))


def compose(model_comparison: Any, ranking: Any = None) -> Figure:
    """Draw the trained models, with the spread over their seeds, and the paper's best model."""
    paper = drawing.paper_values("reference_model")
    ours = model_comparison | {"by_paper_recipe": {"trained": []}}
    drawn, panels = drawing.panels(1, 2, width_ratios=(1.0, 1.6), height=3.2)
    panels[0].plot(paper["mse"], paper["mae"], **models_style.paper_marker(paper["name"]))
    for axes, shown in zip(panels, (model_comparison, ours), strict=True):
        draw_models(axes, shown, "mse", "mae", ranking)
        axes.set(xscale="log", yscale="log", xlabel="held-out MSE of the scaled force")
        axes.set_ylabel("held-out MAE of the scaled force")
        axes.margins(0.1)
        drawing.log_labels(axes.xaxis)
        drawing.log_labels(axes.yaxis)
    drawn.legend(
        handles=models_style.handles(), loc="outside upper center", ncols=11, columnspacing=0.9, handlelength=1.2
    )
    models_style.write_states(drawn, model_comparison, ranking, paper_names())
    return drawn

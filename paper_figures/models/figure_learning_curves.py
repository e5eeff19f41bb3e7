"""Validation curves of the FiLM and gated models; those of the concatenated models are in figure 5 (a)."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import PAPER_FAMILIES, paper_names

SHOWN = ("FiLM", "gated")


def draw_curves(axes: Axes, comparison: Any, conditioning: str, ranking: Any = None) -> None:
    """Draw the validation MSE over the epochs of the models of a conditioning in `model_comparison`, by both recipes.

    A model with two seeds or more is drawn as their median, in a band from the least to the largest; it is dashed. A
    training by the paper's recipe has a marker with a black edge.
    """
    models = comparison["models"]
    for name, model in models_style.trained_by_paper_recipe(comparison).items():
        if name.endswith(conditioning):
            models_style.draw_curve(axes, model["history"], models_style.recipe_marker(name), "_", "-")
    names = {family: f"{family}-{conditioning}" for family in PAPER_FAMILIES}
    for family, name in names.items():
        if name not in models:
            continue
        look = models_style.marker(name)
        if models_style.seeds_of(ranking, name) >= models_style.SEVERAL:
            models_style.draw_curves_of_seeds(axes, ranking["curves"][name], look, family)
        else:
            models_style.draw_curve(axes, models[name]["history"], look, family)
    axes.set(xlabel="epoch", ylabel="validation MSE", xscale="log", yscale="log")
    drawing.log_labels(axes.xaxis)


def compose(model_comparison: Any, ranking: Any = None) -> Figure:
    """Draw both panels, with the spread over seeds.

    Raises:
        FileNotFoundError: None of the models is published.
    """
    shown = [name for name in paper_names() if name.endswith(SHOWN)]
    if set(shown) <= set(model_comparison["missing"]):
        raise FileNotFoundError(f"no {' or '.join(SHOWN)} model is published; `make models` trains them")
    drawn, panels = drawing.panels(1, 2, sharex=True, sharey=True, height=2.7)
    theirs = [models_style.recipe_handle(curves=True)] if models_style.trained_by_paper_recipe(model_comparison) else []
    for axes, conditioning in zip(panels, SHOWN, strict=True):
        draw_curves(axes, model_comparison, conditioning, ranking)
        if axes.lines:
            axes.legend(handles=[*axes.get_legend_handles_labels()[0], *theirs], loc="upper right", ncols=2)
        axes.set_title(conditioning, loc="right")
    models_style.write_states(drawn, model_comparison, ranking, shown)
    return drawn

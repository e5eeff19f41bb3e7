"""Validation curves of the FiLM and gated models; those of the concatenated models are in figure 5 (a).

The upper panels are of the trainings by the paper's recipe, as the paper's; the lower ones of those by `swift`.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import PAPER_FAMILIES, paper_names

SHOWN = ("FiLM", "gated")
EPOCHS = (0, 350)
"""Ends of the epoch axis, the paper's."""


def draw_curves(axes: Axes, comparison: Any, conditioning: str, recipe: str, ranking: Any = None) -> None:
    """Draw the validation MSE over the epochs of the models of a conditioning by a recipe, from `model_comparison`.

    A model with two seeds or more by `swift` is drawn as their median, in a band from the least to the largest.
    """
    by_paper = recipe == "paper"
    models = models_style.trained_by_paper_recipe(comparison) if by_paper else comparison["models"]
    for family in PAPER_FAMILIES:
        name = f"{family}-{conditioning}"
        if name not in models:
            continue
        if not by_paper and models_style.seeds_of(ranking, name) >= models_style.SEVERAL:
            models_style.draw_curves_of_seeds(axes, ranking["curves"][name], models_style.marker(name), family)
        else:
            models_style.draw_curve(axes, models[name]["history"], models_style.marker(name), family)
    axes.set(xlabel="epoch", ylabel="validation MSE", yscale="log")
    if by_paper:
        axes.set_xlim(EPOCHS)
    axes.set_title(models_style.label(conditioning, recipe), loc="right")
    if axes.lines:
        axes.legend(loc="upper right", ncols=2)


def compose(model_comparison: Any, ranking: Any = None) -> Figure:
    """Draw the panels, those by `swift` with the spread over seeds.

    Raises:
        FileNotFoundError: None of the models is published.
    """
    shown = [name for name in paper_names() if name.endswith(SHOWN)]
    recipe, trained = models_style.leading(model_comparison)
    if not set(shown) & set(trained) and set(shown) <= set(model_comparison["missing"]):
        raise FileNotFoundError(f"no {' or '.join(SHOWN)} model is published; `make models` trains them")
    rows = dict.fromkeys((recipe, "swift"))
    drawn, panels = drawing.panels(len(rows), 2, sharex="row", sharey=True, height=2.6 * len(rows))
    places = [(name, conditioning) for name in rows for conditioning in SHOWN]
    for axes, (name, conditioning) in zip(panels, places, strict=True):
        draw_curves(axes, model_comparison, conditioning, name, ranking)
    models_style.write_states(drawn, model_comparison, ranking, shown)
    return drawn

"""Validation curves of the FiLM and gated models; those of the concatenated models are in figure 5 (a).

The upper panels are of the trainings by the paper's recipe, as the paper's; the lower ones of those by `swift`.
"""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import PAPER_FAMILIES, paper_names

SHOWN = ("FiLM", "gated")
EPOCHS = (0, 350)
"""Ends of the epoch axis, the paper's."""


def draw_curves(panels: Sequence[Axes], comparison: Any, conditioning: str, recipe: str, ranking: Any = None) -> None:
    """Draw the validation MSE over the epochs of a conditioning by a recipe, a panel each of the six families.

    A panel has the other families in grey. A model with two seeds or more by `swift`, in the result `ranking`, is drawn
    as their median, in a band from the least to the largest.
    """
    by_paper = recipe == "paper"
    models = models_style.trained_by_paper_recipe(comparison) if by_paper else comparison["models"]
    shown = {family: name for family in PAPER_FAMILIES if (name := f"{family}-{conditioning}") in models}
    for axes, family in zip(panels, PAPER_FAMILIES, strict=True):
        axes.set(yscale="log", title=family)
        if by_paper:
            axes.set(xlim=EPOCHS, xticks=(0, 150, 300))
        if family in shown:
            name = shown[family]
            if not by_paper and models_style.seeds_of(ranking, name) >= models_style.SEVERAL:
                models_style.draw_curves_of_seeds(axes, ranking["curves"][name], models_style.marker(name), family)
            else:
                models_style.draw_curve(axes, models[name]["history"], models_style.marker(name), family)
        for other in (name for key, name in shown.items() if key != family):
            history = models[other]["history"]
            axes.plot(history["epoch"], history["validation_mse"], color="0.85", linewidth=0.5, zorder=0)


def compose(model_comparison: Any, ranking: Any = None) -> Figure:
    """Draw the panels, those by `swift` with the spread over seeds.

    Raises:
        FileNotFoundError: None of the models is published.
    """
    shown = [name for name in paper_names() if name.endswith(SHOWN)]
    recipe, trained = models_style.leading(model_comparison)
    if not set(shown) & set(trained) and set(shown) <= set(model_comparison["missing"]):
        raise FileNotFoundError(f"no {' or '.join(SHOWN)} model is published; `make models` trains them")
    rows = [(name, conditioning) for name in dict.fromkeys((recipe, "swift")) for conditioning in SHOWN]
    drawn = drawing.figure(height=1.55 * len(rows))
    panels = drawn.subplots(len(rows), len(PAPER_FAMILIES), sharex="row", sharey=True, squeeze=False)
    for row, (name, conditioning) in zip(panels, rows, strict=True):
        draw_curves(row, model_comparison, conditioning, name, ranking)
        row[0].set_ylabel(f"{models_style.label(conditioning, name)}\nvalidation MSE")
    drawing.letters(panels[:, 0])
    for axes in panels[-1]:
        axes.set_xlabel("epoch")
    models_style.write_states(drawn, model_comparison, ranking, shown)
    return drawn

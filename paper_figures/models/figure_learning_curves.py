"""Validation curves of the FiLM and gated models; those of the concatenated models are in figure 5 (a)."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import PAPER_FAMILIES

SHOWN = ("FiLM", "gated")
"""Conditionings, one panel each."""


def draw_curves(axes: Axes, models: dict[str, Any], conditioning: str, ranking: Any = None) -> int:
    """Draw the validation MSE over the epochs of the trained models of a conditioning, and return their number.

    A model with two seeds or more is drawn as their median, in a band from the least to the largest.
    """
    drawn = 0
    for family in PAPER_FAMILIES:
        name = f"{family}-{conditioning}"
        if name not in models:
            continue
        drawn += 1
        look = models_style.marker(name)
        if models_style.seeds_of(ranking, name) >= models_style.SEVERAL:
            models_style.draw_curves_of_seeds(axes, ranking["curves"][name], look, family)
        else:
            models_style.draw_curve(axes, models[name]["history"], look, family)
    axes.set(xlabel="epoch", ylabel="validation MSE", yscale="log")
    if drawn:
        axes.legend(loc="upper right", ncols=2)
    else:
        drawing.absent(axes, f"no {conditioning} model to compare")
        axes.set(xlim=(0.0, 1.0), ylim=(1e-4, 1.0), xticks=[])
    return drawn


def compose(model_comparison: Any, ranking: Any = None) -> Figure:
    """Draw both panels, with the spread over seeds.

    Raises:
        FileNotFoundError: No FiLM or gated model is trained.
    """
    models = model_comparison["models"]
    missing = [name for name in model_comparison["missing"] if name.endswith(SHOWN)]
    otherwise = {name: words for name, words in model_comparison["differences"].items() if name.endswith(SHOWN)}
    if len(missing) == len(PAPER_FAMILIES) * len(SHOWN):
        raise FileNotFoundError("no FiLM or gated model is trained yet; `make models` trains them")
    drawn = drawing.figure(height=2.7)
    # An empty panel has no limits to share.
    shared = all(any(name.endswith(conditioning) for name in models) for conditioning in SHOWN)
    panels = drawn.subplots(1, 2, sharex=shared, sharey=shared)
    for axes, conditioning, name in zip(panels, SHOWN, "ab", strict=True):
        draw_curves(axes, models, conditioning, ranking)
        axes.set_title(conditioning, loc="right")
        drawing.letter(axes, name)
    note = models_style.notes(
        models_style.missing_note(missing, otherwise),
        *models_style.spread_lines(ranking, [name for name in models if name.endswith(SHOWN)]),
    )
    if note:
        drawn.supxlabel(note, fontsize=5.5, color="0.4")
    return drawn

"""Validation curves of the FiLM and gated models; those of the concatenated models are in figure 5 (a)."""

from pathlib import Path
from typing import Annotated, Any

import typer
from matplotlib.axes import Axes

from bem._support.command_line import run_main
from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import PAPER_FAMILIES

RESULT = Path("results/studies/model_comparison.json")
SHOWN = ("FiLM", "gated")
"""One panel for each of these conditionings."""


def draw_curves(axes: Axes, models: dict[str, Any], conditioning: str) -> int:
    """Validation MSE over epochs of the six models of a conditioning that are trained; returns how many."""
    drawn = 0
    for family in PAPER_FAMILIES:
        name = f"{family}-{conditioning}"
        if name not in models:
            continue
        history = models[name]["history"]
        least = min(range(len(history["epoch"])), key=history["validation_mse"].__getitem__)
        color = models_style.color(name)
        axes.plot(history["epoch"], history["validation_mse"], color=color, linewidth=1.0, label=family)
        axes.plot(history["epoch"][least], history["validation_mse"][least], **models_style.marker(name))
        drawn += 1
    axes.set(xlabel="epoch", ylabel="validation MSE", yscale="log")
    if drawn:
        axes.legend(loc="upper right", ncols=2)
    else:
        axes.text(0.5, 0.5, f"no {conditioning} model to compare", transform=axes.transAxes, ha="center", color="0.4")
        axes.set(xlim=(0.0, 1.0), ylim=(1e-4, 1.0), xticks=[])
    return drawn


def main(
    result: Annotated[Path, typer.Option(help="Result file of the model comparison.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the figure goes.")] = drawing.FIGURES,
) -> None:
    """Draw both panels."""
    content = drawing.read_result(result, "make figure-learning-curves")
    models = content["models"]
    missing = [name for name in content["missing"] if name.endswith(SHOWN)]
    otherwise = {name: words for name, words in content["differences"].items() if name.endswith(SHOWN)}
    if len(missing) == len(PAPER_FAMILIES) * len(SHOWN):
        raise FileNotFoundError("no FiLM or gated model is trained yet; `make models` trains them")
    drawn = drawing.figure(height=2.7)
    # An empty panel has no limits to share.
    shared = all(any(name.endswith(conditioning) for name in models) for conditioning in SHOWN)
    panels = drawn.subplots(1, 2, sharex=shared, sharey=shared)
    for axes, conditioning, name in zip(panels, SHOWN, "ab", strict=True):
        draw_curves(axes, models, conditioning)
        axes.set_title(conditioning, loc="right")
        drawing.letter(axes, name)
    note = models_style.missing_note(missing, otherwise)
    if note:
        drawn.supxlabel(note, fontsize=5.5, color="0.4")
    drawing.save(drawn, "figure-learning-curves", folder)


if __name__ == "__main__":
    run_main(main)

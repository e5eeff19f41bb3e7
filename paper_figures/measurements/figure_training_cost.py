"""Figure: error against core minutes of training.

Curves are validation errors. Held-out errors, measured once at the end of a training, are marked at its core minutes.
The figure reads the result of `experiments.trainings.training_costs`; a line above it names the trainings that are not
published yet.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from paper_figures.style.models_style import REFERENCE

LEGIBLE = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}
"""The background of words that may lie on a curve."""
HELD_OUT = f"{REFERENCE}, held-out, end of a run"
GREY = {"color": "0.65", "linewidth": 0.7}


def write_end(axes: Axes, run: dict[str, Any], *, left: bool) -> None:
    """Mark the held-out error at the end of a training of the reference model, and name the training beside it."""
    at = (run["core_minutes"], run["test_mse"])
    axes.loglog(*at, label=HELD_OUT, zorder=4, **models_style.marker(REFERENCE))
    suffix = run["name"].removeprefix(REFERENCE).replace("-paper", "-paper's recipe").replace("-", " ").strip()
    look = {"ha": "right" if left else "left", "va": "center", "bbox": LEGIBLE, "zorder": 3.5}
    drawing.note(axes, suffix or f"{run['epochs']} epochs", at, (-5 if left else 5, 0), **look)


def write_target(axes: Axes, paper_mse: float, reached: float | None) -> None:
    """Draw the paper's error as a line, and where the validation error of the reference model reaches it."""
    axes.axhline(paper_mse, color=drawing.PAPER, linewidth=0.8, linestyle="--")
    text = "paper's held-out error"
    if reached is not None:
        axes.plot(reached, paper_mse, "o", markersize=6.0, color="none", markeredgecolor=drawing.BLACK, zorder=5)
        text += f",\nreached by {REFERENCE}\nin {reached:.2g} core-minutes"
    place = {"xycoords": ("axes fraction", "data"), "xytext": (0, 3), "textcoords": "offset points"}
    axes.annotate(text, (1.0, paper_mse), ha="right", va="bottom", color=drawing.PAPER, **place)


def compose(training_cost: Any) -> Figure:
    """Draw the least validation error so far over core minutes, and the held-out error of each reference training.

    The curves of the other architectures are grey and behind that of the reference model; the paper's error is a line.
    """
    drawn = drawing.figure(width=drawing.COLUMN, height=2.8)
    axes, cost = drawn.subplots(), training_cost
    for model in sorted(cost["models"], key=lambda run: run["name"] == REFERENCE):
        history = model["history"]
        first = model["name"] == REFERENCE
        style = {"color": models_style.color(REFERENCE), "linewidth": 1.4} if first else GREY
        label = f"{REFERENCE}, validation so far" if first else "others, validation so far"
        axes.loglog(history["core_minutes"], history["best_mse"], label=label, **style)
    references = [model for model in cost["models"] if model["name"] == REFERENCE]
    longest = max((run["core_minutes"] for run in references), default=float("inf"))
    for run in [*references, *cost["beside"]]:
        # Names of trainings that took no longer than the reference are to the left, the others to the right.
        write_end(axes, run, left=run not in references and run["core_minutes"] <= longest)
    write_target(axes, cost["paper_mse"], cost["minutes_to_paper_mse"])
    axes.set_xlim(right=4.0 * axes.get_xlim()[1])
    axes.set(xlabel="training (core-minutes)", ylabel="MSE of the scaled force")
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    axes.legend(unique.values(), unique.keys(), loc="upper right")
    if absent := [*training_cost["missing"], *training_cost["outdated"]]:
        drawn.suptitle(f"not published yet: {', '.join(absent)}", color="0.4")
    return drawn

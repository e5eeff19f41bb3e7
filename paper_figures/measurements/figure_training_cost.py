"""Figure: error against core minutes of training.

Curves are validation errors. Held-out errors, measured once at the end of a training, are marked at its core minutes.
The figure reads the result of `experiments.trainings.training_costs`; a line above it names the trainings that are not
published yet.
"""

from typing import Any

from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from paper_figures.style.models_style import REFERENCE

LEGIBLE = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}
"""The background of words that may lie on a curve."""
GREY = {"color": "0.65", "linewidth": 0.7}


def compose(training_cost: Any) -> Figure:
    """Draw the least validation error so far over core minutes, and the held-out error of each reference training.

    The curves of the other architectures are grey and behind that of the reference model; the paper's error is a line.
    """
    drawn = drawing.figure(width=drawing.COLUMN, height=3.0)
    axes, cost = drawn.subplots(), training_cost
    for model in sorted(cost["models"], key=lambda run: run["name"] == REFERENCE):
        history = model["history"]
        first = model["name"] == REFERENCE
        style = {"color": models_style.color(REFERENCE), "linewidth": 1.4} if first else GREY
        label = f"{REFERENCE}, validation so far" if first else "other architectures, validation so far"
        axes.loglog(history["core_minutes"], history["best_mse"], label=label, **style)
    references = [model for model in cost["models"] if model["name"] == REFERENCE]
    longest_left = max((run["core_minutes"] for run in references), default=float("inf"))
    for run in [*references, *cost["beside"]]:
        at = (run["core_minutes"], run["test_mse"])
        axes.loglog(*at, label="held-out, end of a run", zorder=4, **models_style.marker(REFERENCE))
        suffix = run["name"].removeprefix(REFERENCE).replace("-paper", "-paper's recipe").replace("-", " ").strip()
        # Names of trainings that took no longer than the reference are to the left, the others to the right.
        shift, side = (-5, "right") if suffix and run["core_minutes"] <= longest_left else (5, "left")
        look = {"ha": side, "va": "center", "bbox": LEGIBLE, "zorder": 3.5}
        drawing.note(axes, suffix or f"{run['epochs']} epochs", at, (shift, 0), **look)
    axes.axhline(cost["paper_mse"], color=drawing.PAPER, linewidth=0.8, linestyle="--", label="paper's held-out")
    reached = cost["minutes_to_paper_mse"]
    if reached is not None:
        axes.axvline(reached, color=models_style.color(REFERENCE), linewidth=0.6, linestyle=":", zorder=1)
        text = f"{reached:.2g} core-minutes to\nthe paper's error"
        drawing.beside(axes, reached, text, height=0.97, shift=4, bbox=LEGIBLE)
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    frame = {"frameon": True, "framealpha": 1.0, "edgecolor": "none"}
    axes.legend(unique.values(), unique.keys(), loc="lower left", **frame)
    low, high = axes.get_ylim()
    axes.set_xlim(right=4.0 * axes.get_xlim()[1])
    axes.set(xlabel="training (core-minutes)", ylabel="MSE of the scaled force", ylim=(low / 60.0, high))
    if absent := [*training_cost["missing"], *training_cost["outdated"]]:
        drawn.suptitle(f"not published yet: {', '.join(absent)}", color="0.4")
    return drawn

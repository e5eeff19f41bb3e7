"""Figure: error against core minutes of training, and against the number of training trajectories.

Curves are validation errors. Held-out errors, measured once at the end of a training, are marked at its core minutes.
The figure reads the result of `experiments.training.training_cost`; a line above it names the trainings that are not
published yet.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style
from paper_figures.style.models_style import REFERENCE

LEGIBLE = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}
"""The background of words that may lie on a curve."""
GREY = {"color": "0.75", "linewidth": 0.7}


def draw_time(axes: Axes, content: dict[str, Any]) -> None:
    """Draw the least validation error so far over core minutes, and the held-out error of each reference training.

    The curves of the other architectures are grey and behind that of the reference model; the paper's error is a line.
    """
    for model in sorted(content["models"], key=lambda one: one["name"] == REFERENCE):
        history = model["history"]
        first = model["name"] == REFERENCE
        style = {"color": models_style.color(REFERENCE), "linewidth": 1.4} if first else GREY
        label = f"{REFERENCE}, validation so far" if first else "other architectures, validation so far"
        axes.loglog(history["core_minutes"], history["best_mse"], label=label, **style)
    references = [model for model in content["models"] if model["name"] == REFERENCE]
    longest_left = max((run["core_minutes"] for run in references), default=float("inf"))
    for run in [*references, *content["beside"]]:
        axes.loglog(
            run["core_minutes"],
            run["test_mse"],
            label="held-out, end of a run",
            zorder=4,
            **models_style.marker(REFERENCE),
        )
        words = run["name"].removeprefix(f"{REFERENCE}-").replace("-", " ") if run["name"] != REFERENCE else ""
        # Names of trainings that took no longer than the reference are to the left, the others to the right.
        left = words and run["core_minutes"] <= longest_left
        place = {"xytext": (-5, 0), "ha": "right"} if left else {"xytext": (5, 0), "ha": "left"}
        at = (run["core_minutes"], run["test_mse"])
        axes.annotate(
            words or f"{run['epochs']} epochs",
            at,
            textcoords="offset points",
            fontsize=6,
            va="center",
            bbox=LEGIBLE,
            zorder=3.5,
            **place,
        )
    axes.axhline(content["paper_mse"], color=drawing.PAPER, linewidth=0.8, linestyle="--", label="paper's held-out")
    reached = content["minutes_to_paper_mse"]
    if reached is not None:
        axes.axvline(reached, color=models_style.color(REFERENCE), linewidth=0.6, linestyle=":", zorder=1)
        text = f"{reached:.2g} core-minutes to\nthe paper's error"
        drawing.beside(axes, reached, text, height=0.97, shift=4, fontsize=6, bbox=LEGIBLE)
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    frame = {"frameon": True, "framealpha": 1.0, "edgecolor": "none"}
    axes.legend(unique.values(), unique.keys(), loc="lower left", fontsize=6, **frame)
    low, high = axes.get_ylim()
    axes.set_xlim(right=3.0 * axes.get_xlim()[1])
    axes.set(xlabel="training (core-minutes)", ylabel="MSE of the scaled force", ylim=(low / 60.0, high))


def draw_shares(axes: Axes, points: list[dict[str, Any]]) -> None:
    """Draw the test error over the number of trajectories, and state the solver's time of one of them."""
    if not points:
        drawing.absent(axes, "shares of the data set\nnot trained yet")
        axes.set(xticks=[], yticks=[])
        return
    count = [point["trajectories"] for point in points]
    error, deviation, folds = ([point[name] for point in points] for name in ("mse", "mse_sd", "folds"))
    models_style.draw_folds(axes, count, error, deviation, folds, models_style.marker(REFERENCE))
    axes.legend(loc="upper right", fontsize=6)
    axes.set(xscale="log", yscale="log", xlabel="training trajectories", ylabel="held-out error (MSE, scaled force)")
    each = 1e3 * points[-1]["solver_seconds"] / points[-1]["trajectories"]
    axes.set_xlabel(f"training trajectories, {each:.0f} ms of the solver each")


def compose(training_cost: Any) -> Figure:
    """Draw the figure."""
    drawn = drawing.figure(height=2.8)
    left, right = drawn.subplots(1, 2)
    if training_cost["models"]:
        draw_time(left, training_cost)
    else:
        drawing.absent(left, "no model published yet")
        left.set(xticks=[], yticks=[])
    draw_shares(right, training_cost["shares"])
    absent = [*training_cost["missing"], *training_cost["outdated"]]
    if absent:
        drawn.suptitle(f"not published yet: {', '.join(absent)}", fontsize=6, color="0.4")
    drawing.letters((left, right))
    return drawn

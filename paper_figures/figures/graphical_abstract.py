"""The graphical abstract: protocol, surrogate, and predicted force, with the cost and the error of the prediction."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style, schematics
from paper_figures.style.writing import number

SAMPLE = 5


def draw_model(axes: Axes, regime: dict[str, Any], name: str, errors: dict[str, Any]) -> None:
    """The model between two arrows, with its median errors and times below."""
    schematics.blank(axes, 10.0, 8.0)
    tabor = regime["protocol"]["tabor"]
    schematics.arrow(axes, (0.2, 4.6), (1.7, 4.6), lw=1.6)
    schematics.arrow(axes, (8.3, 4.6), (9.8, 4.6), lw=1.6)
    schematics.box(
        axes, 5.0, 4.6, f"{name}\nsequence to\nsequence", schematics.LSTM_FILL, width=6.4, height=3.0, size=8
    )
    schematics.arrow(axes, (5.0, 7.4), (5.0, 6.15), lw=1.2, linestyle=":", color=drawing.RED)
    axes.text(5.0, 7.5, rf"Tabor parameter $\mu = {tabor:g}$", ha="center", color=drawing.RED)
    overall = errors["overall"]
    milliseconds = {name: number(1e3 * seconds, 2) for name, seconds in regime["seconds"].items()}
    text = (
        f"median error on {errors['trajectories']} unseen protocols\n"
        f"pull-off force {overall['pull_off_force_percent']['median']:.2g} %, "
        f"hysteresis {overall['hysteresis_percent']['median']:.2g} %\n"
        f"Keras call {milliseconds['keras_call']} ms, solver {milliseconds['solver']} ms"
    )
    axes.text(5.0, 1.4, text, ha="center", va="center")


def draw_force(axes: Axes, regime: dict[str, Any], name: str) -> None:
    """Predicted and simulated force over indentation."""
    native, steps = regime["native"], regime["steps"]
    drawing.zero_line(axes)
    axes.plot(native["indentation"], native["force"], color=drawing.BLACK, linewidth=1.0, label="solver")
    recipe, predicted = next(iter(models_style.recipes(regime["predicted"]).items()))
    label = models_style.label(name, recipe)
    axes.plot(steps["indentation"], predicted["force"], label=label, **models_style.step_marker(name))
    axes.set(xlabel=drawing.INDENTATION, ylabel=drawing.FORCE, title="force, predicted and simulated")
    axes.legend(loc="lower left")


def compose(canonical_regimes: Any, error_statistics: Any) -> Figure:
    """Draw the graphical abstract."""
    regime = next(candidate for candidate in canonical_regimes["regimes"] if candidate["sample"] == SAMPLE)
    drawn = drawing.figure(height=2.5)
    first, second, third = drawn.subplots(1, 3)
    depths = regime["steps"]["indentation"]
    first.plot(np.arange(1, len(depths) + 1), depths, color=drawing.BLACK, linewidth=1.6)
    first.set(xlabel="measurement step", ylabel=drawing.INDENTATION, title="indentation history")
    name = canonical_regimes["config"]["model"]
    draw_model(second, regime, name, next(iter(models_style.recipes(error_statistics).values())))
    draw_force(third, regime, name)
    return drawn

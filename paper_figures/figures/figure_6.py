"""Figure 6: force against indentation of the twelve canonical protocols, by solver and surrogate.

The surrogate is the training by the paper's recipe. It has one marker throughout, and each sample a shade; the legend
gives the error of its pull-off force. The number of a sample is at its turning point.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style

PANELS = ((1, 2, 3), (4, 5, 6), (7, 8, 9), (10, 11, 12))
CROWDED = {7: (42, 14), 10: (42, 14)}
"""Offset in points of the numbers of those samples whose turning point lies among other loops."""


def draw_regime(axes: Axes, regime: dict[str, Any], model: str, color: str) -> None:
    """Draw the solver's force as a line, the surrogate's steps as markers, and the number of the sample."""
    native, steps = regime["native"], regime["steps"]
    axes.plot(native["indentation"], native["force"], color=drawing.BLACK, linewidth=0.9, zorder=2)
    look = models_style.step_marker(model) | {"color": color, "markeredgecolor": color}
    predicted = next(iter(models_style.recipes(regime["predicted"]).values()))
    label = f"({regime['sample']}), pull-off error {predicted['errors_percent']['pull_off_force']:.2g} %"
    axes.plot(steps["indentation"], predicted["force"], zorder=3, label=label, **look)
    deepest = native["indentation"].index(max(native["indentation"]))
    turning = native["indentation"][deepest], native["force"][deepest]
    shift = CROWDED.get(regime["sample"], (5, 0))
    leader = {"arrowstyle": "-", "linewidth": 0.5, "shrinkB": 3} if regime["sample"] in CROWDED else None
    drawing.note(axes, f"({regime['sample']})", turning, shift, va="center", color=color, arrowprops=leader)


def compose(canonical_regimes: Any) -> Figure:
    """Draw figure 6."""
    regimes = {regime["sample"]: regime for regime in canonical_regimes["regimes"]}
    name = canonical_regimes["config"]["model"]
    shades = drawing.tints(models_style.color(name), 3)
    recipe = next(iter(models_style.recipes(regimes[1]["predicted"])))
    drawn, panels = drawing.panels(2, 2, height=5.2)
    for axes, samples in zip(panels, PANELS, strict=True):
        drawing.zero_line(axes)
        for sample, color in zip(samples, shades, strict=True):
            draw_regime(axes, regimes[sample], name, color)
        axes.margins(x=0.12)
        tabor = regimes[samples[0]]["protocol"]["tabor"]
        dwell = "long" if max(regimes[sample]["protocol"]["dwell_time"] for sample in samples) > 0.1 else "short"
        axes.set_title(rf"$\mu = {tabor:g}$, {dwell} dwell", loc="right")
        axes.set(xlabel=drawing.INDENTATION, ylabel=drawing.FORCE)
        solver = axes.plot([], [], color=drawing.BLACK, linewidth=0.9)[0]
        marks, labels = axes.get_legend_handles_labels()
        axes.legend([solver, *marks], ["solver", *labels], loc="best")
    drawn.suptitle(models_style.label(name, recipe), fontsize="medium")
    return drawn

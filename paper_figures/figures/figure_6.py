"""Figure 6: force against indentation of the twelve canonical protocols, by solver and surrogate.

A row is a regime of the paper, a panel a protocol. The surrogate is the training by the paper's recipe. A title gives
the number of the sample and the error of its pull-off force.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, models_style

REGIMES = ((1, 2, 3), (4, 5, 6), (7, 8, 9), (10, 11, 12))


def draw_sample(axes: Axes, regime: dict[str, Any], model: str) -> None:
    """Draw the solver's force as a line, and the surrogate's at the measurement steps as markers."""
    native, steps = regime["native"], regime["steps"]
    drawing.zero_line(axes)
    axes.plot(native["indentation"], native["force"], color=drawing.BLACK, linewidth=0.9, zorder=2, label="solver")
    recipe, predicted = next(iter(models_style.recipes(regime["predicted"]).items()))
    look = models_style.step_marker(model) | {"markersize": 2.4}
    axes.plot(steps["indentation"], predicted["force"], zorder=3, label=models_style.label(model, recipe), **look)
    error = predicted["errors_percent"]["pull_off_force"]
    axes.set_title(f"({regime['sample']}), pull-off error {error:.2g} %", loc="right", fontsize=6.5)


def compose(canonical_regimes: Any) -> Figure:
    """Draw figure 6."""
    regimes = {regime["sample"]: regime for regime in canonical_regimes["regimes"]}
    name = canonical_regimes["config"]["model"]
    drawn = drawing.figure(height=7.6)
    panels = drawn.subplots(len(REGIMES), 3)
    drawing.letters(panels[:, 0])
    for row, samples in zip(panels, REGIMES, strict=True):
        for axes, sample in zip(row, samples, strict=True):
            draw_sample(axes, regimes[sample], name)
        dwell = "long" if max(regimes[sample]["protocol"]["dwell_time"] for sample in samples) > 0.1 else "short"
        tabor = regimes[samples[0]]["protocol"]["tabor"]
        row[0].set_ylabel(rf"$\mu = {tabor:g}$, {dwell} dwell" "\n" + drawing.FORCE)
    for axes in panels[-1]:
        axes.set_xlabel(drawing.INDENTATION)
    drawn.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return drawn

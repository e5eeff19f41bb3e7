"""Figure 3: a trajectory at the solver's own time steps, and the same trajectory at the 120 measurement steps."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from bem.dataset.measurement_steps import FMS
from paper_figures.style import drawing


def compose(dataset_examples: Any) -> Figure:
    """Draw figure 3."""
    mapping = dataset_examples["mapping"]
    native = {name: np.array(values) for name, values in mapping["native"].items()}
    steps = {name: np.array(values) for name, values in mapping["steps"].items()}
    index, ends = np.arange(1, len(steps["time"]) + 1), np.cumsum((0, *FMS))
    drawn = drawing.figure(height=4.4)
    upper, lower = drawn.subfigures(2, 1)
    first, second = upper.subplots(1, 2), lower.subplots(1, 3)
    ticks = {"color": "0.3", "markersize": 5, "markeredgewidth": 0.4, "clip_on": False}
    labels = {"indentation": drawing.INDENTATION, "time": drawing.TIME, "force": drawing.FORCE}
    for axes, quantity in zip(first, ("indentation", "force"), strict=True):
        drawing.by_phase(axes, native["time"], native[quantity], mapping["phase_times"])
        # The solver's time steps as ticks along the bottom.
        low = np.full_like(native["time"], 0.04)
        axes.plot(native["time"], low, "|", transform=axes.get_xaxis_transform(), **ticks)
        axes.margins(y=0.15)
        axes.set(xlabel=drawing.TIME, ylabel=labels[quantity])
    for axes, quantity in zip(second, labels, strict=True):
        for boundary in np.cumsum(FMS)[:2] + 0.5:
            axes.axvline(boundary, color="0.8", linewidth=0.6, zorder=0)
        for begin, end, color in zip(ends[:-1], ends[1:], drawing.PHASES.values(), strict=True):
            axes.plot(index[begin:end], steps[quantity][begin:end], ".", markersize=3.2, color=color)
        axes.set(xlabel=r"measurement step $j$", ylabel=labels[quantity])
    drawing.letters([*first, *second])
    marks = [
        Line2D([], [], color=color, marker=".", label=f"{phase}, {count} steps")
        for (phase, color), count in zip(drawing.PHASES.items(), FMS, strict=True)
    ]
    rug = f"the solver's {len(np.unique(native['time']))} instants"
    marks.append(Line2D([], [], color="0.3", marker="|", markersize=5, linestyle="", label=rug))
    upper.legend(handles=marks, loc="outside upper center", ncols=4)
    return drawn

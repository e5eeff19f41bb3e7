"""Figure 2: force over time of six trajectories, and distributions of pull-off time, force ratio and cost.

The histograms show shares of the completed trajectories; trajectories that are never compressed have no force ratio.
The paper marks no cost in its panel (i). The line drawn here is its mean: its CPU-hours over its trajectories.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator, PercentFormatter

from bem._support.validation import FloatArray
from bem.dataset.file import Dataset, load_dataset
from experiments.paper.dataset_statistics import force_ratio
from paper_figures.style import drawing

BINS_PER_DECADE = 5
LITTLE = 0.2
"""Share of the largest compression below which the pull-off force is drawn again in an inset."""


def draw_example(axes: Axes, example: dict[str, Any]) -> None:
    """Force over time, with the dwell shaded, and pull-off and largest compression marked."""
    native, results = example["native"], example["results"]
    _, t1, t2, t3 = example["phase_times"]
    axes.axhline(0.0, color="0.75", linewidth=0.6, zorder=0)
    # The edge keeps a dwell visible that is short beside the whole.
    axes.axvspan(t1, t2, facecolor=(drawing.ORANGE, 0.35), edgecolor=drawing.ORANGE, linewidth=0.8, label="dwell")
    axes.plot(native["time"], native["force"], color=drawing.BLACK)
    lowest = int(np.argmin(native["force"]))
    style = {"linestyle": "", "clip_on": False, "zorder": 3}
    peak = results["pull_off_time"], results["pull_off_force"]
    axes.plot(*peak, marker="o", color=drawing.RED, label=r"$\hat P_\mathrm{po}$", **style)
    bottom = native["time"][lowest], native["force"][lowest]
    axes.plot(*bottom, marker="s", color=drawing.BLUE, label=r"$\hat P_\mathrm{mc}$", **style)
    axes.set_xlim(0.0, 1.03 * t3)
    axes.margins(y=0.12)
    if results["pull_off_force"] < LITTLE * -min(native["force"]):
        draw_tension(axes, native, peak)
    protocol = example["protocol"]
    axes.set_title(rf"$\mu={protocol['tabor']:g}$, $\hat\delta_l={protocol['peak_indentation']:g}$", loc="right")
    axes.set_xlabel(drawing.TIME)
    axes.set_ylabel(r"force $\hat P$")


def draw_tension(axes: Axes, native: dict[str, Any], peak: tuple[float, float]) -> None:
    """An inset of the tension around the pull-off, where it is too little to be seen beside the compression."""
    late = peak[0] > 0.5 * native["time"][-1]
    inset = axes.inset_axes((0.16 if late else 0.55, 0.07, 0.28, 0.28))
    time, force = np.array(native["time"]), np.array(native["force"])
    pulled = (force > 0.0) & (time > time[np.argmin(force)])
    begin, end = time[pulled][[0, -1]]
    inset.axhline(0.0, color="0.75", linewidth=0.6, zorder=0)
    inset.plot(time, force, color=drawing.BLACK, linewidth=0.9)
    inset.plot(*peak, "o", color=drawing.RED)
    inset.set(xlim=(begin - 0.1 * (end - begin), end), ylim=(-0.4 * peak[1], 1.3 * peak[1]))
    inset.set_xticks([])
    inset.set_yticks([0.0, peak[1]], labels=["0", f"{peak[1]:.2g}"])


def draw_histogram(axes: Axes, values: FloatArray, label: str) -> None:
    """Share of trajectories in bins of equal width on a logarithmic axis."""
    low = np.floor(np.log10(values.min()))
    high = max(np.ceil(np.log10(values.max())), low + 1.0)
    bins = np.logspace(low, high, int(BINS_PER_DECADE * (high - low)) + 1)
    share = np.full(len(values), 1.0 / len(values))
    axes.hist(values, bins=bins, weights=share, color="0.6", edgecolor="white", linewidth=0.4)
    axes.set_xscale("log")
    axes.set_xlabel(label)
    axes.set_ylabel("share of trajectories")
    axes.yaxis.set_major_locator(MultipleLocator(0.05 if axes.get_ylim()[1] > 0.12 else 0.02))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))


def mark(axes: Axes, value: float, text: str, color: str, *, height: float, shift: float) -> None:
    """Draw a vertical line with text beside it, at a share of the panel's height."""
    axes.axvline(value, color=color, linewidth=1.0)
    drawing.beside(axes, value, text, height=height, shift=shift, color=color)


def draw_cost(axes: Axes, dataset: Dataset, paper: dict[str, Any]) -> None:
    """Distribution of the solver's seconds, with its mean and that of the paper."""
    seconds = dataset.scalars["solver_seconds"][dataset.completed]
    draw_histogram(axes, seconds, r"solver time $t_\mathrm{CPU}$ (s)")
    total, hours = float(seconds.sum()), paper["cpu_hours"]
    theirs = 3600.0 * hours / paper["trajectories"]
    axes.set(xlim=(None, 3e3), ylim=(0.0, 1.25 * axes.get_ylim()[1]))
    mark(axes, theirs, f"paper: {hours} h\nmean {theirs:.0f} s", drawing.PAPER, height=0.6, shift=-3)
    ours = f"here: {total / 60.0:.1f} min\nmean {1e3 * seconds.mean():.1f} ms"
    mark(axes, float(seconds.mean()), ours, drawing.BLACK, height=0.98, shift=3)


def compose(dataset_examples: Any, dataset: Path) -> Figure:
    """Draw figure 2."""
    examples = dataset_examples["examples"]
    data = load_dataset(dataset)
    rows, scalars = data.completed, data.scalars
    drawn, panels = drawing.panels(3, 3, height=6.2)
    for axes, example in zip(panels[:6], examples, strict=True):
        draw_example(axes, example)
    panels[0].legend(loc="lower right")
    draw_histogram(panels[6], scalars["pull_off_time"][rows], r"pull-off time $\hat t_\mathrm{po}$")
    ratio = force_ratio(data)
    draw_histogram(panels[7], ratio, r"force ratio $\hat P_\mathrm{po}/|\hat P_\mathrm{mc}|$")
    panels[7].set_ylim(top=1.3 * panels[7].get_ylim()[1])
    text = f"without {len(rows) - len(ratio)} never compressed"
    panels[7].annotate(text, (0.97, 0.97), xycoords="axes fraction", ha="right", va="top")
    draw_cost(panels[8], data, drawing.paper_values("dataset"))
    return drawn

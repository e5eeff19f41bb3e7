"""Figure: where a surrogate wins. Error against processor time, of the pretrained models, the paper's, and the solver.

The pull-off force in batches, in single calls and step by step, with the solver's time as a line, and its gradient in
batches. Bars go from the median to the 90th percentile of hidden protocols at the paper's modulus ratio. Reads the data
of `experiments.surrogates.pretrained_errors`; a panel that is not measured is left out.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing

TITLES = {
    "batch": "a trajectory, in batches",
    "single": "a trajectory, in single calls",
    "step": "a step of a stream",
    "gradient": "a gradient, in batches",
}
UNITS = {"step": (1e6, r"µs")}
MILLISECONDS = (1e3, "ms")
COLORS = ("0.4", drawing.BLUE, drawing.GREEN, drawing.ORANGE, drawing.PURPLE, drawing.SKY)
"""Of the solver, then of the models."""


def error_of(content: dict[str, Any], name: str, kind: str) -> dict[str, float] | None:
    """Quantiles of the error of a tool; the solver at standard accuracy is the truth of trajectories."""
    if kind == "gradient":
        return content["gradients"]["tools"][name]["common"]
    return content["models"][name]["paper"]["pull_off"] if name != "solver" else None


def draw(axes: Axes, content: dict[str, Any], kind: str) -> None:
    """One way to call."""
    factor, unit = UNITS.get(kind, MILLISECONDS)
    for name, color in zip(["solver", *content["models"]], COLORS, strict=False):
        look = {"color": color}
        cost, found = factor * content["seconds"][name][kind], error_of(content, name, kind)
        label = "solver, standard" if name == "solver" else name
        if found is None:
            axes.axvline(cost, linestyle="--", label=label, **look)
            continue
        axes.plot([cost, cost], [found["p50"], found["p90"]], linewidth=1.0, **look)
        axes.plot(cost, found["p50"], "s" if name == "solver" else "o", label=label, **look)
    of_what = "gradient" if kind == "gradient" else "pull-off force"
    axes.set(xscale="log", yscale="log", xlabel=f"processor time ({unit})", title=TITLES[kind])
    axes.set_ylabel(f"error of the {of_what} (%)")
    axes.margins(x=0.15)
    for axis in (axes.xaxis, axes.yaxis):
        drawing.log_labels(axis)


def compose(pretrained_errors: Any) -> Figure:
    """Draw the figure."""
    kinds = [kind for kind in TITLES if kind in pretrained_errors["seconds"]["solver"]]
    rows = (len(kinds) + 1) // 2
    drawn = drawing.figure(height=0.4 + 2.2 * rows)
    panels = drawn.subplots(rows, 2, squeeze=False).flat
    for axes, kind in zip(panels, kinds, strict=True):
        draw(axes, pretrained_errors, kind)
    handles, labels = panels[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    drawing.letters(panels)
    return drawn

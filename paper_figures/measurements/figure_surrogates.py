"""Figure: where a surrogate wins. Error of the pull-off force against processor time of a trajectory.

In batches and in single calls, of the pretrained models and the paper's, with the solver's time as a line. Bars go from
the median to the 90th percentile of hidden protocols at the paper's modulus ratio. Reads the data of
`experiments.surrogates.pretrained_errors`.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from paper_figures.style import drawing

TITLES = {"batch": "batches", "single": "single calls"}
LIMITS, ERRORS = (0.05, 12.0), (0.1, 12.0)
"""Of both axes, the same in both panels."""
COLORS = (drawing.BLUE, drawing.GREEN, drawing.ORANGE, drawing.PURPLE, drawing.SKY)


def draw(axes: Axes, content: dict[str, Any], kind: str) -> None:
    """One way to call."""
    for (name, model), color in zip(content["models"].items(), COLORS, strict=False):
        cost, found = 1e3 * content["seconds"][name][kind], model["paper"]["pull_off"]
        axes.plot([cost, cost], [found["p50"], found["p90"]], color=color, linewidth=1.0)
        axes.loglog(cost, found["p50"], "o", color=color, label=name)
    axes.axvline(1e3 * content["seconds"]["solver"][kind], color="0.4", linestyle="--", label="solver, standard")
    axes.set(xlabel="processor time of a trajectory (ms)", title=TITLES[kind], xlim=LIMITS, ylim=ERRORS)
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xticks([0.1, 1.0, 10.0], labels=["0.1", "1", "10"])
    axes.set_yticks([0.1, 1.0, 10.0], labels=["0.1", "1", "10"])


def compose(pretrained_errors: Any) -> Figure:
    """Draw the figure."""
    drawn = drawing.figure(height=2.6)
    panels = drawn.subplots(1, 2, sharey=True)
    for axes, kind in zip(panels, TITLES, strict=True):
        draw(axes, pretrained_errors, kind)
    panels[0].set_ylabel("error of the pull-off force (%),\nmedian to 90th percentile")
    panels[1].legend(loc="upper left")
    drawing.letters(panels)
    return drawn

"""Figure: seconds a trajectory against error, for every tool on the same held-out protocols.

Markers are medians over the protocols, thin lines reach to the 95th percentile of the error and over the quartiles of
the seconds. Reads the measurement of `experiments.accuracy_cost`.
"""

from pathlib import Path
from typing import Annotated, Any

import typer
from matplotlib.axes import Axes

from paper_figures import drawing
from paper_figures.cost_style import KINDS, kind_of, mark_paper

RESULT = Path("published/measurements/accuracy_cost.json")
PANELS = {"pull_off_force": "error of the pull-off force (%)", "force": "error of the force history (%)"}
LARGEST = 99.0
"""Errors above, in percent, mean that a tool does not answer the question at all."""


def draw(axes: Axes, tools: list[dict[str, Any]], quantity: str) -> None:
    """All tools in one panel; the solver and the paper's discretisation as curves."""
    for kind, style in KINDS.items():
        points = [tool for tool in tools if kind_of(tool) == kind and _percent(tool, quantity) is not None]
        if not points:
            continue
        seconds = [tool["seconds"]["median"] for tool in points]
        errors = [_percent(tool, quantity) for tool in points]
        curve = kind in ("solver", "paper's discretisation")
        axes.plot(
            seconds, errors, linestyle="-" if curve else "", label=kind, markersize=4, linewidth=1.0, zorder=3, **style
        )
        for tool, second, error in zip(points, seconds, errors, strict=True):
            thin = {"color": style["color"], "linewidth": 0.5, "alpha": 0.7}
            axes.plot([second, second], [error, 100.0 * tool["errors"][quantity]["p95"]], **thin)
            axes.plot([tool["seconds"]["low"], tool["seconds"]["high"]], [error, error], **thin)
            if tool["setting"] in ("draft", "standard", "reference"):
                axes.annotate(
                    tool["setting"],
                    (second, error),
                    xytext=(-4, -3),
                    textcoords="offset points",
                    fontsize=5.5,
                    ha="right",
                    va="top",
                    color=style["color"],
                )
    floor = next((tool for tool in tools if tool["kind"] == "measurement steps"), None)
    if floor and _percent(floor, quantity):
        level = _percent(floor, quantity)
        axes.axhline(level, color="0.6", linewidth=0.7, linestyle="--", zorder=0)
        axes.annotate(
            "120 measurement steps",
            (0.02, level),
            xycoords=("axes fraction", "data"),
            fontsize=5.5,
            color="0.4",
            va="bottom",
        )
    axes.set(xscale="log", yscale="log", xlabel="time a trajectory, one core (s)", ylabel=PANELS[quantity])
    axes.set_xlim(axes.get_xlim()[0] / 2.0, 1000.0)
    mark_paper(axes)


def _percent(tool: dict[str, Any], quantity: str) -> float | None:
    value = tool["errors"][quantity]["median"]
    return 100.0 * value if value and 100.0 * value < LARGEST else None


def main(
    result: Annotated[Path, typer.Option(help="Measurement of accuracy and cost.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the figure goes.")] = drawing.FIGURES,
) -> None:
    """Draw the figure."""
    content = drawing.read_result(result, "make measure-accuracy-cost")
    drawn = drawing.figure(height=3.3)
    panels = drawn.subplots(1, 2)
    for axes, quantity, name in zip(panels, PANELS, "ab", strict=True):
        draw(axes, content["tools"], quantity)
        drawing.letter(axes, name)
    handles, labels = panels[1].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower center", ncol=6)
    drawing.save(drawn, "figure-accuracy-cost", folder)


if __name__ == "__main__":
    typer.run(main)

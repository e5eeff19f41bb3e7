"""Figure 6: force against indentation of the twelve canonical protocols, solver and surrogate."""

from pathlib import Path
from typing import Annotated, Any

import typer
from matplotlib.axes import Axes

from paper_figures import drawing

RESULT = Path("results/studies/canonical_regimes.json")
PANELS = {"a": (1, 2, 3), "b": (4, 5, 6), "c": (7, 8, 9), "d": (10, 11, 12)}
STYLES = (("o", drawing.BLUE), ("s", drawing.VERMILION), ("^", drawing.GREEN))


def draw_regime(axes: Axes, regime: dict[str, Any], style: tuple[str, str]) -> None:
    """The solver's history as a line, the surrogate's measurement steps as markers."""
    native, steps = regime["native"], regime["steps"]
    axes.plot(native["indentation"], native["force"], color=drawing.BLACK, linewidth=0.9, zorder=2)
    axes.plot(
        steps["indentation"],
        steps["predicted"],
        linestyle="",
        marker=style[0],
        color=style[1],
        markersize=3.2,
        markerfacecolor="none",
        markeredgewidth=0.6,
        zorder=3,
        label=f"({regime['sample']})",
    )


def main(
    result: Annotated[Path, typer.Option(help="Result file of the canonical regimes.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the figure goes.")] = drawing.FIGURES,
) -> None:
    """Draw figure 6."""
    content = drawing.read_result(result, "make figure-6")
    regimes = {one["sample"]: one for one in content["regimes"]}
    drawn = drawing.figure(height=5.2)
    for axes, (name, samples) in zip(drawn.subplots(2, 2).flat, PANELS.items(), strict=True):
        axes.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)
        for sample, style in zip(samples, STYLES, strict=True):
            draw_regime(axes, regimes[sample], style)
        tabor = regimes[samples[0]]["protocol"]["tabor"]
        dwell = "long" if max(regimes[sample]["protocol"]["dwell_time"] for sample in samples) > 0.1 else "short"
        axes.set_title(rf"$\mu = {tabor:g}$, {dwell} dwell", loc="right")
        drawing.letter(axes, name)
        axes.set(xlabel=r"indentation $\hat\delta$", ylabel=r"force $\hat P$")
        handles, labels = axes.get_legend_handles_labels()
        solver = axes.plot([], [], color=drawing.BLACK, linewidth=0.9)[0]
        marks = f"{content['config']['model']}, sample"
        axes.legend([solver, *handles], ["solver", *(f"{marks} {text}" for text in labels)], loc="best")
    drawing.save(drawn, "figure-6", folder)


if __name__ == "__main__":
    typer.run(main)

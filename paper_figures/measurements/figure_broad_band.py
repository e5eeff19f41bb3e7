"""Figure: pull-off amplification against unloading rate for broad-band solids, and their creep compliances.

Amplification is the largest force over JKR's 3/2, and over that of the elastic solid of the same Tabor parameter. Full
lines are the deepest preload, dotted lines the shallower ones. The figure reads the result of
`experiments.robustness.broad_band`.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing

LABELS = {
    "amplification": r"amplification $\hat P_\mathrm{po}/1.5$",
    "own_amplification": r"$\hat P_\mathrm{po}$ over the elastic one",
}
COLORS = (drawing.BLUE, drawing.GREEN, drawing.ORANGE, drawing.VIOLET, drawing.BLACK)


def draw_compliances(axes: Axes, curves: list[dict[str, Any]], ratio: float) -> None:
    """Draw the fitted series (lines) and the power laws that they approximate (dots)."""
    times = np.geomspace(1e-3, 1e6, 200)
    few = times[::12]
    for curve, color in zip(curves, COLORS, strict=True):
        strengths, taus = np.array(curve["compliances"]), np.array(curve["times"])
        label = curve["name"].replace("n = ", "$n$ = ").replace("standard linear solid", "standard\nlinear solid")
        axes.semilogx(times, 1.0 - np.exp(-times[:, None] / taus) @ strengths, color=color, label=label)
        if curve["n"] is not None:
            axes.semilogx(few, 1.0 + (ratio - 1.0) * (1.0 + few) ** -curve["n"], "o", color=color, markersize=2.5)
    axes.set(xlabel=r"time $\hat t$", ylabel=r"creep compliance $E_0 C$", ylim=(0.0, 1.05))
    axes.legend(loc="lower right", handlelength=1.2)


def draw_amplification(axes: Axes, curves: list[dict[str, Any]], names: list[str], ratio: float, over: str) -> None:
    """Draw the amplification over the rate for each solid and preload."""
    deepest = max(curve["preload"] for curve in curves)
    for curve in curves:
        color = COLORS[names.index(curve["name"])]
        deep = curve["preload"] == deepest
        points = [point for point in curve["points"] if point[over] is not None]
        axes.loglog(
            [point["unloading_rate"] for point in points],
            [point[over] for point in points],
            color=color,
            linestyle="-" if deep else ":",
        )
    axes.axhline(1.0 / ratio, color="0.6", linewidth=0.7, linestyle="--")
    axes.annotate("$1/k$", (0.02, 1.0 / ratio), xycoords=("axes fraction", "data"), va="bottom", color="0.4")
    axes.set(xlabel=r"unloading rate $\hat v_U$", ylabel=LABELS[over], ylim=(0.8, 15.0))
    axes.set_yticks([1, 2, 5, 10], labels=["1", "2", "5", "10"])
    depths = sorted({curve["preload"] for curve in curves})
    if len(depths) > 1:
        shallower = ", ".join(f"{depth:g}" for depth in depths[:-1])
        text = f"full: preload {deepest:g} $h_0$,\ndotted: {shallower}"
        axes.text(0.97, 0.03, text, transform=axes.transAxes, ha="right", va="bottom")


def compose(broad_band: Any) -> Figure:
    """Draw the figure."""
    curves, ratio = broad_band["curves"], broad_band["modulus_ratio"]
    names = list(dict.fromkeys(curve["name"] for curve in curves))
    drawn = drawing.figure(height=2.8)
    left, middle, right = drawn.subplots(1, 3)
    draw_compliances(left, [next(c for c in curves if c["name"] == name) for name in names], ratio)
    for axes, over in zip((middle, right), LABELS, strict=True):
        draw_amplification(axes, curves, names, ratio, over)
    drawing.letters((left, middle, right))
    return drawn

"""Boxes and arrows for diagrams."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyBboxPatch

LSTM_FILL, CONV_FILL, DENSE_FILL, TABOR_FILL, PLAIN_FILL = "#9AD4FF", "#C5F1B7", "#C59AC5", "#D49A6F", "#F2F2F2"


def box(
    axes: Axes,
    x: float,
    y: float,
    text: str,
    fill: str,
    *,
    width: float,
    height: float,
    size: float = 6.5,
    rounding: float | None = None,
    lw: float = 0.6,
    linespacing: float = 1.05,
) -> None:
    """Draw a box with text, centred at a point; `rounding`, 0.18 of the height by default, is the corner radius."""
    style = f"round,pad=0,rounding_size={0.18 * height if rounding is None else rounding}"
    corner = (x - 0.5 * width, y - 0.5 * height)
    axes.add_patch(FancyBboxPatch(corner, width, height, boxstyle=style, facecolor=fill, edgecolor="0.35", lw=lw))
    axes.text(x, y, text, ha="center", va="center", fontsize=size, linespacing=linespacing)


def node(axes: Axes, x: float, y: float, text: str, radius: float, size: float = 7.0) -> None:
    """Draw a round node, for an elementwise operation."""
    axes.add_patch(Circle((x, y), radius, facecolor="white", edgecolor="0.35", lw=0.6, zorder=3))
    axes.text(x, y, text, ha="center", va="center", fontsize=size, zorder=4)


def arrow(axes: Axes, begin: tuple[float, float], end: tuple[float, float], **style: Any) -> None:
    """Draw an arrow between two points; keywords are those of `FancyArrowPatch`."""
    drawn = {"arrowstyle": "-|>", "lw": 0.8, "color": "0.2", "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7} | style
    axes.annotate("", end, begin, arrowprops=drawn, zorder=2)


def line(axes: Axes, *points: tuple[float, float], **style: Any) -> None:
    """Draw a line through points, in the style of the arrows."""
    axes.plot(*zip(*points, strict=True), **{"color": "0.2", "linewidth": 0.8, "zorder": 1} | style)


def elbow(axes: Axes, *points: tuple[float, float], **style: Any) -> None:
    """Draw a line through points that ends in an arrow."""
    line(axes, *points[:-1], **style)
    arrow(axes, points[-2], points[-1], **style)


def blank(axes: Axes, width: float, height: float) -> None:
    """Prepare an empty panel without axes, of the given size in units that are equal in both directions."""
    axes.set(xlim=(0.0, width), ylim=(0.0, height), aspect="equal")
    axes.axis("off")

"""Draw the quantities of a contact, with their signs, for the guide and the demonstrator.

A sketch, not a solution: lengths are exaggerated. Usage: `python docs/images/quantities.py [quantities.svg]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

PICTURE = Path(__file__).with_suffix(".svg")
BLUE, GREEN, ORANGE, VERMILION, GREY = (
    "#0072B2",
    "#009E73",
    "#B35C00",
    "#D55E00",
    "#444444",
)
RADIUS, SPACING, WIDTH = 3.2, 0.3, 4.3


def surface(r: np.ndarray, depth: float, contact: float) -> np.ndarray:
    """Height of the surface: the sphere's shape, `SPACING` below it, in the contact, then a neck that decays."""
    inside = RADIUS - np.sqrt(RADIUS**2 - np.minimum(np.abs(r), contact) ** 2) - depth
    decay = np.exp(-np.maximum(np.abs(r) - contact, 0.0) / 0.45)
    far = -0.25 * depth * np.exp(-((r / 2.4) ** 2))
    return inside * decay + far * (1.0 - decay)


def arrow(
    axes: Axes, begin: tuple[float, float], end: tuple[float, float], **style: object
) -> None:
    """An arrow from point to point."""
    drawn = {
        "arrowstyle": "-|>",
        "shrinkA": 0,
        "shrinkB": 0,
        "mutation_scale": 8,
        "linewidth": 1.2,
    } | style
    axes.annotate("", end, begin, arrowprops=drawn)


def draw(axes: Axes, depth: float, contact: float, pulled: bool) -> None:
    """One state: the sphere's lowest point is `SPACING - depth` above the undeformed surface."""
    r = np.linspace(-WIDTH, WIDTH, 241)
    height = surface(r, depth, contact)
    bottom = SPACING - depth
    axes.fill_between(r, -2.4, height, color="#dfeaf2", linewidth=0)
    axes.plot(r, height, color=GREY, linewidth=1.2)
    near = np.linspace(-0.92, 0.92, 121) * RADIUS
    sphere = bottom + RADIUS - np.sqrt(RADIUS**2 - near**2)
    axes.fill_between(near, sphere, sphere.max(), color="#e9e4dc", linewidth=0)
    axes.plot(near, sphere, color=GREY, linewidth=1.2)
    axes.axhline(0.0, color=GREY, linewidth=0.8, linestyle=(0, (2, 2)))
    axes.plot(
        [0.0, 0.0], [-2.2, bottom + 1.1], color=GREY, linewidth=0.6, linestyle="-."
    )
    # The displacement counts from h0 above the undeformed surface.
    axes.plot([-3.9, 0.0], [bottom, bottom], color=BLUE, linewidth=0.7, linestyle=":")
    axes.plot(
        [-3.9, -3.1], [SPACING, SPACING], color=BLUE, linewidth=0.7, linestyle=":"
    )
    sign = r"$\delta>0$" if depth > 0 else r"$\delta<0$"
    arrow(axes, (-3.5, SPACING), (-3.5, bottom), color=BLUE)
    axes.text(
        -3.4,
        (bottom + SPACING) / 2 - (0.2 if depth > 0 else 0.0),
        sign,
        color=BLUE,
        va="center",
    )
    axes.text(-3.95, SPACING, "0", color=BLUE, va="center", ha="right")
    # Contact radius, and the gap at a radius outside.
    ground = float(np.interp(contact, r, height))
    axes.plot(
        [contact, contact], [ground, -1.55], color=GREEN, linewidth=0.7, linestyle=":"
    )
    arrow(axes, (0.0, -1.45), (contact, -1.45), color=GREEN)
    axes.text(contact / 2, -1.5, "$a$", color=GREEN, va="top", ha="center")
    place = 2.35
    low, high = (
        float(np.interp(place, r, height)),
        float(np.interp(place, near, sphere)),
    )
    arrow(axes, (place, low), (place, high), color=ORANGE, arrowstyle="<|-|>")
    axes.text(
        place + (0.62 if depth > 0 else 0.1),
        0.3 if depth > 0 else (low + high) / 2,
        "$h(r)$",
        color=ORANGE,
        va="center",
    )
    arrow(axes, (0.0, -1.95), (place, -1.95), color=GREY)
    axes.text(place + 0.12, -1.95, "$r$", color=GREY, va="center")
    # What the machine does to the sphere.
    top = sphere.max()
    begin, end = (top + 0.05, top + 1.0) if pulled else (top + 1.0, top + 0.05)
    arrow(
        axes,
        (0.0, begin),
        (0.0, end),
        color=VERMILION,
        linewidth=2.2,
        mutation_scale=14,
    )
    words = "$P>0$: tension" if pulled else "$P<0$: compression"
    axes.text(0.2, top + 0.6, words, color=VERMILION, va="center")
    axes.text(
        0.0,
        top - 0.45,
        "rigid sphere, radius $R$",
        ha="center",
        va="center",
        color=GREY,
    )
    axes.annotate(
        "$h_0$",
        (0.0, bottom - SPACING / 2),
        (-1.5, bottom - SPACING / 2 - 0.35) if depth > 0 else (-0.55, -0.35),
        color=GREY,
        va="center",
        ha="right",
        arrowprops={
            "arrowstyle": "-",
            "color": GREY,
            "linewidth": 0.7,
            "shrinkA": 1,
            "shrinkB": 0,
        },
    )
    axes.text(-4.2, -2.2, "soft half-space", color=GREY, va="center")
    if pulled:
        axes.text(4.2, -0.12, "undeformed\nsurface", color=GREY, va="top", ha="right")
    axes.set(xlim=(-WIDTH, WIDTH), ylim=(-2.4, 4.2), aspect="equal")
    axes.axis("off")


def main(path: Path = PICTURE) -> None:
    """Draw both states beside each other."""
    # Letters as outlines and a fixed salt: the same picture everywhere.
    with mpl.rc_context(
        {"svg.fonttype": "path", "svg.hashsalt": "quantities", "font.size": 10.5}
    ):
        figure = Figure(figsize=(9.0, 3.6), layout="constrained")
        pressed, pulled = figure.subplots(1, 2)
        draw(pressed, depth=1.1, contact=1.75, pulled=False)
        draw(pulled, depth=-0.55, contact=0.85, pulled=True)
        figure.savefig(
            path, metadata={"Date": None} if path.suffix == ".svg" else None, dpi=110
        )


if __name__ == "__main__":
    main(*(Path(word) for word in sys.argv[1:2]))

"""Figure 1: the contact, the components of the gap, the protocol, and a computed force response.

Panels (a) and (b) are sketches. Panels (c) and (d) show the protocol and the force of the trajectory of figure 3.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from paper_figures.style import drawing, schematics

SUBSTRATE, SPHERE = "#dfeaf2", "#e9e4dc"
WIDTH, HEIGHT = 10.0, 7.4


def surface(x: np.ndarray, contact: float, radius: float, depth: float) -> np.ndarray:
    """Height of the sketched surface: the sphere inside the contact, and a decaying neck outside it; shape of `x`."""
    sphere = radius - np.sqrt(radius**2 - np.minimum(np.abs(x), contact) ** 2) - depth
    return sphere * np.exp(-np.maximum(np.abs(x) - contact, 0.0) / 0.35)


def draw_contact(axes: Axes) -> None:
    """Panel (a): sphere, half-space, and motion of the sphere."""
    schematics.blank(axes, WIDTH, HEIGHT)
    centre, level, radius = 5.0, 3.4, 3.0
    x = np.linspace(0.0, WIDTH, 400)
    depth = 0.75
    top = level + surface(x - centre, 1.75, radius, depth)
    outline = [(x[0], 0.0), *np.column_stack([x, top]), (x[-1], 0.0)]
    axes.add_patch(Polygon(outline, facecolor=SUBSTRATE, edgecolor="none"))
    axes.plot(x, top, color="0.3", linewidth=1.0)
    bottom = level - depth + 0.04
    axes.add_patch(Circle((centre, bottom + radius), radius, facecolor=SPHERE, edgecolor="0.3", lw=1.0, zorder=2))
    schematics.arrow(axes, (centre, bottom + radius), (centre + radius * 0.94, bottom + radius * 0.66), zorder=3)
    axes.text(centre + 1.5, bottom + radius - 0.35, "$R$", zorder=4)
    axes.text(centre, bottom + 1.0, "rigid sphere", ha="center", zorder=4)
    axes.text(centre, 0.55, "adhesive viscoelastic half-space", ha="center")
    down, up = {"color": drawing.BLUE}, {"color": drawing.GREEN}
    schematics.arrow(axes, (0.9, 6.9), (0.9, 5.3), lw=1.4, **down)
    axes.text(1.15, 6.0, "$v_L$", **down)
    schematics.arrow(axes, (9.1, 5.3), (9.1, 6.9), lw=1.4, **up)
    axes.text(8.85, 6.0, "$v_U$", ha="right", **up)
    schematics.line(axes, (0.0, level), (WIDTH, level), linestyle=":", linewidth=0.6)


def draw_gap(axes: Axes) -> None:
    """Panel (b): the components of the gap at a radius, h = -delta + h0 + r^2 / (2 R) + u."""
    schematics.blank(axes, WIDTH, HEIGHT)
    level, foot, at = 4.2, 1.0, 6.6
    radius = np.linspace(0.0, 8.4, 200)
    profile = 0.075 * radius**2
    depth, spacing = 2.2, 0.55
    dent = 2.0 * np.exp(-((radius / 4.6) ** 2))
    sphere = level - depth + spacing + profile
    x = foot + radius
    axes.add_patch(Polygon([(foot, 0.0), *np.column_stack([x, level - dent]), (x[-1], 0.0)], facecolor=SUBSTRATE))
    axes.plot(x, level - dent, color="0.3", linewidth=1.0)
    axes.plot(x[sphere < HEIGHT], sphere[sphere < HEIGHT], color="0.3", linewidth=1.0)
    schematics.line(axes, (foot, 0.2), (foot, HEIGHT - 0.2), linestyle="-.", linewidth=0.6)
    schematics.line(axes, (foot - 0.4, level), (9.8, level), linestyle=":", linewidth=0.7)
    lowest = level - depth + spacing
    schematics.line(axes, (foot - 0.4, level - depth), (foot + 0.9, level - depth), linestyle=":", linewidth=0.7)
    schematics.line(axes, (foot, lowest), (at + 0.3, lowest), linestyle=":", linewidth=0.7)

    def measure(
        across: float, low: float, high: float, text: str, color: str, side: float = 0.12, share: float = 0.5
    ) -> None:
        schematics.arrow(axes, (across, low), (across, high), arrowstyle="<|-|>", color=color, mutation_scale=5)
        ha = "left" if side > 0 else "right"
        axes.text(across + side, low + share * (high - low), text, color=color, va="center", ha=ha, fontsize=7.5)

    measure(foot - 0.25, level - depth, level, r"$\delta$", drawing.BLUE, -0.12)
    measure(foot + 0.35, level - depth, lowest, "", drawing.ORANGE)
    axes.text(foot + 0.35, level - depth - 0.08, "$h_0$", color=drawing.ORANGE, va="top", ha="center", fontsize=7.5)
    rise = float(np.interp(at - foot, radius, profile))
    measure(at, lowest, lowest + rise, r"$r^2/(2R)$", drawing.GREEN, share=0.85)
    measure(
        at - 1.9, level - float(np.interp(at - 1.9 - foot, radius, dent)), level, "$u_z$", drawing.VIOLET, -0.12, 0.8
    )
    across = at - 0.75
    gap = float(np.interp(across - foot, x - foot, sphere))
    ground = level - float(np.interp(across - foot, radius, dent))
    measure(across, ground, gap, "$h$", drawing.RED, 0.1, 0.3)
    schematics.arrow(axes, (foot, 0.55), (at, 0.55), color="0.3")
    axes.text(0.5 * (foot + at), 0.75, "$r$", ha="center")
    axes.text(foot + 0.2, HEIGHT - 0.7, r"$h=-\delta+h_0+r^2/(2R)+u_z$", fontsize=7.5)


def draw_protocol(axes: Axes, example: dict[str, Any]) -> None:
    """Panel (c): indentation over time."""
    times = example["phase_times"]
    depths = np.interp(times, example["native"]["time"], example["native"]["indentation"])
    for begin, color in enumerate(drawing.PHASES.values()):
        axes.plot(times[begin : begin + 2], depths[begin : begin + 2], color=color, linewidth=1.6)
    drawing.zero_line(axes)
    axes.set_xticks(times, [rf"$\hat t_{index}$" for index in range(4)])
    axes.set_yticks([depths[0], 0.0, depths[1]], [r"$\hat\delta_0$", "0", r"$\hat\delta_l$"])
    for index, (name, color) in enumerate(drawing.PHASES.items()):
        middle = 0.5 * (times[index] + times[index + 1])
        height = 0.5 * (depths[index] + depths[index + 1])
        text = {"loading": r"$\hat v_L$", "dwell": r"$\hat t_D$", "unloading": r"$\hat v_U$"}[name]
        offset, ha = ((0, 4), "center") if name == "dwell" else ((-5 if name == "loading" else 5, 2), None)
        ha = ha or ("right" if name == "loading" else "left")
        drawing.note(axes, text, (middle, height), offset, color=color, ha=ha, fontsize=8)
    axes.margins(y=0.14)
    axes.set(xlabel=drawing.TIME, ylabel=drawing.INDENTATION)


def draw_force(axes: Axes, example: dict[str, Any]) -> None:
    """Panel (d): the computed force, coloured by phase, with pull-off and largest compression."""
    time, force = (np.array(example["native"][name]) for name in ("time", "force"))
    results = example["results"]
    drawing.by_phase(axes, time, force, example["phase_times"])
    drawing.zero_line(axes)
    peak, low = (results["pull_off_time"], results["pull_off_force"]), int(np.argmin(force))
    axes.plot(*peak, "o", color=drawing.RED)
    axes.plot(time[low], force[low], "s", color=drawing.BLACK)
    drawing.note(axes, r"$\hat P_\mathrm{po}$", peak, (-4, 5), ha="right", color=drawing.RED)
    drawing.note(axes, r"$\hat P_\mathrm{mc}$", (time[low], force[low]), (7, -3))
    axes.plot([peak[0], peak[0]], [force[low], peak[1]], color=drawing.RED, linestyle=":", linewidth=0.8)
    drawing.note(axes, r"$\hat t_\mathrm{po}$", (peak[0], force[low]), (3, 0), color=drawing.RED)
    axes.margins(y=0.14)
    axes.set(xlabel=drawing.TIME, ylabel=drawing.FORCE)


def compose(dataset_examples: Any) -> Figure:
    """Draw figure 1."""
    example = dataset_examples["mapping"]
    drawn, panels = drawing.panels(2, 2, height_ratios=(1.15, 1.0), height=5.4)
    draw_contact(panels[0])
    draw_gap(panels[1])
    draw_protocol(panels[2], example)
    draw_force(panels[3], example)
    return drawn

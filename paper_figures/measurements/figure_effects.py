"""Figure: one path of the sphere under seven scenes, what each effect costs, and the error of simpler scenes.

The figure reads the measurements of `experiments.measurements.effects` and `experiments.measurements.effect_pairs`.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing

STYLES = {
    "Hertz": ("0.5", "-"),
    "DMT-like": (drawing.SKY, "-"),
    "JKR-like": (drawing.VIOLET, "-"),
    "rubbery": (drawing.GREEN, "-"),
    "glassy": (drawing.BLUE, "-"),
    "one relaxation": (drawing.RED, "-"),
    "ten relaxations": (drawing.ORANGE, "-"),
    "no adhesion": (drawing.RED, ":"),
}
BANDS = {name: color for name, (color, _) in STYLES.items()} | {
    "all effects": "0.8",
    "glassy, no adhesion": drawing.BLACK,
}
"""The colours of what is recommended; an elastic limit has that of its curve."""
TOLERANCE = {"color": "0.4", "linewidth": 0.8, "linestyle": (0, (5, 3))}
LABELS = {
    "DMT-like": r"DMT-like ($\mu=0.2$)",
    "JKR-like": r"JKR-like ($\mu=3.2$)",
    "rubbery": r"rubbery ($\mu=1$)",
    "glassy": r"glassy",
}


def draw_curves(axes: Axes, curves: list[dict[str, Any]]) -> None:
    """Draw the force over the indentation for all scenes."""
    drawing.zero_line(axes)
    for curve in curves:
        color, line = STYLES[curve["name"]]
        label = LABELS.get(curve["name"], curve["name"])
        axes.plot(curve["depth"], curve["force"], color=color, linestyle=line, label=label)
    axes.set_xlabel(r"indentation $\hat\delta/\mu$")
    axes.set_ylabel(drawing.FORCE)
    # Shows the tension of an elastic contact and the large compression of a glassy one on one axis.
    axes.set_yscale("asinh", linear_width=1.0)
    ticks = (-30, -10, -3, -1, 0, 1, 3, 6)
    axes.set_yticks(ticks, labels=[drawing.written(tick) for tick in ticks])
    axes.minorticks_off()
    below(axes)


def draw_ladder(axes: Axes, effect_pairs: dict[str, Any]) -> None:
    """Draw the milliseconds of every scene, one row each, a point for each Tabor parameter."""
    scenes = sorted(effect_pairs["scenes"], key=lambda scene: -max(scene["seconds"]))
    rows = range(len(scenes))
    for number, tabor in enumerate(effect_pairs["tabor"]):
        shade = str(0.75 - 0.75 * number / (len(effect_pairs["tabor"]) - 1))
        milliseconds = [1e3 * scene["seconds"][number] for scene in scenes]
        axes.plot(milliseconds, rows, "o", color=shade, markersize=3, label=rf"$\mu={tabor:g}$")
    axes.set_yticks(rows, labels=[scene["name"] for scene in scenes])
    axes.set(xscale="log", xlabel="processor time of a simulation (ms)")
    axes.grid(axis="y", color="0.9", linewidth=0.5)
    below(axes)


def draw_stand_ins(axes: Axes, effects: dict[str, Any]) -> None:
    """Draw the error of each simpler scene over the rate, the tolerance, and the recommendation along the top."""
    points = effects["stand_ins"]
    rates = [point["rate"] for point in points]
    for name in points[0]["errors"]:
        color, line = STYLES[name]
        errors = [100.0 * point["errors"][name] for point in points]
        axes.plot(rates, errors, color=color, linestyle=line, marker=".", label=LABELS.get(name, name).split(" (")[0])
    axes.axhline(100.0 * effects["tolerance"], **TOLERANCE)
    axes.set(xscale="log", yscale="log", xlabel=r"rate $\hat v/\mu$", ylabel=r"rms $\Delta\hat P$ / range (%)")
    axes.set_ylim(0.08, 1.5e3)
    edges = np.sqrt(np.array(rates)[1:] * np.array(rates)[:-1])
    begin = rates[0]
    for i, point in enumerate(points):
        last = i == len(points) - 1
        if last or points[i + 1]["recommended"] != point["recommended"]:
            end = rates[-1] if last else edges[i]
            name = point["recommended"].removeprefix("elastic ").removesuffix(", adhesive").replace("without", "no")
            name = {"viscoelastic": "all effects", "viscoelastic, no adhesion": "no adhesion"}.get(name, name)
            color = BANDS.get(name, "0.5")
            axes.axvspan(begin, end, ymin=0.94, ymax=1.0, color=color, linewidth=0, label=f"calls for: {name}")
            begin = end
    axes.text(rates[-1], 110.0 * effects["tolerance"], "tolerance", ha="right", va="bottom", color="0.4")
    below(axes)


def draw_ranges(axes: Axes, effects: dict[str, Any]) -> None:
    """Draw the error of the DMT-like and the JKR-like scene over the Tabor parameter of the full scene."""
    points = effects["ranges"]
    tabors = [point["tabor"] for point in points]
    for name in ("DMT-like", "JKR-like"):
        for solid, line in (("elastic", "-"), ("one relaxation", ":")):
            errors = [100.0 * point[f"{name}, {solid}"] for point in points]
            label = name if solid == "elastic" else None
            axes.plot(tabors, errors, line, color=STYLES[name][0], marker=".", label=label)
    axes.axhline(100.0 * effects["tolerance"], **TOLERANCE)
    axes.set(xscale="log", yscale="log", xlabel=r"Tabor parameter $\mu$", ylabel=r"rms $\Delta\hat P$ / range (%)")
    axes.plot([], [], "-", color="0.4", label="elastic")
    axes.plot([], [], ":", color="0.4", label="one relaxation")
    axes.plot([], [], label="tolerance", **TOLERANCE)
    below(axes)


def below(axes: Axes) -> None:
    """The legend of a panel below it, where it covers no curve."""
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), ncol=2, columnspacing=1.0)


def compose(effects: Any, effect_pairs: Any) -> Figure:
    """Draw the figure."""
    drawn, panels = drawing.panels(2, 2, height=6.4)
    draw_curves(panels[0], effects["curves"])
    draw_ladder(panels[1], effect_pairs)
    draw_stand_ins(panels[2], effects)
    draw_ranges(panels[3], effects)
    return drawn

"""Plot of one trajectory: the history of the force, or of the indentation under a prescribed force, and the loop.

A trajectory of `bem` and a curve in SI units are drawn alike. `COLOURS` is the one map of colours for all pictures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.validation import FloatArray
from bem.results.profiles import places_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {
    "solver": "#000000",
    "draft": "#6E6E6E",
    "closed form": "#909090",
    "paper": "#AA0044",
    "fast": "#2299BB",
    "accurate": "#6622CC",
    "M1": "#115599",
    "M2": "#DD0000",
    "M3": "#66AA55",
    "M4": "#AA33EE",
    "M5": "#EE9900",
    "M6": "#11CCEE",
    "Adhesion": "#AA6633",
    "tamaas": "#33BB22",
}
"""One colour a tool, in all pictures; readers who see no red, no green or no blue tell apart those that meet."""
PULL_OFF, JUMP, ZERO = COLOURS["M2"], COLOURS["M3"], {"color": "0.8", "linewidth": 0.8}

FORCE_LABEL = r"force $P/(\pi R \Delta\gamma)$, tension positive"
TIME_LABEL = r"time $t/\tau$"
INDENTATION_LABEL = r"indentation $\delta/h_0$"
STRETCHED = " (scale differs by phase)"
MOST_FORCES = 4
"""Forces or indentations named in a title, which has to fit over the picture."""
POINTS_BETWEEN = 7
"""Points drawn between two records."""


@dataclass(frozen=True)
class Top:
    """The largest tension of a curve: where it is, what is written beside it, and whether the contact let go there."""

    time: float
    indentation: float
    force: float
    label: str
    detached: bool


@dataclass(frozen=True)
class Line:
    """One curve of a picture: arrays (n,), the tool that it is of, and the band of its force."""

    time: FloatArray
    indentation: FloatArray
    force: FloatArray
    label: str = ""
    colour: str = COLOURS["solver"]
    band: tuple[FloatArray, FloatArray] | None = None
    """Lower and upper end (n,); not drawn where it is not finite."""
    coverage: float | None = None
    """Share of true forces that the band is to contain."""
    dashed: bool = False


def draw_curve(
    lines: Sequence[Line],
    corners: FloatArray,
    labels: Mapping[str, str],
    *,
    over_time: str = "force",
    top: Top | None = None,
    jumps: Sequence[tuple[Sequence[float], Sequence[float]]] = (),
    units: Callable[[str], Any] | None = None,
) -> Figure:
    """Draw force, or indentation, against time, and force against indentation.

    Args:
        lines: one or several, over the same time; of those with a label there is a legend.
        corners: instants (s,) at which the phases begin, and the end.
        labels: of time, indentation and force.
        over_time: "force" or "indentation".
        top: what is marked.
        jumps: indentation and force before and after each.
        units: formatter of an axis by the name of its quantity; plain numbers by default.

    Returns:
        a new figure.
    """
    # Drawing without a display, and without touching a caller's pyplot state.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    history, loop = figure.subplots(1, 2, sharey=over_time == "force")
    places, compared = places_of(corners), any(line.dashed for line in lines)
    for axes, up in ((history, over_time), (loop, "force")):
        axes.axhline(0.0, **ZERO)
        for line in lines:
            across = line.indentation if axes is loop else np.interp(line.time, corners, places)
            # Wide and light, so that a line shows beside dashes where the two agree.
            style: dict[str, Any] = {"linewidth": 2.5, "alpha": 0.6} if compared else {"linewidth": 1.2}
            if line.dashed:
                style = {"linestyle": "--", "linewidth": 1.0}
            axes.plot(across, getattr(line, up), color=line.colour, label=line.label or None, **style)
            if up == "force" and line.band is not None and np.all(np.isfinite(line.band)):
                named = {"label": f"{100.0 * line.coverage:g} % band"} if line.coverage else {}
                axes.fill_between(across, *line.band, color=line.colour, alpha=0.3, linewidth=0.0, **named)
        axes.margins(y=0.1)
        if not (axes is loop and over_time == "force"):  # which then shares the axis of the history
            axes.set_ylabel(labels[up])
        axes.spines[["top", "right"]].set_visible(False)
        if units:
            axes.yaxis.set_major_formatter(units(up))
    loop.set_xlabel(labels["indentation"])
    history.set_xlabel(labels["time"])
    if units:
        loop.xaxis.set_major_formatter(units("indentation"))
        loop.locator_params(axis="x", nbins=5)  # labels with units are wide
    if top is not None:
        at = float(np.interp(top.time, corners, places))
        for axes, *position in ((history, at, getattr(top, over_time)), (loop, top.indentation, top.force)):
            axes.plot(*position, "o" if top.detached else "", color=PULL_OFF, markersize=5)
        # The label lies inside the axes also where the contact is pulled off at their left end.
        labelled, anchor = (history, (at, top.force)) if over_time == "force" else (loop, (top.indentation, top.force))
        left, right = labelled.get_xlim()
        leftmost = anchor[0] - left < 0.4 * (right - left)
        style = {
            "xytext": (8 if leftmost else -8, 6 if top.force > 0.0 else -16),
            "textcoords": "offset points",
            "color": PULL_OFF,
        }
        labelled.annotate(top.label, anchor, ha="left" if leftmost else "right", **style)
    for number, jump in enumerate(jumps):
        loop.plot(*jump, ":", color=JUMP, linewidth=2.0, label=None if number else "jump")
    if loop.get_legend_handles_labels()[0]:
        loop.legend(frameon=False)
    mark_phases(history, corners, units("time") if units else None)
    return figure


def draw_trajectory(trajectory: Any, title: str = "") -> Figure:
    """Draw force, or indentation where the force is prescribed, against time; and force against indentation.

    Args:
        trajectory: a `bem.Trajectory`, which knows this picture; the picture knows no more of it than what it draws.
        title: of the figure.

    Returns:
        a new figure.

    Raises:
        ValueError: when the trajectory is empty.
    """
    if trajectory.time.size == 0:
        raise ValueError(f"a plot needs a trajectory that was started; received status {trajectory.status!r}")
    jumps = []
    for jump in trajectory.jumps:
        after = jump.indentation_after if math.isfinite(jump.indentation_after) else jump.indentation
        jumps.append(([jump.indentation, after], [jump.force_before, jump.force_after]))
    figure = draw_curve(
        [line_of(trajectory)],
        trajectory.corners,
        labels_of(trajectory.corners),
        over_time="indentation" if trajectory.by_force else "force",
        top=top_of(trajectory),
        jumps=jumps,
    )
    if title:
        figure.suptitle(title, fontsize=10)
    return figure


def line_of(trajectory: Any) -> Line:
    """The line of a `bem.Trajectory`; of a predicted one with the model's name and colour, and the band if it has one.

    Args:
        trajectory: with the band `force_lower` and `force_upper`, or without.

    Returns:
        its line, between the records as `smooth` has it.
    """
    time, indentation, force = smooth(trajectory)
    model, band = getattr(trajectory, "model", ""), None
    if getattr(trajectory, "force_lower", None) is not None:
        lower, upper = (
            force + np.interp(time, trajectory.time, end - trajectory.force)
            for end in (trajectory.force_lower, trajectory.force_upper)
        )
        band = lower, upper
    return Line(time, indentation, force, model, colour_of(model), band, getattr(trajectory, "coverage", None))


def colour_of(model: str) -> str:
    """Colour of a tool or model by its name, such as M1-concat; that of the solver for others."""
    return COLOURS.get(model.partition("-")[0], COLOURS["solver"])


def top_of(trajectory: Any) -> Top | None:
    """The pull-off of a `bem.Trajectory`, or its largest tension while unloading; `None` where it is not pulled."""
    if not trajectory.pull_off_force > 0.0:
        return None
    at, largest = trajectory.pull_off_time, trajectory.pull_off_force
    depth = float(trajectory.indentation[trajectory.time.searchsorted(at)])
    return Top(at, depth, largest, f"{top_label(trajectory.detached)} {largest:.4g}", trajectory.detached)


def top_label(detached: bool | None) -> str:
    """What the largest tension of a contact is called that let go, that did not, or of which that is not known."""
    return {True: "pull-off", False: "not detached; largest tension", None: "largest tension"}[detached]


def labels_of(corners: FloatArray) -> dict[str, str]:
    """Labels of the axes of time, with the places of `bem.results.profiles.places_of`, of indentation and of force."""
    time = TIME_LABEL + STRETCHED * (len(corners) > 2)
    return {"time": time, "indentation": INDENTATION_LABEL, "force": FORCE_LABEL}


def title_of(scene: Any, protocol: Any) -> str:
    """Scene and protocol, a line for each."""
    name = type(scene.material).__name__
    material = {"StandardLinearSolid": "standard linear solid", "PronySeries": "Prony series"}.get(name, name.lower())
    if name != "Elastic":
        material += f" of modulus ratio {scene.material.modulus_ratio:g}"
    contact = f"Tabor parameter {scene.tabor:g}, {material}"
    if not hasattr(protocol, "peak_indentation"):
        control = "forces" if hasattr(protocol, "forces") else "indentations"
        values = [
            f"{value:g} at {time:g}" for time, value in zip(protocol.times, getattr(protocol, control), strict=True)
        ]
        more = f", ... ({len(values)} in all)" if len(values) > MOST_FORCES else ""
        return f"{contact}\n{control} {', '.join(values[:MOST_FORCES])}{more}"
    return (
        f"{contact}\nindented to {protocol.peak_indentation:g} at rate "
        f"{protocol.loading_rate:g}, held for {protocol.dwell_time:g}, unloaded at rate {protocol.unloading_rate:g}"
    )


def mark_phases(axes: Any, corners: FloatArray, written: Callable[[float], str] | None = None) -> None:
    """Give an axis of time the instants at which the phases begin, some of many; of a single phase round ones.

    Args:
        axes: with its curves and labels, whose layout decides which texts would overlap; these are left out.
        corners: instants (s,) at which the phases begin, and the end.
        written: formatter of an instant; plain numbers by default.
    """
    from matplotlib.ticker import MaxNLocator

    shown = corners[:: -(-len(corners) // 9)]
    if len(corners) == 2:  # one phase, to scale
        ticks = MaxNLocator(5).tick_values(*corners)
        shown = ticks[(ticks >= corners[0]) & (ticks <= corners[1])]
    at, texts = np.interp(shown, corners, places_of(corners)), _texts(shown, written or "{:.12g}".format)
    axes.set_xticks(at, texts)
    axes.figure.draw_without_rendering()
    boxes, kept = [label.get_window_extent().padded(2.0, 0.0) for label in axes.get_xticklabels()], list[int]()
    for number in (len(at) - 1, *range(len(at) - 1)):
        if not any(boxes[number].overlaps(boxes[earlier]) or texts[number] == texts[earlier] for earlier in kept):
            kept.append(number)
    axes.set_xticks(at, [text if number in kept else "" for number, text in enumerate(texts)])
    axes.grid(axis="x", color="0.9", linewidth=0.8)


def _texts(values: FloatArray, written: Callable[[float], str]) -> list[str]:
    """Increasing values with as many digits, three at least, as leave of the steps between them what they are."""
    steps, texts = np.diff(values), []
    for value, step in zip(values, np.minimum(np.append(steps, np.inf), np.insert(steps, 0, np.inf)), strict=True):
        rounded = (float(f"{value:.{digits}g}") for digits in range(3, 17))
        texts.append(written(next((number for number in rounded if abs(number - value) <= 0.25 * step), float(value))))
    return texts


def smooth(trajectory: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, indentation and force with points between the records, by the interpolation of `Trajectory.at`.

    Args:
        trajectory: a `bem.Trajectory` of n records.

    Returns:
        three arrays of shape (n + `POINTS_BETWEEN` (n - 1),); within a jump the force is NaN.
    """
    time, share = trajectory.time, np.arange(1, POINTS_BETWEEN + 1) / (POINTS_BETWEEN + 1)
    between = (time[:-1, None] + share * np.diff(time)[:, None]).ravel()
    rows = np.repeat(np.arange(1, len(time)), POINTS_BETWEEN)
    indentation = (trajectory.indentation[:-1, None] + share * np.diff(trajectory.indentation)[:, None]).ravel()
    # Between the two records of a jump the line breaks.
    jumped = np.repeat(np.diff(time) == 0.0, POINTS_BETWEEN)
    force = np.where(jumped, np.nan, trajectory.at(between))
    return (
        np.insert(time, rows, between),
        np.insert(trajectory.indentation, rows, indentation),
        np.insert(trajectory.force, rows, force),
    )

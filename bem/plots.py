"""Plot of one trajectory: the history of the force, or of the indentation under a prescribed force, and the loop.

A trajectory of `bem` and a curve in SI units are drawn alike. `COLOURS` is the one map of colours for all pictures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bem._support.validation import FloatArray
from bem.profiles import places_of

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
STRETCHED = ", each phase to a scale of its own"
POINTS_BETWEEN = 7
"""Points drawn between two records."""


class Top(NamedTuple):
    """The largest tension of a curve: where it is, what is written beside it, and whether the contact let go there."""

    time: float
    indentation: float
    force: float
    words: str
    detached: bool


def draw_curve(
    curve: Mapping[str, FloatArray],
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
        curve: time, indentation and force of the line, each (n,).
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
    places = places_of(corners)
    for axes, across, up in ((history, np.interp(curve["time"], corners, places), over_time), (loop, None, "force")):
        axes.axhline(0.0, **ZERO)
        axes.plot(curve["indentation"] if across is None else across, curve[up], color=COLOURS["solver"], linewidth=1.2)
        axes.margins(y=0.1)
        if not (axes is loop and over_time == "force"):  # which then shares the axis of the history
            axes.set_ylabel(labels[up])
        axes.spines[["top", "right"]].set_visible(False)
        if units:
            axes.yaxis.set_major_formatter(units(up))
    loop.set_xlabel(labels["indentation"])
    history.set_xlabel(labels["time"])
    mark_phases(history, corners, units("time") if units else None)
    if units:
        loop.xaxis.set_major_formatter(units("indentation"))
        loop.locator_params(axis="x", nbins=5)  # labels with units are wide
    if top is not None:
        at = float(np.interp(top.time, corners, places))
        for axes, *position in ((history, at, getattr(top, over_time)), (loop, top.indentation, top.force)):
            axes.plot(*position, "o" if top.detached else "", color=PULL_OFF, markersize=5)
        # The label lies inside the axes also where the contact is pulled off at their left end.
        labelled, place = (history, (at, top.force)) if over_time == "force" else (loop, (top.indentation, top.force))
        left, right = labelled.get_xlim()
        leftmost = place[0] - left < 0.4 * (right - left)
        style = {"xytext": (8 if leftmost else -8, 6), "textcoords": "offset points", "color": PULL_OFF}
        labelled.annotate(top.words, place, ha="left" if leftmost else "right", **style)
    for number, jump in enumerate(jumps):
        loop.plot(*jump, ":", color=JUMP, linewidth=2.0, label=None if number else "jump")
    if jumps:
        loop.legend(frameon=False)
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
    top = None
    if trajectory.pull_off_force > 0.0:
        at, largest = trajectory.pull_off_time, trajectory.pull_off_force
        words = f"{'pull-off' if trajectory.detached else 'not detached; largest tension'} {largest:.4g}"
        depth = float(trajectory.indentation[trajectory.time.searchsorted(at)])
        top = Top(at, depth, largest, words, trajectory.detached)
    jumps = []
    for jump in trajectory.jumps:
        after = jump.indentation_after if math.isfinite(jump.indentation_after) else jump.indentation
        jumps.append(([jump.indentation, after], [jump.force_before, jump.force_after]))
    figure = draw_curve(
        dict(zip(("time", "indentation", "force"), smooth(trajectory), strict=True)),
        trajectory.corners,
        {"time": phases_label(trajectory), "indentation": INDENTATION_LABEL, "force": FORCE_LABEL},
        over_time="indentation" if trajectory.by_force else "force",
        top=top,
        jumps=jumps,
    )
    if title:
        figure.suptitle(title, fontsize=10)
    return figure


def phases_label(trajectory: Any) -> str:
    """Label of an axis of time with the places of `bem.profiles.axis_of_phases`."""
    return TIME_LABEL + STRETCHED * (len(trajectory.corners) > 2)


def mark_phases(axes: Any, corners: FloatArray, written: Callable[[float], str] | None = None) -> None:
    """Give an axis of time the instants at which the phases begin, some of many; of a single phase round ones."""
    from matplotlib.ticker import MaxNLocator

    shown = corners[:: -(-len(corners) // 9)]
    if len(corners) == 2:  # one phase, to scale
        ticks = MaxNLocator(5).tick_values(*corners)
        shown = ticks[(ticks >= corners[0]) & (ticks <= corners[1])]
    texts = [f"{one:.3g}" for one in shown]
    axes.set_xticks(
        np.interp(shown, corners, places_of(corners)), [written(float(text)) for text in texts] if written else texts
    )
    axes.grid(axis="x", color="0.9", linewidth=0.8)


def smooth(trajectory: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, indentation and force with points between the records, by the interpolation of `Trajectory.at`.

    Args:
        trajectory: a `bem.Trajectory` of n records.

    Returns:
        three arrays of shape (n + `POINTS_BETWEEN` (n - 1),); within a jump the force is NaN.
    """
    time, share = trajectory.time, np.arange(1, POINTS_BETWEEN + 1) / (POINTS_BETWEEN + 1)
    between = (time[:-1, None] + share * np.diff(time)[:, None]).ravel()
    place = np.repeat(np.arange(1, len(time)), POINTS_BETWEEN)
    indentation = (trajectory.indentation[:-1, None] + share * np.diff(trajectory.indentation)[:, None]).ravel()
    # Between the two records of a jump the line breaks.
    jumped = np.repeat(np.diff(time) == 0.0, POINTS_BETWEEN)
    force = np.where(jumped, np.nan, trajectory.at(between))
    return (
        np.insert(time, place, between),
        np.insert(trajectory.indentation, place, indentation),
        np.insert(trajectory.force, place, force),
    )

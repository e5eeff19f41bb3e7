"""Plot of one trajectory: the history of the force, or of the indentation under a prescribed force, and the loop."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bem.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORCE_LABEL = r"force $P/(\pi R \Delta\gamma)$, tension positive"
INDENTATION_LABEL = r"indentation $\delta/h_0$"
POINTS_BETWEEN = 7
"""Points drawn between two records."""


def plot_trajectory(trajectory: Trajectory, path: str | Path, title: str = "") -> None:
    """Draw a trajectory as `draw_trajectory` into an image file; the suffix chooses the format.

    Raises:
        ValueError: when the trajectory is empty or the format is unknown.
    """
    draw_trajectory(trajectory, title).savefig(path, dpi=150)


def draw_trajectory(trajectory: Trajectory, title: str = "") -> Figure:
    """Draw force, or indentation where the force is prescribed, against time; and force against indentation.

    Raises:
        ValueError: when the trajectory is empty.
    """
    if trajectory.time.size == 0:
        raise ValueError(f"a plot needs a trajectory that was started; received status {trajectory.status!r}")
    # Drawing without a display, and without touching a caller's pyplot state.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    history, loop = figure.subplots(1, 2, sharey=not trajectory.by_force)
    time, indentation, force = _smooth(trajectory)
    for axes, values, shown, label in (
        (history, time, indentation if trajectory.by_force else force, r"time $t/\tau$"),
        (loop, indentation, force, INDENTATION_LABEL),
    ):
        axes.axhline(0.0, color="0.8", linewidth=0.8)
        axes.plot(values, shown, color="#0072B2", linewidth=1.4)
        axes.margins(y=0.1)
        axes.set_xlabel(label)
        axes.spines[["top", "right"]].set_visible(False)
    history.set_ylabel(INDENTATION_LABEL if trajectory.by_force else FORCE_LABEL)
    if trajectory.by_force:
        loop.set_ylabel(FORCE_LABEL)
    if trajectory.completed and trajectory.unloading.any():
        at = trajectory.pull_off_time
        depth = float(trajectory.indentation[trajectory.time.searchsorted(at)])
        largest = trajectory.pull_off_force
        for axes, *position in ((history, at, depth if trajectory.by_force else largest), (loop, depth, largest)):
            axes.plot(*position, "o", color="#D55E00", markersize=5)
        # The label lies inside the axes also where the contact is pulled off at their left end.
        labelled, place = (loop, (depth, largest)) if trajectory.by_force else (history, (at, largest))
        left, right = labelled.get_xlim()
        leftmost = place[0] - left < 0.4 * (right - left)
        labelled.annotate(
            f"pull-off {largest:.4g}",
            place,
            xytext=(8 if leftmost else -8, 6),
            textcoords="offset points",
            ha="left" if leftmost else "right",
            color="#D55E00",
        )
    for number, jump in enumerate(trajectory.jumps):
        after = jump.indentation_after if math.isfinite(jump.indentation_after) else jump.indentation
        loop.plot(
            [jump.indentation, after],
            [jump.force_before, jump.force_after],
            ":",
            color="#009E73",
            linewidth=2.0,
            label="jump" if number == 0 else None,
        )
    if trajectory.jumps:
        loop.legend(frameon=False)
    if title:
        figure.suptitle(title, fontsize=10)
    return figure


def _smooth(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, indentation and force with points between the records, by the interpolation of `Trajectory.at`."""
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

"""Plot of one trajectory: the force history and the force-indentation loop."""

from __future__ import annotations

import math
from pathlib import Path

from bem.trajectory import Trajectory

FORCE_LABEL = r"force $P/(\pi R \Delta\gamma_0)$, tension positive"


def plot_trajectory(trajectory: Trajectory, path: str | Path, title: str = "") -> None:
    """Draw force against time and against indentation into an image file; the suffix chooses the format.

    Raises:
        ValueError: when the trajectory is empty or the format is unknown.
    """
    if trajectory.time.size == 0:
        raise ValueError(f"a plot needs a trajectory that was started; received status {trajectory.status!r}")
    # Drawing without a display, and without touching a caller's pyplot state.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    history, loop = figure.subplots(1, 2, sharey=True)
    for axes, values, label in (
        (history, trajectory.time, r"time $t/\tau$"),
        (loop, trajectory.indentation, r"indentation $\delta/h_0$"),
    ):
        axes.axhline(0.0, color="0.8", linewidth=0.8)
        axes.plot(values, trajectory.force, color="#0072B2", linewidth=1.4)
        axes.set_xlabel(label)
        axes.spines[["top", "right"]].set_visible(False)
    history.set_ylabel(FORCE_LABEL)
    if trajectory.completed and trajectory.unloading.any():
        at = trajectory.pull_off_time
        depth = float(trajectory.indentation[trajectory.time.searchsorted(at)])
        for axes, position in ((history, at), (loop, depth)):
            axes.plot(position, trajectory.pull_off_force, "o", color="#D55E00", markersize=5)
        history.annotate(
            f"pull-off {trajectory.pull_off_force:.4g}",
            (at, trajectory.pull_off_force),
            xytext=(-8, 6),
            textcoords="offset points",
            ha="right",
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
    figure.savefig(path, dpi=150)

"""Pictures of the contact itself: the sphere, the surface that it attracts and presses, and the force meanwhile.

The gap is true to scale along the axis; across, the radius is compressed. Colour is the traction on the surface: blue
pushes, red pulls. The axis of time gives every phase of the protocol its own width.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.outputs import FILMS, require_suffix
from bem.results.plots import COLOURS as TOOLS
from bem.results.plots import PULL_OFF, TIME_LABEL, ZERO, labels_of, mark_phases, smooth
from bem.results.profiles import Profiles, axis_of_phases, moments

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SURFACES = {"sphere": "0.75", "solid": "#F3E3C3"}
COLOURS, SHARE = "RdBu_r", 0.98
"""Colour map of traction; share of the nodes whose tractions its range must hold."""
WIDER = 1.35  # largest radius drawn, over the largest contact radius
PER_SECOND, RESOLUTION, NO_TRACTION = 20, 90, 1e-3


class _Units:
    """Factors from a trajectory's own units to those of the picture, labels of its axes, and words of its instants."""

    def __init__(self, trajectory: Any, profiles: Profiles, setup: Any) -> None:
        from matplotlib.ticker import EngFormatter

        self.radius = self.height = self.time = self.force = self.traction = 1.0
        self.labels = labels_of(trajectory.corners)
        self.labels |= {"radius": r"radius $r/\beta$", "height": "height $z/h_0$"}
        self.labels["traction"] = r"traction $\sigma h_0/\Delta\gamma$"
        self.instant: Callable[[float], str] = r"$t/\tau$ = {:.3g}".format
        self.corner: Callable[[float], str] = "{:.12g}".format
        if setup is None:
            return
        self.time, self.corner, self.instant = setup.time_scale, EngFormatter("s"), EngFormatter("s", places=2)
        self.labels["time"] = self.labels["time"].replace(TIME_LABEL, "time")
        for name, unit, scale, values in (
            # Without a contact the radius of the picture is about one beta.
            ("radius", "m", setup.contact_radius_scale, np.append(trajectory.contact_radius, 1.0)),
            ("height", "m", setup.gap, profiles.indentation),
            ("force", "N", setup.force_scale, trajectory.force),
            ("traction", "Pa", setup.work_of_adhesion / setup.gap, profiles.traction),
        ):
            # One prefix for all numbers of an axis.
            power = 3 * int(np.log10(scale * np.nanmax(np.abs(values))) // 3)
            setattr(self, name, scale / 10.0**power)
            self.labels[name] = f"{name} ({EngFormatter.ENG_PREFIXES[power]}{unit})"
        self.labels["force"] += ", tension positive"


def write_film(trajectory: Any, path: str | Path, setup: Any = None) -> None:
    """Write the moving contact, one frame a profile, beside the force history.

    Args:
        trajectory: a `bem.Trajectory` with profiles.
        path: a file that ends in .gif, or in .mp4 where ffmpeg is installed.
        setup: a `bem.lab.Setup` whose scene was simulated, to draw in its SI units.

    Raises:
        ValueError: the trajectory has no profiles, the format is unknown, or ffmpeg is not installed.
    """
    from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
    from matplotlib.figure import Figure

    profiles = _profiles_of(trajectory)
    units = _Units(trajectory, profiles, setup)
    require_film(path)
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    contact, history = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_history(history, trajectory, units)
    (mark,) = history.plot([], [], "o", color=PULL_OFF, markersize=6, zorder=3)
    places = np.interp(profiles.time, *axis_of_phases(trajectory))
    view = _View(profiles, units)
    view.add_bar(figure, contact)
    figure.get_layout_engine().set(w_pad=0.12)

    def frame(number: int) -> None:
        contact.clear()
        view.draw(contact, number)
        contact.set_title(units.instant(units.time * profiles.time[number]), fontsize=9)
        mark.set_data([places[number]], [units.force * profiles.force[number]])

    frame(0)
    mark_phases(history, units.time * trajectory.corners, units.corner)
    figure.set_layout_engine("none")  # it would arrange every frame anew
    writer = PillowWriter(PER_SECOND) if Path(path).suffix == ".gif" else FFMpegWriter(PER_SECOND)
    FuncAnimation(figure, frame, len(profiles)).save(path, writer=writer, dpi=RESOLUTION)


def require_film(path: str | Path | None) -> None:
    """Raise ValueError where a film's file is neither .gif nor .mp4, or is .mp4 and ffmpeg is not installed."""
    require_suffix(path, FILMS)
    if path is not None and Path(path).suffix == ".mp4" and not shutil.which("ffmpeg"):
        raise ValueError(f"an .mp4 file needs ffmpeg, which is not installed; a .gif does not; received {str(path)!r}")


def draw_filmstrip(trajectory: Any, setup: Any = None) -> Figure:
    """Draw the contact at the profiles nearest to its `moments`, over the force history with these marked.

    Args:
        trajectory: a `bem.Trajectory` with profiles.
        setup: a `bem.lab.Setup` whose scene was simulated, to draw in its SI units.

    Returns:
        a new figure.

    Raises:
        ValueError: the trajectory has no profiles.
    """
    from matplotlib.figure import Figure

    profiles = _profiles_of(trajectory)
    units = _Units(trajectory, profiles, setup)
    chosen = {name: int(np.argmin(np.abs(profiles.time - time))) for name, time in moments(trajectory).items()}
    figure = Figure(figsize=(7.1, 3.6), layout="constrained")
    grid = figure.add_gridspec(2, len(chosen), height_ratios=(1.0, 1.1))
    view = _View(profiles, units)
    history = figure.add_subplot(grid[1, :])
    _draw_history(history, trajectory, units)
    panels = []
    for column, (name, number) in enumerate(chosen.items()):
        panels.append(figure.add_subplot(grid[0, column]))
        view.draw(panels[-1], number, labels=column == 0)
        panels[-1].set_title(f"{column + 1}  {name}", fontsize=8)
        position = (np.interp(profiles.time[number], *axis_of_phases(trajectory)), units.force * profiles.force[number])
        history.plot(*position, "o", color="white", markeredgecolor=PULL_OFF, markersize=10, zorder=3)
        history.annotate(str(column + 1), position, ha="center", va="center", fontsize=7, zorder=4)
    view.add_bar(figure, panels)
    mark_phases(history, units.time * trajectory.corners, units.corner)
    return figure


def _profiles_of(trajectory: Any) -> Profiles:
    if trajectory.profiles is None or len(trajectory.profiles) == 0:
        raise ValueError(
            "a picture of the contact needs profiles: pass profiles=80, or instants, to simulate; received a "
            f"trajectory without any, of status {trajectory.status!r}"
        )
    return trajectory.profiles


def _draw_history(axes: Axes, trajectory: Any, units: _Units) -> None:
    axes.axhline(0.0, **ZERO)
    time, _, force = smooth(trajectory)
    axes.plot(np.interp(time, *axis_of_phases(trajectory)), units.force * force, color=TOOLS["solver"], linewidth=1.2)
    axes.tick_params(labelsize=7)
    axes.margins(y=0.12)
    axes.set_xlabel(units.labels["time"], fontsize=8)
    axes.set_ylabel(units.labels["force"], fontsize=8)
    axes.spines[["top", "right"]].set_visible(False)


class _View:
    """What all pictures of one contact share: the window, and the colours of traction."""

    def __init__(self, profiles: Profiles, units: _Units) -> None:
        from matplotlib.colors import TwoSlopeNorm

        self.profiles, self.units = profiles, units
        self.radius, self.traction = units.radius * profiles.radius, units.traction * profiles.traction
        self.surface = -units.height * profiles.displacement
        touching = np.where(profiles.traction != 0.0, self.radius, 0.0)[profiles.gap < 2.0]
        reach = np.nanmax(touching, initial=0.0) or np.nanmax(self.radius)
        self.reach = min(WIDER * reach, float(np.nanmax(self.radius)))
        seen = self.radius <= self.reach
        low, high = np.nanmin(self.surface[seen], initial=0.0), np.nanmax(self.surface[seen], initial=0.0)
        self.low = low - 0.35 * (high - low + units.height)
        self.high = max(high, units.height * float(np.nanmin(profiles.sphere[0]))) + 1.5 * units.height
        largest = np.nanquantile(self.traction[seen], SHARE), -np.nanquantile(self.traction[seen], 1.0 - SHARE)
        self.least = NO_TRACTION * units.traction
        self.norm = TwoSlopeNorm(0.0, -max(largest[1], self.least), max(largest[0], self.least))

    def add_bar(self, figure: Figure, axes: Any) -> None:
        """Add the bar of colours beside the axes."""
        from matplotlib.cm import ScalarMappable

        bar = figure.colorbar(ScalarMappable(self.norm, COLOURS), ax=axes, aspect=14, pad=0.01)
        # An end without traction, such as tension without adhesion, has no number.
        ticks = [end for end in (self.norm.vmin, 0.0, self.norm.vmax) if abs(end) != self.least]
        bar.set_ticks(ticks, labels=[f"{float(f'{tick:.2g}'):g}" for tick in ticks])
        bar.ax.tick_params(labelsize=7)
        bar.set_label(self.units.labels["traction"], fontsize=8)

    def draw(self, axes: Axes, number: int, *, labels: bool = True) -> None:
        """Draw one profile, mirrored about the axis."""
        from matplotlib.collections import LineCollection

        finite = np.isfinite(self.radius[number])
        radius, surface, traction = (
            np.concatenate([sign * values[number, finite][:0:-1], values[number, finite]])
            for values, sign in ((self.radius, -1.0), (self.surface, 1.0), (self.traction, 1.0))
        )
        beyond = np.linspace(radius[-1], max(self.reach, radius[-1]), 9)[1:]
        radius = np.concatenate([-beyond[::-1], radius, beyond])
        height = self.profiles.height(self.profiles.indentation[number], radius / self.units.radius) * self.units.height
        surface = np.pad(surface, beyond.size, mode="edge")
        traction = np.pad(traction, beyond.size)
        axes.fill_between(radius, height, np.maximum(height, self.high), color=SURFACES["sphere"], linewidth=0.0)
        axes.fill_between(radius, surface, self.low, color=SURFACES["solid"], linewidth=0.0)
        points = np.stack([radius, surface], axis=1)
        line = LineCollection(
            np.stack([points[:-1], points[1:]], axis=1), cmap=COLOURS, norm=self.norm, linewidth=2.5, capstyle="round"
        )
        line.set_array(0.5 * (traction[:-1] + traction[1:]))
        axes.add_collection(line)
        axes.plot(radius, height, color="0.35", linewidth=0.8)
        axes.set_xlim(-self.reach, self.reach)
        axes.set_ylim(self.low, self.high)
        axes.tick_params(labelsize=7, labelleft=labels)
        axes.set_xlabel(self.units.labels["radius"], fontsize=8)
        if labels:
            axes.set_ylabel(self.units.labels["height"], fontsize=8)

"""The graphical abstract: the contact at its moments, its protocol, the surrogate, and the predicted force."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem.results.film import SURFACES
from bem.results.profiles import places_of
from experiments.paper.canonical_regimes import PICTURED
from paper_figures.style import drawing, models_style, schematics
from paper_figures.style.writing import number

REACH, MARGIN = 3.4, 4.0
"""Largest radius drawn, in beta, and height above the surface at rest and below its deepest point, in h0."""


def draw_contacts(panels: np.ndarray, contacts: dict[str, Any]) -> None:
    """The sphere and the surface at each moment, mirrored about the axis, all at one scale."""
    low, high = min(min(moment["surface"]) for moment in contacts.values()) - MARGIN, 3.0 * MARGIN
    for place, (axes, (name, moment)) in enumerate(zip(panels, contacts.items(), strict=True), 1):
        radius = np.array(moment["radius"])
        across = np.concatenate([-radius[::-1], radius])
        sphere, surface = (np.concatenate([moment[key][::-1], moment[key]]) for key in ("sphere", "surface"))
        axes.fill_between(across, sphere, np.maximum(sphere, high), color=SURFACES["sphere"], linewidth=0.0)
        axes.fill_between(across, surface, low, color=SURFACES["solid"], linewidth=0.0)
        axes.plot(across, surface, color=drawing.BLACK, linewidth=0.9)
        axes.set(xlim=(-REACH, REACH), ylim=(low, high), title=f"{place}  {name}")
        axes.set_axis_off()


def draw_model(axes: Axes, regime: dict[str, Any], name: str, errors: dict[str, Any]) -> None:
    """The model between two arrows, with its median errors and times below."""
    schematics.blank(axes, 10.0, 8.0)
    tabor = regime["protocol"]["tabor"]
    schematics.arrow(axes, (0.2, 4.6), (1.7, 4.6), lw=1.6)
    schematics.arrow(axes, (8.3, 4.6), (9.8, 4.6), lw=1.6)
    schematics.box(
        axes, 5.0, 4.6, f"{name}\nsequence to\nsequence", schematics.LSTM_FILL, width=6.4, height=3.0, size=8
    )
    schematics.arrow(axes, (5.0, 7.4), (5.0, 6.15), lw=1.2, linestyle=":", color=drawing.RED)
    axes.text(5.0, 7.5, rf"Tabor parameter $\mu = {tabor:g}$", ha="center", color=drawing.RED)
    overall = errors["overall"]
    milliseconds = {name: number(1e3 * seconds, 2) for name, seconds in regime["seconds"].items()}
    text = (
        f"median error on {errors['trajectories']} unseen protocols\n"
        f"pull-off force {overall['pull_off_force_percent']['median']:.2g} %, "
        f"hysteresis {overall['hysteresis_percent']['median']:.2g} %\n"
        f"Keras call {milliseconds['keras_call']} ms, solver {milliseconds['solver']} ms"
    )
    axes.text(5.0, 1.4, text, ha="center", va="center")


def draw_force(axes: Axes, regime: dict[str, Any], name: str) -> None:
    """Predicted and simulated force over indentation."""
    native, steps = regime["native"], regime["steps"]
    drawing.zero_line(axes)
    axes.plot(native["indentation"], native["force"], color=drawing.BLACK, linewidth=1.0, label="solver")
    recipe, predicted = next(iter(models_style.recipes(regime["predicted"]).items()))
    label = models_style.label(name, recipe)
    axes.plot(steps["indentation"], predicted["force"], label=label, **models_style.step_marker(name))
    axes.set(xlabel=drawing.INDENTATION, ylabel=drawing.FORCE)
    axes.legend(loc="lower left")


def draw_protocol(axes: Axes, contacts: dict[str, Any], native: dict[str, Any]) -> None:
    """Indentation over time, each phase with a width of its own, and the moments on it."""
    corners = np.array([0.0, *(contacts[name]["time"] for name in ("pressed", "relaxed")), native["time"][-1]])
    places = places_of(corners)
    axes.plot(np.interp(native["time"], corners, places), native["indentation"], color=drawing.BLACK, linewidth=1.6)
    times = np.interp([moment["time"] for moment in contacts.values()], corners, places)
    number_moments(axes, times, [moment["indentation"] for moment in contacts.values()])
    axes.set_xticks(places, labels=[f"{corner:.3g}" for corner in corners])
    axes.set(xlabel=drawing.TIME, ylabel=drawing.INDENTATION)


def number_moments(axes: Axes, across: Iterable[float], up: Iterable[float]) -> None:
    """Number the moments on a curve."""
    for place, at in enumerate(zip(across, up, strict=True), 1):
        axes.plot(*at, "o", color="white", markeredgecolor=drawing.RED, markersize=9, zorder=4)
        axes.annotate(str(place), at, ha="center", va="center", zorder=5)


def compose(canonical_regimes: Any, error_statistics: Any) -> Figure:
    """Draw the graphical abstract."""
    regime = next(candidate for candidate in canonical_regimes["regimes"] if candidate["sample"] == PICTURED)
    contacts = canonical_regimes["contacts"]
    drawn = drawing.figure(height=3.6)
    grid = drawn.add_gridspec(2, 1, height_ratios=(1.0, 1.9))
    draw_contacts(grid[0].subgridspec(1, len(contacts)).subplots(), contacts)
    first, second, third = grid[1].subgridspec(1, 3).subplots()
    draw_protocol(first, contacts, regime["native"])
    name = canonical_regimes["config"]["model"]
    draw_model(second, regime, name, next(iter(models_style.recipes(error_statistics).values())))
    draw_force(third, regime, name)
    across, up = ([moment[key] for moment in contacts.values()] for key in ("indentation", "force"))
    number_moments(third, across[:-1], up[:-1])  # the last lies where the first does
    return drawn

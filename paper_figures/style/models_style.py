"""One colour for each model family and one marker for each conditioning, the same in every figure.

As in the paper: triangle for concatenation, star for FiLM, diamond for gated.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from paper_figures.style import drawing
from surrogate.architectures.naming import CONDITIONINGS, PAPER_FAMILIES, paper_names, split_name

REFERENCE = "M1-concat"
SEVERAL = 2
"""Seeds from which on a spread is drawn."""
COLORS = dict(
    zip(
        PAPER_FAMILIES,
        (drawing.BLUE, drawing.VERMILION, drawing.GREEN, drawing.PURPLE, drawing.ORANGE, drawing.SKY),
        strict=True,
    )
)
MARKERS = dict(zip(CONDITIONINGS, ("^", "*", "D"), strict=True))
SIZES = dict(zip(CONDITIONINGS, (6.0, 8.0, 5.0), strict=True))


def color(name: str) -> str:
    """The colour of a model's family."""
    return COLORS[split_name(name)[0]]


def marker(name: str) -> dict[str, Any]:
    """Keywords of `Axes.plot` that draw a model's point."""
    conditioning = split_name(name)[1]
    return {
        "marker": MARKERS[conditioning],
        "markersize": SIZES[conditioning],
        "color": color(name),
        "markeredgecolor": "white",
        "markeredgewidth": 0.4,
        "linestyle": "",
    }


def step_marker(name: str) -> dict[str, Any]:
    """The same for the many measurement steps of a predicted history: smaller and hollow, so that they do not merge."""
    small = {"markersize": 3.2, "markerfacecolor": "none", "markeredgecolor": color(name), "markeredgewidth": 0.6}
    return marker(name) | small


def draw_folds(
    axes: Axes,
    x: Sequence[float],
    means: Sequence[float],
    deviations: Sequence[float],
    folds: Sequence[int],
    look: Mapping[str, Any],
) -> None:
    """Draw means over folds with standard deviations, and open, without one, what was trained on one fold alone."""
    axes.plot(x, means, color=look["color"], linewidth=1.0, zorder=1)
    points = list(zip(x, means, deviations, folds, strict=True))
    several, single = ([point for point in points if (point[3] > 1) is many] for many in (True, False))
    if several:
        at, mean, deviation, counts = zip(*several, strict=True)
        label = f"mean of {' or '.join(map(str, sorted(set(counts))))} folds"
        axes.errorbar(at, mean, deviation, capsize=2, label=label, **look)
    if single:
        at, mean, _, _ = zip(*single, strict=True)
        hollow = {"markerfacecolor": "white", "markeredgecolor": look["color"], "markeredgewidth": 0.8}
        axes.plot(at, mean, label="one fold", **{**look, **hollow})


def seeds_of(ranking: Any, name: str) -> int:
    """Published seeds of a model."""
    return len(ranking["models"].get(name, ())) if ranking else 0


def draw_spread(axes: Axes, ranking: Any, name: str, x: str | float, y: str) -> bool:
    """Draw a model at its median over seeds, with whiskers to the least and the largest one.

    Args:
        axes: Where.
        ranking: The result of that name; `None` where there is none.
        name: The model.
        x: A metric of the ranking, or a place.
        y: A metric of the ranking.

    Returns:
        whether there are two seeds at least; nothing is drawn where not.
    """
    if seeds_of(ranking, name) < SEVERAL:
        return False
    spread = ranking["spread"][name]
    places = [spread[one] if isinstance(one, str) else dict.fromkeys(("min", "median", "max"), one) for one in (x, y)]
    at = [place["median"] for place in places]
    xerr, yerr = ([[place["median"] - place["min"]], [place["max"] - place["median"]]] for place in places)
    axes.plot(*at, label=name, zorder=3, **marker(name))
    # In front, as the spread may be smaller than the marker.
    axes.errorbar(*at, yerr, xerr, fmt="none", elinewidth=0.9, ecolor=drawing.BLACK, zorder=4)
    return True


def draw_curves_of_seeds(axes: Axes, curves: Sequence[Sequence[float]], look: Mapping[str, Any], label: str) -> None:
    """Draw the validation error over the epochs that all seeds have: their median, and a band from least to largest."""
    epochs = range(1, min(map(len, curves)) + 1)
    rows = np.array([curve[: len(epochs)] for curve in curves])
    middle = np.median(rows, axis=0)
    axes.fill_between(epochs, rows.min(axis=0), rows.max(axis=0), color=look["color"], alpha=0.25, linewidth=0)
    axes.plot(epochs, middle, color=look["color"], linewidth=1.0, label=label)
    least = int(middle.argmin())
    axes.plot(epochs[least], middle[least], **look)


def spread_lines(ranking: Any, drawn: Sequence[str], width: int = 150) -> list[str]:
    """Lines that say of how many seeds each model is drawn; none where all are of one training.

    Args:
        ranking: The result of that name; `None` where there is none.
        drawn: The models of the figure.
        width: Letters in a line.
    """
    several: dict[int, list[str]] = {}
    for name in drawn:
        if (count := seeds_of(ranking, name)) >= SEVERAL:
            several.setdefault(count, []).append(name)
    if not several:
        return []
    parts = [f"of {count} seeds: {listed(names)}" for count, names in sorted(several.items(), reverse=True)]
    single = [name for name in drawn if seeds_of(ranking, name) < SEVERAL]
    rest = f"; one training each: {listed(single)}" if single else ""
    return textwrap.wrap(f"median, least and largest {'; '.join(parts)}{rest}", width)


def notes(*lines: str) -> str:
    """The lines that are not empty, one below the other."""
    return "\n".join(filter(None, lines))


def family_handles() -> list[Line2D]:
    """Legend entries of the six families."""
    return [Line2D([], [], color=COLORS[name], linewidth=3.0, label=name) for name in PAPER_FAMILIES]


def conditioning_handles() -> list[Line2D]:
    """Legend entries of the three conditionings."""
    return [
        Line2D([], [], color="0.35", marker=MARKERS[name], markersize=SIZES[name], linestyle="", label=name)
        for name in CONDITIONINGS
    ]


def paper_marker(name: str) -> dict[str, Any]:
    """Keywords of `Axes.plot` that draw the paper's own point of a model: the model's marker, hollow, in its colour."""
    hollow = {"color": "none", "markeredgecolor": drawing.PAPER, "markeredgewidth": 1.0, "markersize": 8.0}
    return marker(name) | hollow


def handles(paper: str) -> list[Line2D]:
    """Legend entries of families, conditionings and the paper's own point."""
    theirs = Line2D([], [], label=f"paper's {paper}", **paper_marker(paper))
    return [*family_handles(), *conditioning_handles(), theirs]


def missing_note(missing: Sequence[str], differences: Mapping[str, Sequence[str]] | None = None) -> str:
    """One line that says which models are not drawn, and why; empty when none.

    Args:
        missing: Those that are not trained yet.
        differences: For those that are trained otherwise, words for what differs. Models other than the 18 paper models
            are never drawn, and not named.
    """
    parts = [f"not trained yet, {len(missing)} of {len(paper_names())}: {listed(missing)}"] if missing else []
    alike: dict[str, list[str]] = {}
    for name, words in (differences or {}).items():
        if name in paper_names():
            alike.setdefault(" and ".join(words), []).append(name)
    parts += [f"trained with another {words}: {listed(names)}" for words, names in alike.items()]
    return "; ".join(parts)


def forces_note(model_forces: Any) -> str:
    """A sentence that names the models trained on other forces than the shipped file's; empty where none is."""
    others = model_forces["others"] if model_forces else []
    if not others:
        return ""
    return (
        f"{len(others)} of the {len(model_forces['models'])} published models were trained on an earlier version of "
        f"the forces: {listed(others)}."
    )


def listed(names: Sequence[str]) -> str:
    """Models by name, whole families by theirs."""
    whole = [family for family in PAPER_FAMILIES if all(f"{family}-{c}" in names for c in CONDITIONINGS)]
    single = [name for name in names if name.split("-")[0] not in whole]
    return ", ".join(single + ([f"all of {', '.join(whole)}"] if whole else []))

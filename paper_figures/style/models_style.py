"""Style of the models: one colour for each family and one marker for each conditioning, the same in every figure.

As in the paper: triangle for concatenation, star for FiLM, diamond for gated.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from experiments.published_models import PAPER_TRAINED
from paper_figures.style import drawing
from surrogate.architectures.naming import CONDITIONINGS, PAPER_FAMILIES, paper_names, split_name

REFERENCE = "M1-concat"
OURS = "--"
"""Line of the curves of trainings by our recipe; those by the paper's are solid."""
SEVERAL = 2
"""Least number of seeds for which a spread is drawn."""
COLORS = dict(zip(PAPER_FAMILIES, drawing.FAMILIES, strict=True))
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
    """As `marker`, but smaller and hollow, so that the measurement steps of a predicted force stay apart."""
    small = {"markersize": 3.2, "markerfacecolor": "none", "markeredgecolor": color(name), "markeredgewidth": 0.6}
    return marker(name) | small


def trained_by_paper_recipe(comparison: Any) -> dict[str, Any]:
    """The models that were also trained by the paper's recipe, by name, from the result `model_comparison`."""
    return {name: comparison["beside"][PAPER_TRAINED[name]] for name in comparison["by_paper_recipe"]["trained"]}


def leading(comparison: Any) -> tuple[str, dict[str, Any]]:
    """The recipe that figures lead with, and its models: the paper's, or `swift` where none is trained by it."""
    trained = trained_by_paper_recipe(comparison)
    return ("paper", trained) if trained else ("swift", comparison["models"])


def recipes(study: Any) -> dict[str, Any]:
    """Parts of a study by the recipe of the training, the paper's first: the one that figures lead with."""
    return {name: study[name] for name in ("paper", "swift") if study.get(name)}


def label(name: str, recipe: str) -> str:
    """A model and the recipe of its training, for a legend."""
    return f"{name}, {'paper’s recipe' if recipe == 'paper' else 'swift'}"


def seeds_of(ranking: Any, name: str) -> int:
    """Number of published seeds of a model."""
    return len(ranking["models"].get(name, ())) if ranking else 0


def draw_spread(axes: Axes, ranking: Any, name: str, x: str | float, y: str) -> bool:
    """Draw the median of a model over its seeds, with whiskers to the least and the largest value.

    Args:
        axes: The panel.
        ranking: The result `ranking`, or `None`.
        name: The model.
        x: A metric of the ranking, or a position.
        y: A metric of the ranking.

    Returns:
        Whether the model has at least `SEVERAL` seeds; otherwise nothing is drawn.
    """
    if seeds_of(ranking, name) < SEVERAL:
        return False
    spread = ranking["spread"][name]
    places = [spread[key] if isinstance(key, str) else dict.fromkeys(("min", "median", "max"), key) for key in (x, y)]
    at = [ends["median"] for ends in places]
    xerr, yerr = ([[ends["median"] - ends["min"]], [ends["max"] - ends["median"]]] for ends in places)
    axes.plot(*at, label=name, zorder=3, **marker(name))
    axes.errorbar(*at, yerr, xerr, fmt="none", elinewidth=0.9, ecolor=color(name), zorder=2)
    return True


def draw_curve(axes: Axes, history: Mapping[str, Sequence[float]], look: Mapping[str, Any], label: str) -> None:
    """Draw the validation error over the epochs of one training, with its least value marked."""
    epochs, errors = history["epoch"], history["validation_mse"]
    least = min(range(len(epochs)), key=errors.__getitem__)
    axes.plot(epochs, errors, color=look["color"], linewidth=1.0, label=label)
    axes.plot(epochs[least], errors[least], **{"linestyle": "", **look})


def draw_curves_of_seeds(axes: Axes, curves: Sequence[Sequence[float]], look: Mapping[str, Any], label: str) -> None:
    """Draw median and range over the seeds of the validation error, over the epochs that all seeds have."""
    epochs = range(1, min(map(len, curves)) + 1)
    rows = np.array([curve[: len(epochs)] for curve in curves])
    axes.fill_between(epochs, rows.min(axis=0), rows.max(axis=0), color=look["color"], alpha=0.25, linewidth=0)
    draw_curve(axes, {"epoch": epochs, "validation_mse": list(np.median(rows, axis=0))}, look, label)


def spread_line(ranking: Any, drawn: Sequence[str]) -> str:
    """How many seeds the spread of the drawn models is of; empty if each has one training."""
    counts = {max(seeds_of(ranking, name), 1) for name in drawn}
    numbers = " or ".join(map(str, sorted(counts, reverse=True)))
    return "" if max(counts, default=0) < SEVERAL else f"median, least and largest of {numbers} seeds each"


def write_states(drawn: Figure, comparison: Any, ranking: Any, models: Sequence[str]) -> None:
    """Write below a figure which models are not drawn, and the number of seeds of those that are.

    Args:
        drawn: The figure.
        comparison: The result `model_comparison`.
        ranking: The result `ranking`, or `None`.
        models: The models that the figure is about, drawn or not.
    """
    recipe, trained = leading(comparison)
    missing = [name for name in models if name not in trained] if recipe == "paper" else comparison["missing"]
    missing, otherwise, seeds = [name for name in missing if name in models], {}, ""
    if recipe == "swift" or ranking:
        otherwise = {name: reasons for name, reasons in comparison["differences"].items() if name in models}
        missing = [name for name in missing if name not in otherwise]
        seeds = spread_line(ranking, [name for name in comparison["models"] if name in models])
    if text := "\n".join(filter(None, [missing_note(missing, otherwise), seeds])):
        drawn.supxlabel(text, fontsize=6.5, color="0.4")


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
    """Keywords of `Axes.plot` for the paper's own point of a model: its marker, hollow, in the paper's colour."""
    hollow = {"color": "none", "markeredgecolor": drawing.PAPER, "markeredgewidth": 1.0, "markersize": 7.0}
    return marker(name) | hollow


def handles() -> list[Line2D]:
    """Legend entries of families, conditionings and the paper's own point."""
    paper = drawing.paper_values("reference_model")["name"]
    theirs = Line2D([], [], label=f"paper's {paper}", **paper_marker(paper))
    return [*family_handles(), *conditioning_handles(), theirs]


def missing_note(missing: Sequence[str], differences: Mapping[str, Sequence[str]] | None = None) -> str:
    """One line that states which models are not drawn, and why; empty if all are.

    Args:
        missing: Models that are not trained yet.
        differences: Words for what differs, for each model that was trained differently. Models other than the 18 paper
            models are never drawn, and not named.
    """
    parts = [f"not trained yet, {len(missing)} of {len(paper_names())}: {listed(missing)}"] if missing else []
    alike: dict[str, list[str]] = {}
    for name, reasons in (differences or {}).items():
        if name in paper_names():
            alike.setdefault(" and ".join(reasons), []).append(name)
    parts += [f"trained with another {reason}: {listed(names)}" for reason, names in alike.items()]
    return "; ".join(parts)


def forces_note(model_forces: Any) -> str:
    """A sentence that names the models trained on an earlier version of the forces; empty if there is none."""
    outdated = model_forces["others"] if model_forces else []
    if not outdated:
        return ""
    return (
        f"{len(outdated)} of the {len(model_forces['models'])} published models were trained on an earlier version of "
        f"the forces: {listed(outdated)}."
    )


def listed(names: Sequence[str]) -> str:
    """Names of models in words; a complete family is given by its own name."""
    complete = [family for family in PAPER_FAMILIES if all(f"{family}-{c}" in names for c in CONDITIONINGS)]
    single = [name for name in names if name.split("-")[0] not in complete]
    return ", ".join(single + ([f"all of {', '.join(complete)}"] if complete else []))

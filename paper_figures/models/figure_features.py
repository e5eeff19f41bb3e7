"""Input representations and training-set size: validation curves of the feature sets, and of nested training shares.

Below them, more feature sets by `swift`, and their errors of the pull-off force on hidden protocols at two kinds of
measurement steps, because validation errors compare trainings of the same steps only; those of the hysteresis are in
the table. `page_text` is the table of docs/surrogate-models.md.
"""

from typing import Any

from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem._support.wording import markdown_table
from experiments.published_models import PAPER_TRAINED_INPUTS, REFERENCE
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number

STYLES = {
    "A": {"color": drawing.RED, "marker": "o"},
    "B": {"color": drawing.ORANGE, "marker": "o"},
    "C": {"color": drawing.VIOLET, "marker": "o"},
    "D": {"color": drawing.BLUE, "marker": "o"},
    "E": {"color": drawing.SKY, "marker": "s"},
    "F": {"color": drawing.GREEN, "marker": "D"},
}
LABELS = {
    "A": "time, indentation",
    "B": "A + velocity",
    "C": "B + acceleration",
    "D": "B + edge",
    "E": "D + step length",
    "F": "E + closed forms",
}
FOLD = 0
STEPS = {"sets": "uniform", "physical": "physical"}
"""Parts of the result, and their measurement steps."""
READINGS = {"pull_off": "pull-off force", "hysteresis_trapezoids": "hysteresis"}
FLOOR = "the solver's own forces"
"""What a perfect model of the steps would have."""


def draw_feature_sets(axes: Axes, sets: dict[str, Any], ranking: Any = None) -> None:
    """One curve for each feature set, or a band if it has two seeds; the legend gives the least validation error."""
    names = [name for name in LABELS if name in sets]
    for name in names:
        count, label = models_style.seeds_of(ranking, f"features-{name}"), f"{name}: {LABELS[name]}"
        if count >= models_style.SEVERAL:
            curves = ranking["curves"][f"features-{name}"]
            low, high = min(map(min, curves)), max(map(min, curves))
            text = f"{label} ({low:.1e} to {high:.1e}, {count} seeds)"
            models_style.draw_curves_of_seeds(axes, curves, STYLES[name], text)
        else:
            text = f"{label} ({sets[name]['validation_mse']:.1e})"
            models_style.draw_curve(axes, sets[name]["history"], STYLES[name], text)
    axes.legend(loc="upper right")
    # Room for the legend above the curve of A.
    axes.set_ylim(top=axes.get_ylim()[1] * 4.0 ** max(0, len(names) - len("ABCD")))


def draw_hidden(axes: Axes, feature_sets: dict[str, Any], reading: str) -> None:
    """Errors of the solver's forces at the steps and of each feature set: medians, with bars to the 90th percentile."""
    columns = {FLOOR: feature_sets["floor"]}
    for name in LABELS:
        columns[name] = {steps: _hidden(feature_sets, group, name) for group, steps in STEPS.items()}
    columns = {name: errors for name, errors in columns.items() if any(errors.values())}
    for steps, shift in zip(drawing.STEPS, (-0.12, 0.12), strict=True):
        look, label = drawing.STEPS[steps], f"{steps} steps"
        for position, by_steps in enumerate(columns.values()):
            if errors := by_steps.get(steps):
                at, low, high = position + shift, errors[reading]["p50"], errors[reading]["p90"]
                axes.plot([at, at], [low, high], color=look["color"], linewidth=1.0)
                axes.plot(at, low, linestyle="", markersize=4.5, label=label, **look)
                label = None
    axes.set(yscale="log", ylabel=f"error of the {READINGS[reading]} (%)", xlim=(-0.5, len(columns) - 0.5))
    axes.set_xticks(range(len(columns)), ["solver's\nforces", *list(columns)[1:]])
    drawing.log_labels(axes.yaxis)


def _hidden(feature_sets: dict[str, Any], group: str, name: str) -> dict[str, Any] | None:
    return feature_sets.get(group, {}).get(name, {}).get("hidden")


def features_table(feature_sets: dict[str, Any], ranking: Any = None) -> Table:
    """One row for each feature set and kind of steps: errors over the seeds if there are two, or of one training."""
    rows = []
    for group, steps in STEPS.items():
        for name, inputs in LABELS.items():
            training = feature_sets.get(group, {}).get(name)
            count = models_style.seeds_of(ranking, f"features-{name}") if group == "sets" else 0
            if count >= models_style.SEVERAL:
                spread = ranking["spread"][f"features-{name}"]
                errors = [range_text(spread[metric]) for metric in ("validation_mse", "test_mse")]
            elif training:
                count, errors = 1, [number(training[metric]) for metric in ("validation_mse", "mse")]
            elif group in feature_sets and name in feature_sets.get("config", {}).get(group, "ABCD"):
                count, errors = 0, ["-", "-"]
            else:
                continue
            rows.append([name, inputs, steps, str(count), *errors, *_readings(training and training.get("hidden"))])
    for steps, errors in feature_sets.get("floor", {}).items():
        rows.append(["", FLOOR, steps, "", "", "", *_readings(errors)])
    head = ["Set", "Inputs", "Steps", "Trainings", "Validation MSE", "Held-out MSE"]
    return Table([*head, *(f"Error of the {name} (%)" for name in READINGS.values())], rows, caption("features"))


def _readings(errors: dict[str, Any] | None) -> list[str]:
    if not errors:
        return ["-"] * len(READINGS)
    return [", ".join(number(errors[name][level], 2) for level in ("p50", "p90", "p99")) for name in READINGS]


def page_text(feature_sets: Any) -> str:
    """The table for a page, and what measurement steps and inputs change, each alone and together."""
    table = features_table(feature_sets)
    rows = [[*row[:3], *row[4:]] for row in table.rows]
    heads = [*table.header[:3], *table.header[4:]]
    measured = f"Measured by `{feature_sets['command']}`."
    return f"{markdown_table(heads, rows, 'lllrrrr')}\n\n{gains(feature_sets)} {measured}"


def gains(feature_sets: dict[str, Any]) -> str:
    """What physical steps and the inputs F change, as a list."""
    plain, steps, inputs, both = (_hidden(feature_sets, group, name) for name in ("D", "F") for group in STEPS)
    if not (plain and steps and inputs and both):
        return "Not all of these are trained yet: `make feature-sets`."
    lines = []
    for reading, name in READINGS.items():
        for level, label in (("p50", "median"), ("p90", "90th percentile")):
            first, *errors = (f"{number(record[reading][level], 2)} %" for record in (plain, steps, inputs, both))
            changed = zip(errors, ("physical steps alone", "the inputs F alone", "both"), strict=True)
            changes = ", ".join(f"{error} with {change}" for error, change in changed)
            lines.append(f"- Error of the {name}, {label}: {first} with D at uniform steps; {changes}.")
    ratios = {name: feature_sets[group]["D"]["mse"] / feature_sets[group]["F"]["mse"] for group, name in STEPS.items()}
    factors = ", ".join(f"{ratio:.2g} at {name} steps" for name, ratio in ratios.items())
    return "\n".join([*lines, f"- Held-out MSE with D over that with F: {factors}.", "", "One training each."])


def range_text(spread: dict[str, float]) -> str:
    """Median over the seeds, and the extremes if they differ."""
    text = number(spread["median"])
    same = spread["min"] == spread["max"]
    return text if same else f"{text} ({number(spread['min'])} to {number(spread['max'])})"


def draw_shares(axes: Axes, efficiency: dict[str, Any]) -> None:
    """One curve for each share of the training part, from the first fold; the whole part in black."""
    shares, shades = efficiency["shares"], colormaps["viridis"]
    curves = [("100 %", drawing.BLACK, efficiency["full"])]
    for index, share in enumerate(shares):
        curves.append((f"{share['percent']:.3g} %", shades(0.9 * (index + 1) / len(shares)), share["folds"][FOLD]))
    for label, color, trained in curves:
        models_style.draw_curve(axes, trained["history"], {"color": color, "marker": "o"}, label)
    axes.legend(loc="upper right", ncols=2)


def draw_by_paper_recipe(axes: Axes, comparison: Any) -> None:
    """One curve for each of the paper's feature sets, of its training by the paper's recipe."""
    for name, published in PAPER_TRAINED_INPUTS.items():
        if training := comparison["beside"].get(published):
            text = f"{name}: {LABELS[name]} ({training['validation_mse']:.1e})"
            models_style.draw_curve(axes, training["history"], STYLES[name], text)
    axes.legend(loc="upper right")


def compose(
    feature_sets: Any, data_efficiency: Any, model_comparison: Any, ranking: Any = None
) -> dict[str, Figure | Table]:
    """Draw the trainings by the paper's recipe and the shares; below, those by `swift`, their errors, and a table."""
    rows = 2 if feature_sets.get("floor") else 1
    drawn, panels = drawing.panels(rows, 2, height=2.8 * rows)
    for axes in panels[: rows + 1]:
        axes.set(xlabel="epoch", ylabel="validation MSE", yscale="log")
    recipe = "paper" if set(PAPER_TRAINED_INPUTS.values()) & model_comparison["beside"].keys() else "swift"
    if recipe == "paper":
        draw_by_paper_recipe(panels[0], model_comparison)
    else:
        draw_feature_sets(panels[0], feature_sets["sets"], ranking)
    draw_shares(panels[1], data_efficiency)
    for axes, name in zip(panels, (recipe, "swift", "swift"), strict=False):
        axes.set_title(models_style.label(REFERENCE, name), loc="right")
    if rows > 1:
        draw_feature_sets(panels[2], feature_sets["sets"], ranking)
        draw_hidden(panels[3], feature_sets, "pull_off")
        panels[3].set_ylim(top=4.0 * panels[3].get_ylim()[1])
        panels[3].legend(loc="upper right")
    return {"figure-features": drawn, "features": features_table(feature_sets, ranking)}

"""Figure: error against the number of parameters, of LSTMs on the inputs F and of the paper's 18 models.

Reads the data of `experiments.surrogates.size_error`; `page_text` is the table of docs/surrogate-models.md.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem._support.wording import markdown_table
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import number

PANELS = {
    "pull_off": ("error of the pull-off force (%)", "pull_off_force_percent"),
    "hysteresis": ("error of the hysteresis (%)", "hysteresis_percent"),
    "force": ("force error, mean / range (%)", None),
}
"""Label of each error, and the median that the paper states for its best model."""
LSTM = {"color": drawing.BLACK, "marker": "o", "linewidth": 1.0}


def draw(axes: Axes, content: dict[str, Any], error: str) -> None:
    """Medians of one error on the hidden protocols at the paper's modulus ratio, with bars to the 90th percentile."""
    label, stated = PANELS[error]
    rows = content["lstm"]
    sizes, found = [row["parameters"] for row in rows], [row["paper"][error] for row in rows]
    axes.plot(sizes, [one["p50"] for one in found], label="LSTM, inputs F", **LSTM)
    axes.vlines(sizes, [one["p50"] for one in found], [one["p90"] for one in found], color=LSTM["color"], linewidth=0.7)
    for row in content["paper"]:
        axes.plot(row["parameters"], row["paper"][error]["p50"], **models_style.marker(row["name"]))
    if stated:
        paper = drawing.paper_values("reference_model")
        axes.plot(paper["parameters"], paper[stated], **models_style.paper_marker(paper["name"]))
    axes.set(xscale="log", yscale="log", xlabel="parameters", ylabel=label)
    for axis in (axes.xaxis, axes.yaxis):
        drawing.log_labels(axis)


def compose(size_error: Any) -> Figure:
    """Draw the figure."""
    drawn = drawing.figure(height=3.0)
    panels = drawn.subplots(1, len(PANELS))
    for axes, error in zip(panels, PANELS, strict=True):
        draw(axes, size_error, error)
    handles = [panels[0].lines[0], *models_style.handles("M1-concat")]
    drawn.legend(handles=handles, loc="outside upper center", ncols=6)
    drawing.letters(panels)
    return drawn


def smallest(content: dict[str, Any]) -> str:
    """How few parameters have the errors that the paper states, and those of its best model here, as sentences."""
    paper = drawing.paper_values("reference_model")
    best = min(content["paper"], key=lambda row: row["paper"]["pull_off"]["p50"], default=None)
    aims = {"that the paper states for its best model": {name: paper[key] for name, (_, key) in PANELS.items() if key}}
    if best:
        aims[f"of {best['name']}, the best of the 18 models here by pull-off force,"] = {
            name: best["paper"][name]["p50"] for name in PANELS
        }
    found = []
    for words, aim in aims.items():
        enough = [
            row for row in content["lstm"] if all(row["paper"][name]["p50"] <= most for name, most in aim.items())
        ]
        errors = ", ".join(f"{name.replace('_', '-')} {number(most, 2)} %" for name, most in aim.items())
        if enough:
            row = min(enough, key=lambda one: one["parameters"])
            found.append(
                f"The median errors {words} ({errors}) are reached from {row['units']} units on, with "
                f"{row['parameters']:,} parameters, {paper['parameters'] / row['parameters']:.0f} times fewer than the "
                "paper's model has."
            )
        else:
            found.append(f"No size reaches the median errors {words} ({errors}).")
    return " ".join(found)


def page_text(content: dict[str, Any]) -> str:
    """The table for a page, and what follows from it."""
    head = ["Model", "Parameters", "Pull-off error (%), median, p90", "Hysteresis error (%), median, p90"]
    head += ["Force error (%), median, p90", "Pull-off error, any solid (%)", "Held-out MSE", "Training (core-min)"]

    def cells(errors: dict[str, Any]) -> list[str]:
        return [f"{number(errors[name]['p50'], 2)}, {number(errors[name]['p90'], 2)}" for name in PANELS]

    rows = []
    for row in content["lstm"]:
        of_any = f"{number(row['any']['pull_off']['p50'], 2)}, {number(row['any']['pull_off']['p90'], 2)}"
        shown = [of_any, number(row["test"]["mse"], 2), f"{row['core_seconds'] / 60.0:.1f}"]
        rows.append([f"LSTM {row['units']}", f"{row['parameters']:,}", *cells(row["paper"]), *shown])
    for row in sorted(content["paper"], key=lambda one: one["parameters"]):
        rows.append(
            [row["name"], f"{row['parameters']:,}", *cells(row["paper"]), "", number(row["test"]["mse"], 2), ""]
        )
    return (
        f"{markdown_table(head, rows, 'l' + 7 * 'r')}\n\n{smallest(content)} "
        f"{content['count']} hidden protocols of each kind; trainings of {content['epochs']} epochs on "
        f"{content['trajectories']:,} trajectories, one seed. Measured by `{content['command']}`."
    )

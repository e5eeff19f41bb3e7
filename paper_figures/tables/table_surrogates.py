"""Table: errors, bands and cost of the pretrained models on hidden protocols.

Reads the data of `experiments.surrogates.pretrained_errors`.
"""

from typing import Any

from bem._support.wording import markdown_table
from paper_figures.style import drawing
from paper_figures.style.writing import Table, caption, number

WAYS = {"batch": 1e3, "single": 1e3, "step": 1e6, "gradient": 1e3}
"""Ways to call, and units of their times over a second."""
KINDS = {"paper": "0.1", "any": "0.01 to 1", "corners": "0.1, corners of the ranges"}
HEADS = [
    "Model",
    "Modulus ratio",
    "Pull-off error (%), median, p90, p99",
    "Hysteresis error (%), median, p90",
    "Covered",
    "Covered, fast unloading",
    "Width of the band (%), median, p90",
    "Time in batches (ms)",
    "Single (ms)",
    "Solver over model, batches",
]


def several(values: dict[str, float], *names: str) -> str:
    """Some quantiles."""
    return ", ".join(f"{values[name]:.2g}" for name in names)


def rows(content: dict[str, Any]) -> list[list[str]]:
    """One row for each model and kind of protocols."""
    found, solver = [], content["seconds"]["solver"]
    for name, model in content["models"].items():
        cost = content["seconds"][name]
        for kind, errors in model.items():
            banded = "covered" in errors
            quick = errors.get("covered_fast")
            found.append(
                [
                    name,
                    KINDS[kind],
                    several(errors["pull_off"], "p50", "p90", "p99"),
                    several(errors["hysteresis"], "p50", "p90"),
                    f"{errors['covered']:.2f}" if banded else "",
                    "" if quick is None else f"{quick:.2f}",
                    several(errors["width"], "p50", "p90") if banded else "",
                    f"{1e3 * cost['batch']:.3f}",
                    f"{1e3 * cost['single']:.2f}",
                    f"{solver['batch'] / cost['batch']:.0f}",
                ]
            )
    return found


def page_text(pretrained_errors: Any) -> str:
    """The table for a page, and how it was made."""
    return Table(HEADS, rows(pretrained_errors), f"Measured by `{pretrained_errors['command']}`.").page("ll" + 8 * "r")


CALLS = ["Tool", "Batch (ms)", "Single (ms)", "Step (µs)", "Gradient (ms)", "Gradient error (%), median, p90"]


def calls_text(pretrained_errors: Any) -> str:
    """The table of the ways to call for a page: times, the error of the gradient, and how it was made."""
    gradients, rows = pretrained_errors["gradients"], []
    for name in ("solver", *pretrained_errors["models"]):
        seconds, errors = pretrained_errors["seconds"][name], gradients["tools"][name]["common"]
        times = [f"{factor * seconds[kind]:.3g}" if kind in seconds else "-" for kind, factor in WAYS.items()]
        rows.append([name, *times, ", ".join(number(errors[level], 2) for level in ("p50", "p90"))])
    return (
        f"{markdown_table(CALLS, rows, 'lrrrrr')}\n\n"
        f"Errors of gradients on {gradients['count']} protocols, relative to the solver at {gradients['fine']:g}; "
        f"measured by `{pretrained_errors['command']}` on {pretrained_errors['host']}."
    )


def size_text(size_error: Any) -> str:
    """How few parameters of one LSTM have the errors that the paper states, as published, in a sentence."""
    paper = drawing.paper_values("reference_model")
    aims = {name: paper[f"{key}_percent"] for name, key in (("pull_off", "pull_off_force"), ("hysteresis",) * 2)}
    errors = ", ".join(f"{name.replace('_', '-')} {number(most, 2)} %" for name, most in aims.items())
    row = min(
        (one for one in size_error["lstm"] if all(one["paper"][name]["p50"] <= most for name, most in aims.items())),
        key=lambda one: one["parameters"],
    )
    return (
        f"The median errors that the paper states for its best model ({errors}) are reached by one LSTM on the inputs "
        f"F from {row['units']} units on, with {row['parameters']:,} parameters, "
        f"{paper['parameters'] / row['parameters']:.0f} times fewer than the paper's model has: {size_error['count']} "
        f"hidden protocols, {size_error['epochs']} epochs on {size_error['trajectories']:,} trajectories, one seed."
    )


def compose(pretrained_errors: Any) -> Table:
    """Write the table."""
    return Table(
        HEADS,
        rows(pretrained_errors),
        caption(
            "surrogates",
            solver=1e3 * pretrained_errors["seconds"]["solver"]["batch"],
            **{name: pretrained_errors[name] for name in ("count", "coverage", "fast")},
        ),
    )

"""Tables: errors, intervals and cost of the pretrained models beside M1-concat, and the cost of each way to call.

Reads the data of `errors_by_place` and `ways_to_call` in `experiments.surrogates`, and costs from that of
`experiments.measurements.accuracy_cost`.
"""

from pathlib import Path
from typing import Any

from bem._support.wording import markdown_table
from experiments.trainings.training_costs import break_even, line, seconds_before_use
from paper_figures.style.writing import Table, caption, number
from paper_figures.tables.table_accuracy_cost import seconds_of

PLACES = {"box": "0.01 to 1", "paper": "0.1", "vertices": "0.1, vertices of the ranges"}
HELD = ("pull_off", "hysteresis")
HEADS = [
    "Model",
    "Modulus ratio",
    "Pull-off error (%), median, p90, p99.9",
    "Hysteresis error (%), median, p90",
    "Covered: pull-off force, hysteresis",
    "Width of the pull-off interval (%), median, p90",
    "Time in batches (ms)",
    "Single (ms)",
    "Solver over model, batches",
]


def several(values: list[float]) -> str:
    """Some quantiles."""
    return ", ".join(f"{value:.2g}" for value in values)


def rows(errors_by_place: Any, accuracy_cost: Any) -> list[list[str]]:
    """One row for each model and kind of protocols."""
    lines, solver = [], seconds_of(accuracy_cost, "solver")["batch"]
    for name, places in errors_by_place["models"].items():
        cost = seconds_of(accuracy_cost, name)
        times = solver / cost["batch"]
        for region, label in PLACES.items():
            if region in places:
                summary = places[region]
                banded = "width/pull_off" in summary
                covered = ", ".join(f"{summary[f'inside/{result}']:.2f}" for result in HELD) if banded else ""
                widths = several(summary["width/pull_off"][:2]) if banded else ""
                errors = several(summary["pull_off"]), several(summary["hysteresis"][:2])
                calls = f"{1e3 * cost['batch']:.3f}", f"{1e3 * cost['single']:.2f}", f"{times:.0f}"
                lines.append([name, label, *errors, covered, widths, *calls])
    return lines


def page_text(errors_by_place: Any, accuracy_cost: Any) -> str:
    """The table for a page, and how it was made."""
    commands = f"Measured by `{errors_by_place['command']}` and `{accuracy_cost['command']}`."
    return Table(HEADS, rows(errors_by_place, accuracy_cost), commands).page("ll" + 7 * "r")


CALLS = ["Tool", "Batch (ms)", "Single (ms)", "Gradient (ms)", "Gradient error (%), median, p90"]
CALLS += ["Pull-off error (%), median, p90", "Pays after (calls)"]


def calls_text(ways_to_call: Any, accuracy_cost: Any, errors_by_place: Any, published: Path) -> str:
    """The table of the ways to call for a page: times, errors, after how many calls a model pays, and its making."""
    gradients, lines, solver = ways_to_call["gradients"], [], seconds_of(accuracy_cost, "solver")["batch"]
    for name in (*ways_to_call["solvers"], *ways_to_call["models"]):
        seconds, errors = seconds_of(accuracy_cost, name), gradients["errors"][name]
        times = [f"{1e3 * value:.3g}" for value in (*seconds.values(), ways_to_call["seconds"][name]["gradient"])]
        row = [name, *times, ", ".join(number(errors[level], 2) for level in ("p50", "p90")), "-", "-"]
        if solved := ways_to_call["solvers"].get(name):
            row[-2] = several([solved["p50"], solved["p90"]])
        if places := errors_by_place["models"].get(name):
            model = line(name, "surrogate", seconds_before_use(name, published, solver), seconds["batch"])
            calls = break_even(model, line("solver", "solver", 0.0, solver))
            row[-2:] = (
                several(places["box" if "box" in places else "paper"]["pull_off"][:2]),
                "never" if calls is None else f"{float(f'{calls:.2g}'):,.0f}",
            )
        lines.append(row)
    return (
        f"{markdown_table(CALLS, lines, 'lrrrrrr')}\n\n"
        "`solver` is the solver at `standard` accuracy, `draft` the same at `draft`. Times of batches and single calls "
        f"by `{accuracy_cost['command']}`, with the force at the measurement steps. Errors of gradients and of the "
        f"solver on {ways_to_call['count']} protocols, relative to the solver at {gradients['fine']:g}; "
        f"measured by `{ways_to_call['command']}` on {ways_to_call['host']}."
    )


def compose(errors_by_place: Any, accuracy_cost: Any) -> Table:
    """Write the table."""
    facts = {name: errors_by_place[name] for name in ("count", "coverage")}
    solver = 1e3 * seconds_of(accuracy_cost, "solver")["batch"]
    return Table(HEADS, rows(errors_by_place, accuracy_cost), caption("surrogates", solver=solver, **facts))

"""Tables: errors, intervals and cost of the pretrained models beside M1-concat, and the cost of each way to call.

Reads the data of `errors_by_place`, `ways_to_call` and `exported_files` in `experiments.surrogates`.
"""

from pathlib import Path
from typing import Any

from bem._support.wording import markdown_table
from experiments.trainings.training_costs import before_use, break_even, line
from paper_figures.style import drawing
from paper_figures.style.writing import Table, caption, number

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


def rows(errors_by_place: Any, ways_to_call: Any) -> list[list[str]]:
    """One row for each model and kind of protocols."""
    found, seconds = [], ways_to_call["seconds"]
    for name, places in errors_by_place["models"].items():
        cost, times = seconds[name], seconds["solver"]["batch"] / seconds[name]["batch"]
        for place, words in PLACES.items():
            if place in places:
                one = places[place]
                banded = "width/pull_off" in one
                covered = ", ".join(f"{one[f'inside/{result}']:.2f}" for result in HELD) if banded else ""
                widths = several(one["width/pull_off"][:2]) if banded else ""
                errors = several(one["pull_off"]), several(one["hysteresis"][:2])
                calls = f"{1e3 * cost['batch']:.3f}", f"{1e3 * cost['single']:.2f}", f"{times:.0f}"
                found.append([name, words, *errors, covered, widths, *calls])
    return found


def page_text(errors_by_place: Any, ways_to_call: Any) -> str:
    """The table for a page, and how it was made."""
    commands = f"Measured by `{errors_by_place['command']}` and `{ways_to_call['command']}`."
    return Table(HEADS, rows(errors_by_place, ways_to_call), commands).page("ll" + 7 * "r")


CALLS = ["Tool", "Batch (ms)", "Single (ms)", "Gradient (ms)", "Gradient error (%), median, p90"]
CALLS += ["Pull-off error (%), median, p90", "Pays after (calls)"]


def calls_text(ways_to_call: Any, errors_by_place: Any, published: Path) -> str:
    """The table of the ways to call for a page: times, errors, after how many calls a model pays, and its making."""
    gradients, found, solver = ways_to_call["gradients"], [], ways_to_call["seconds"]["solver"]["batch"]
    for name in (*ways_to_call["solvers"], *ways_to_call["models"]):
        seconds, errors = ways_to_call["seconds"][name], gradients["errors"][name]
        times = [f"{1e3 * seconds[kind]:.3g}" for kind in ("batch", "single", "gradient")]
        row = [name, *times, ", ".join(number(errors[level], 2) for level in ("p50", "p90")), "-", "-"]
        if solved := ways_to_call["solvers"].get(name):
            row[-2] = several([solved["p50"], solved["p90"]])
        if places := errors_by_place["models"].get(name):
            model = line(name, "surrogate", before_use(name, published, solver), seconds["batch"])
            calls = break_even(model, line("solver", "solver", 0.0, solver))
            row[-2:] = (
                several(places["box" if "box" in places else "paper"]["pull_off"][:2]),
                "never" if calls is None else f"{float(f'{calls:.2g}'):,.0f}",
            )
        found.append(row)
    return (
        f"{markdown_table(CALLS, found, 'lrrrrrr')}\n\n"
        "`solver` is the solver at `standard` accuracy, `draft` the same at `draft`. Errors of gradients and of the "
        f"solver on {ways_to_call['count']} protocols, relative to the solver at {gradients['fine']:g}; "
        f"measured by `{ways_to_call['command']}` on {ways_to_call['host']}."
    )


EXPORTED = ["File of", "Browser, single (ms)", "Weights (kB)", "Multiplications with weights (millions)"]


def exported_text(exported_files: Any) -> str:
    """What an exported file asks of a browser and a microcontroller, for a page, and how it was measured."""
    found = [
        [name, f"{one['milliseconds']:.2g}", f"{4e-3 * one['weights']:,.0f}", f"{1e-6 * one['multiplications']:.2g}"]
        for name, one in exported_files["models"].items()
    ]
    worst = max(one["difference"] for one in exported_files["models"].values())
    return (
        f"{markdown_table(EXPORTED, found, 'lrrr')}\n\n"
        f"One trajectory of {exported_files['count']}, wall time in {exported_files['browser']} on one thread. The "
        f"forces differ from those of Python by {worst:.0e} of their range at most; measured by "
        f"`{exported_files['command']}` on {exported_files['host']}."
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
        f"F from {row['units']} units on, with {row['parameters']:,} parameters ({4e-3 * row['parameters']:.0f} kB), "
        f"{paper['parameters'] / row['parameters']:.0f} times fewer than the paper's model has: {size_error['count']} "
        f"hidden protocols, {size_error['epochs']} epochs on {size_error['trajectories']:,} trajectories, one seed."
    )


def compose(errors_by_place: Any, ways_to_call: Any) -> Table:
    """Write the table."""
    facts = {name: errors_by_place[name] for name in ("count", "coverage")}
    solver = 1e3 * ways_to_call["seconds"]["solver"]["batch"]
    return Table(HEADS, rows(errors_by_place, ways_to_call), caption("surrogates", solver=solver, **facts))

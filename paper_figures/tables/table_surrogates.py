"""Tables: errors and intervals of the pretrained models by place, and what each way to call a model costs.

Errors are those that `surrogate.training.solid_judgement` wrote beside each model, costs those of
`experiments.measurements.accuracy_cost`, gradients those of `experiments.surrogates.gradients`.
"""

from pathlib import Path
from typing import Any

from bem._support.text_files import read_json
from bem._support.wording import markdown_table
from experiments.trainings.training_costs import break_even, line, seconds_before_use
from paper_figures.style.writing import Table, caption, number
from paper_figures.tables.table_accuracy_cost import seconds_of
from surrogate.files import PRETRAINED

PLACES = {
    "test_prony_2_4": "2 to 4 terms",
    "test_sls": "standard linear solids",
    "test_power_law": "power laws",
    "test_polyurea": "polyurea",
    "test_ratio_0.1": "modulus ratio 0.1",
    "test_slow_unloading": "slow unloading",
    "test_elastic": "elastic",
    "test_edges": "edges",
    "test_corners": "corners",
}
"""Words for the places of `make judge-fast`."""
ERROR_COLUMNS = ("pull-off force", "time since the dwell", "hysteresis", "curve, largest")
INSIDE = {
    "pull-off force": "Force in",
    "time since the dwell": "Time in",
    "hysteresis": "Loop in",
    "force": "Step in",
    "curve": "Curve in",
}


def place_rows(measured: dict[str, Any]) -> list[list[str]]:
    """Errors and coverages of a pretrained model by place, as rows of text."""
    rows = []
    for place, table in measured["places"].items():
        errors = [" / ".join(number(table[name][level], 2) for level in ("50", "90", "99")) for name in ERROR_COLUMNS]
        covered = [f"{table[name]['covered at 0.9']:.0f}" for name in INSIDE]
        count = table["trajectories"]
        rows.append([PLACES[place], f"{count['count']:,.0f}", *errors, *covered, f"{count['inside']:.0f}"])
    return rows


PLACE_HEADS = ["Place", "Contacts", *(f"{name.capitalize()} (%)" for name in ERROR_COLUMNS), *INSIDE.values(), "Taken"]


def ends_text(measured: dict[str, Any]) -> str:
    """The least coverages at the ends of the ranges and in single corners, as a sentence."""
    texts = []
    for place, what in (("test_edges", "ends of the ranges"), ("test_corners", "corners")):
        ends = {name: row for name, row in measured["places"][place].items() if name.startswith("at ")}
        least = {name: min(ends, key=lambda end, name=name: ends[end][name]) for name in INSIDE}
        shares = ", ".join(f"{ends[end][name]:.0f}" for name, end in least.items())
        few = min(row["count"] for row in ends.values())
        texts.append(f"at each of the {len(ends)} {what} ({few:.0f} contacts or more) at least {shares} %")
    return f"The 90 % intervals and bands contain {texts[0]}, in the order of the table. They contain {texts[1]}."


HEADS = ["Model", *PLACE_HEADS]
CALLS = ["Tool", "Batch (ms)", "Single (ms)", "Gradient (ms)", "Gradient error (%), median, p90"]
CALLS += ["Pull-off error (%), median, p95", "Pays after (calls)"]


def rows(pretrained: Path) -> list[list[str]]:
    """One row for each model and place."""
    measured = {name: read_json(pretrained / name / "errors.json") for name in PRETRAINED}
    return [[f"`{name}`", *row] for name, errors in measured.items() for row in place_rows(errors)]


def page_text(pretrained: Path) -> str:
    """The table for a page, and how it was made."""
    ends = (f"`{name}`: {ends_text(read_json(pretrained / name / 'errors.json'))}" for name in PRETRAINED)
    made = "Measured by `make judge-fast judge-accurate`."
    return "\n\n".join([markdown_table(HEADS, rows(pretrained), "ll" + "r" * (len(HEADS) - 2)), *ends, made])


def calls_text(gradients: Any, accuracy_cost: Any, published: Path) -> str:
    """The table of the ways to call for a page: times, errors, after how many calls a model pays, and its making."""
    lines, solver = [], seconds_of(accuracy_cost, "solver")["batch"]
    for name in (*gradients["solvers"], *gradients["models"]):
        seconds, errors = seconds_of(accuracy_cost, name), gradients["gradients"]["errors"][name]
        times = [f"{1e3 * value:.3g}" for value in (*seconds.values(), gradients["seconds"][name]["gradient"])]
        slope = ", ".join(number(errors[level], 2) for level in ("p50", "p90"))
        pays = "-"
        if name in gradients["models"]:
            model = line(name, "surrogate", seconds_before_use(name, published, solver), seconds["batch"])
            calls = break_even(model, line("solver", "solver", 0.0, solver))
            pays = "never" if calls is None else f"{float(f'{calls:.2g}'):,.0f}"
        lines.append([name, *times, slope, error_of(accuracy_cost, name), pays])
    return (
        f"{markdown_table(CALLS, lines, 'lrrrrrr')}\n\n"
        "`solver` is the solver at `standard` accuracy, `draft` the same at `draft`. Times of batches and single calls "
        f"with the force at the measurement steps, and errors of the pull-off force, by `{accuracy_cost['command']}`. "
        f"Errors of gradients on {gradients['count']} protocols, relative to the solver at "
        f"{gradients['gradients']['fine']:g}; measured by `{gradients['command']}` on {gradients['host']}."
    )


def error_of(accuracy_cost: Any, name: str) -> str:
    """Median and 95th percentile of the error of the pull-off force, in percent."""
    solver = {"solver": ("solver", "standard"), "draft": ("solver", "draft")}.get(name)
    errors = next(
        tool["errors"]["pull_off_force"]
        for tool in accuracy_cost["tools"]
        if ((tool["kind"], tool["setting"]) == solver if solver else name in (tool["kind"], tool.get("model")))
    )
    return ", ".join(number(100.0 * errors[level], 2) for level in ("median", "p95"))


def compose(accuracy_cost: Any, pretrained: Path) -> Table:
    """Write the table."""
    solver = 1e3 * seconds_of(accuracy_cost, "solver")["batch"]
    return Table(HEADS, rows(pretrained), caption("surrogates", solver=solver))


def curves_text(pretrained: Path) -> str:
    """Errors of the curves of the pretrained models, as sentences for the table of limits."""
    parts = []
    for name in PRETRAINED:
        for place, table in read_json(pretrained / name / "errors.json")["places"].items():
            mean, largest = table["curve, mean"], table["curve, largest"]
            values = ", ".join(number(part[level], 2) for part in (mean, largest) for level in ("50", "90"))
            parts.append(f"`{name}`, {PLACES[place]} {values}, {number(largest['99'], 2)}")
    return (
        "Errors of a curve in percent of its range, the mean at the median and 90th percentile, the largest there and "
        f"at the 99th: {'; '.join(parts)}"
    )

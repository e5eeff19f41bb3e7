"""Tables: seconds and errors of every tool on the same held-out protocols, and the fastest tool for a wanted error.

`make docs-numbers` also writes the second table into docs/cost.md. The tables read the measurement of
`experiments.measurements.accuracy_cost`.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from bem._support.wording import markdown_table
from bem.problem.accuracy import LOOSEST
from paper_figures.style.drawing import paper_seconds
from paper_figures.style.models_style import REFERENCE
from paper_figures.style.writing import Table, caption, left_out, median_and_p95, milliseconds, number, percent
from surrogate.files import PRETRAINED

CHOICES = [
    "Error wanted (%)",
    "Force, one at a time",
    "Force, many at once",
    "Pull-off force, one at a time",
    "Pull-off force, many at once",
]
LACKING = {"missing": "Not published when this was measured", "outdated": "Trained differently from those compared"}
WANTED = (0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4)
ERRORS = {"pull_off_force": "Pull-off error (%)", "force": "Force error (%)", "hysteresis": "Hysteresis error (%)"}


def run_to_run(tool: dict[str, Any]) -> str:
    """Range of the totals of the runs over their median, in percent; '-' for a single run, or without times."""
    totals, timed = tool["run_totals"], tool["seconds"]["median"] is not None
    return percent(np.ptp(totals) / np.median(totals)) if timed and len(totals) > 1 else "-"


COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Tool": lambda tool: tool["kind"],
    "Setting": lambda tool: tool["setting"],
    "Protocols (timed)": lambda tool: f"{tool['protocols']} ({tool['seconds']['count']})",
    "Repeats": lambda tool: str(tool["repeats"]),
    "Failed": lambda tool: str(tool["failures"]),
    "Time (ms), median (quartiles)": lambda tool: milliseconds(tool["seconds"]),
    "Run to run (%)": run_to_run,
    **{head: lambda tool, name=name: median_and_p95(tool["errors"][name]) for name, head in ERRORS.items()},
}
"""Column heads, and functions that write the cell of one tool; '-' for what it does not give."""


def fastest(tools: list[dict[str, Any]], quantity: str, tolerance: float, *, batch: bool) -> str:
    """The tool with the smallest median time whose 95th percentile of the error is at most `tolerance`, and its time.

    Only tools that were measured on every protocol without a failure are considered; with `batch`, those that predict
    many trajectories at once are included.
    """
    most = max(tool["protocols"] for tool in tools)
    able = [
        tool
        for tool in tools
        if tool["protocols"] == most
        and not tool["failures"]
        and tool["seconds"]["median"] is not None
        and tool["errors"][quantity]["p95"] is not None
        and tool["errors"][quantity]["p95"] <= tolerance
        and (batch or not tool.get("way", "").endswith("batch"))
    ]
    if not able:
        return "none"
    best = min(able, key=lambda tool: tool["seconds"]["median"])
    name = best["setting"] if best["kind"] == "surrogate" else f"{best['kind']}, {best['setting']}"
    return f"{name} ({number(1e3 * best['seconds']['median'])} ms)"


def choices(tools: list[dict[str, Any]]) -> list[list[str]]:
    """One row for each wanted error."""
    columns = [(quantity, batch) for quantity in ("force", "pull_off_force") for batch in (False, True)]
    return [
        [number(100.0 * tolerance), *(fastest(tools, quantity, tolerance, batch=batch) for quantity, batch in columns)]
        for tolerance in WANTED
    ]


def page_text(accuracy_cost: Any) -> str:
    """The table of the fastest tools as Markdown, for docs/cost.md."""
    protocols, refined = accuracy_cost["protocols"], _refined(accuracy_cost)
    few = f", {refined} of which have a refined solution" if refined < protocols else ""
    source = f"Measured on {protocols} held-out protocols{few}, one core of {accuracy_cost['host']}."
    return f"{markdown_table(CHOICES, choices(accuracy_cost['tools']))}\n\n{source}{left_out(accuracy_cost, LACKING)}"


def seconds_of(accuracy_cost: Any, name: str) -> dict[str, float]:
    """Median seconds of a trajectory, in batches and called alone: the numbers of every page that states a cost.

    The names are "solver", for standard accuracy, "draft", and those of models.
    """
    tools = accuracy_cost["tools"]
    if name in ("solver", "draft"):
        (alone,) = (t for t in tools if (t["kind"], t["setting"]) == ("solver", name.replace("solver", "standard")))
        return dict.fromkeys(("batch", "single"), alone["seconds"]["median"])
    own = {t["way"]: t["seconds"]["median"] for t in tools if t["kind"] == name or t.get("model") == name}
    return {call: own[f"{'NumPy' if name in PRETRAINED else 'ONNX'} {call}"] for call in ("batch", "single")}


def decision_text(accuracy_cost: Any, large_tabor: Any) -> str:
    """Which tool for which contact, with its error of the pull-off force and its time, for the front of the guide."""
    tools = {(tool["kind"], tool["setting"]): tool for tool in accuracy_cost["tools"]}
    cracks = [row["seconds"] for row in large_tabor["scenes"] if row["method"] == "sharp crack"]

    def cells(kind: str, setting: str) -> list[str]:
        tool = tools[kind, setting]
        error = tool["errors"]["pull_off_force"]["median"]
        return ["-" if error is None else percent(error), number(1e3 * tool["seconds"]["median"])]

    crack = [f"stated, at most {100.0 * LOOSEST:g}", f"{number(1e3 * float(np.median(cracks)))}, with its tables"]
    rows = [
        [
            "no adhesion, until the peak",
            "closed form (Lee and Radok)",
            *cells("closed form", "Lee and Radok, until the peak"),
        ],
        ["elastic, a Tabor parameter of about 0.2", "closed form (DMT)", *cells("closed form", "DMT, rubbery")],
        ["any protocol, solid and effects", "`bem simulate`", *cells("solver", "standard")],
        ["a Tabor parameter above about 20", "`bem simulate`, by a sharp crack", *crack],
        ["load, dwell, unload; any linear solid", "`fast`", *cells("fast", "NumPy single")],
        ["the same, more accurately", "`accurate`", *cells("accurate", "NumPy single")],
    ]
    return markdown_table(["Your contact", "Take", "Error of the pull-off force (%)", "Time of a call (ms)"], rows)


def solver_text(accuracy_cost: Any) -> str:
    """Cost and errors of the solver at each accuracy, as Markdown, for docs/solver-benchmark.md."""
    rows = []
    for tool in accuracy_cost["tools"]:
        if tool["kind"] != "solver":
            continue
        cells = [number(1e3 * tool["seconds"][of]) for of in ("mean", "median", "p95", "largest")]
        cells += [
            " / ".join(percent(tool["errors"][quantity][of]) for of in ("median", "p95", "largest"))
            for quantity in ERRORS
        ]
        rows.append([tool["setting"], f"{tool['target']:g}", str(tool["failures"]), *cells])
    header = ["Accuracy", "Target", "Failed", "Mean (ms)", "Median (ms)", "95th (ms)", "Largest (ms)", *ERRORS.values()]
    table = markdown_table(header, rows, "lrrrrrr")
    return f"{table}\n\n{accuracy_cost['protocols']} held-out protocols, one core of {accuracy_cost['host']}."


def calls_text(accuracy_cost: Any) -> str:
    """What each way to call the reference model costs, as Markdown, for docs/control.md."""
    ways = [tool for tool in accuracy_cost["tools"] if tool.get("model") == REFERENCE]
    slowest = max(tool["seconds"]["median"] for tool in ways)
    cells = [
        [tool["way"], f"{1e3 * tool['seconds']['median']:.3f}", f"{slowest / tool['seconds']['median']:.1f}"]
        for tool in ways
    ]
    header = ["way", "ms per trajectory", "times faster than model.predict"]
    measured = f"Measured on one core of {accuracy_cost['host']}."
    return f"{REFERENCE}, on one core\n\n{markdown_table(header, cells, 'lrr')}\n\n{measured}"


def _refined(measured: dict[str, Any]) -> int:
    """Number of protocols whose refined solution completed, so that their errors are known."""
    return max(tool["errors"]["force"]["count"] for tool in measured["tools"])


def compose(accuracy_cost: Any) -> dict[str, Table]:
    """Write the tables."""
    measured = accuracy_cost
    paper = ", ".join(f"{name} {number(seconds)} s" for name, seconds in paper_seconds().items())
    about = {"protocols": measured["protocols"], "host": measured["host"], "left_out": left_out(measured, LACKING)}
    truth = {"target": number(measured["truth_target"]), "refined": _refined(measured)}
    rows = [[cell(tool) for cell in COLUMNS.values()] for tool in measured["tools"]]
    return {
        "accuracy-cost": Table(list(COLUMNS), rows, caption("accuracy-cost", paper=paper, **about, **truth)),
        "fastest-tool": Table(CHOICES, choices(measured["tools"]), caption("fastest-tool", **about)),
    }

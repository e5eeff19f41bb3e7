"""The tables of `experiments.cost.bench_solver`, for the terminal and as Markdown."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

QUANTITIES = {"pull_off_force": "Pull-off force", "hysteresis": "Hysteresis", "force": "Force history"}

VALUES = ("found", "expected")
COST_HEADER = [
    *("Accuracy", "Target", "Trajectories", "Failed", "Mean (ms)", "Median (ms)", "95th (ms)", "Max (ms)"),
    *("Mean, processor (ms)", "Steps", "Iterations", "Nodes"),
]


class Section(NamedTuple):
    """One table with its title and what must be said with it."""

    title: str
    note: str
    header: list[str]
    rows: list[list[str]]


def percent(value: float) -> str:
    """A relative error in percent."""
    return f"{100.0 * value:.2g}"


def milliseconds(value: float) -> str:
    """Seconds as milliseconds."""
    return f"{1e3 * value:.3g}"


def sections(content: dict[str, Any]) -> Iterator[Section]:
    """All tables of a result."""
    levels = content["levels"]
    names = ("mean", "median", "p95", "max")
    yield Section(
        "Cost",
        f"{content['count']} random protocols of the paper's design (seed {content['seed']}), one after the other on "
        f"one core of: {content['host']}. Milliseconds of wall time, and the mean of processor time: they differ where "
        f"other programs wanted the core (load {content['load_before']:.1f} before the run). Yardstick: one "
        f"`numpy.linalg.solve` of a 100 x 100 system took {1e6 * content['yardstick_seconds']:.0f} microseconds.",
        COST_HEADER,
        [
            [level["accuracy"], f"{level['target']:g}", str(level["trajectories"]), str(len(level["failures"]))]
            + [milliseconds(level["seconds"][name]) for name in names]
            + [milliseconds(level["processor_seconds"]["mean"])]
            + [f"{level[name]:.0f}" for name in ("steps", "iterations", "nodes")]
            for level in levels
        ],
    )
    yield Section(
        "Errors",
        "Relative errors in percent, median / 95th / 99th percentile / largest, against solutions refined to a target "
        f"of {content['truth_target']:g}, which {max(level['compared'] for level in levels)} of the protocols have; "
        "the force history is sum |dP| / sum |P| over 120 measurement steps. `Met` is "
        "the share of the sample whose error is at most the target: pull-off force / hysteresis / force history.",
        ["Accuracy", "Target", *QUANTITIES.values(), "Met (%)"],
        [
            [level["accuracy"], f"{level['target']:g}"]
            + [
                " / ".join(percent(level["errors"][name][of]) for of in ("median", "p95", "p99", "max"))
                for name in QUANTITIES
            ]
            + [" / ".join(f"{100.0 * level['met'][name]:.1f}" for name in QUANTITIES)]
            for level in levels
        ],
    )
    yield Section(
        "Start-up and memory",
        "What the tables above leave out. Numba compiles the kernels once per machine and keeps them on disk.",
        ["Quantity", "Value"],
        [
            [f"{what}, {state} (s)", f"{seconds[name]:.3g}"]
            for state, seconds in content["first_call"].items()
            for name, what in (("import", "import"), ("first_call", "first call"), ("second_call", "second call"))
        ]
        + [
            *(
                [f"`bem simulate ...` to its answer, compiled before, {clock} time (s)", f"{seconds:.2f}"]
                for clock, seconds in content["command_seconds"].items()
            ),
            ["largest memory of one process over the sample at standard (MB)", f"{content['memory_bytes'] / 1e6:.0f}"],
        ],
    )
    theory = content["persson_brener"]
    yield Section(
        "Known results",
        "At accuracy standard. Persson-Brener holds for a crack at the edge of a large contact; at the crack "
        "velocities of the paper's table the difference from it is "
        f"{percent(theory['median'])} % in the median and at most {percent(theory['largest'])} %.",
        ["Quantity", "Found", "Expected", "Source", "Difference (%)"],
        [
            [line["quantity"], *(f"{line[name]:.5g}" for name in VALUES), line["source"], percent(line["difference"])]
            for line in content["closed_forms"]
        ],
    )


def show(content: dict[str, Any]) -> None:
    """Print the tables."""
    console = Console()
    for section in sections(content):
        table = Table(title=section.title, caption=section.note)
        for head in section.header:
            table.add_column(head)
        for cells in section.rows:
            table.add_row(*cells)
        console.print(table)


def markdown(content: dict[str, Any]) -> str:
    """The same as a document."""
    lines = ["# What the contact solver costs", "", f"Written by `{content['command']}`; do not edit.", ""]
    for section in sections(content):
        lines += [f"## {section.title}", "", section.note, ""]
        lines += ["| " + " | ".join(section.header) + " |", "|" + " --- |" * len(section.header)]
        lines += ["| " + " | ".join(cells) + " |" for cells in section.rows] + [""]
    failures = [f"{level['accuracy']}: {status}" for level in content["levels"] for status in level["failures"]]
    if failures:
        lines += ["## Not completed", "", *(f"- {failure}" for failure in failures), ""]
    return "\n".join(lines)

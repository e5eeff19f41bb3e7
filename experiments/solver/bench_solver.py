"""What the contact solver costs: milliseconds and errors over a random sample of the paper's box.

Trajectories run one after the other on one core. Times are processor seconds, and errors are against refined solutions,
both as in `experiments.solver.solver_processes`. The result is one JSON file and the tables of
`docs/solver-benchmark.md`. With `--baseline REVISION` the solver of the working tree is compared with that of a git
revision instead, also on scenes beyond the box.

Usage: `python -m experiments bench_solver [--count N] [--seed N] [--reference-count N] [--out FILE] [--report FILE]`,
or `python -m experiments bench_solver --baseline REVISION [--exact REVISION] [--accuracy NAME] [--count N]
[--seed N] [--repeats N] [--beyond N]`.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from threadpoolctl import threadpool_limits

from bem._support.command_line import parse_accuracy
from bem._support.provenance import provenance
from bem.accuracy import resolve_accuracy
from bem.solver.version import SOLVER_VERSION
from experiments.common import write_result
from experiments.robustness.known_results import known_results, summary
from experiments.solver import beyond_the_box, revision_comparison, solver_processes
from experiments.solver.startup import command_seconds
from experiments.timing import in_fresh_process, plain

RESULTS = Path("results/solver")
OUT, COMPARISON = RESULTS / "bench.json", RESULTS / "comparison.json"
REPORT = Path("docs/solver-benchmark.md")
QUANTITIES = {"pull_off_force": "Pull-off force", "hysteresis": "Hysteresis", "force": "Force history"}
FIRST_CALL = """
import time
started = time.process_time()
from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
imported = time.process_time()
protocol = LoadingProtocol(peak_indentation=15.0, loading_rate=1000.0, dwell_time=0.008, unloading_rate=1000.0)
case = Scene(3.2, StandardLinearSolid(0.1)), protocol
simulate(*case)
called = time.process_time()
simulate(*case)
print(imported - started, called - imported, time.process_time() - called)
"""
MEMORY = """
import resource, sys
from pathlib import Path
from experiments.solver.solver_child import answer
from experiments.solver.solver_processes import drawn
for request in drawn(int(sys.argv[1]), int(sys.argv[2])):
    answer(request | {"accuracy": "standard"})
status = Path("/proc/self/status")
if status.is_file():  # the resource usage of a child begins with that of its parent on Linux
    print(1024 * next(int(line.split()[1]) for line in status.open() if line.startswith("VmHWM")))
else:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024))
"""


class Section(NamedTuple):
    """One table, with its title and a note."""

    title: str
    note: str
    header: list[str]
    rows: list[list[str]]


def yardstick(repetitions: int = 200) -> float:
    """Median seconds of one `numpy.linalg.solve` of a 100 x 100 system on one BLAS thread."""
    generator = np.random.default_rng(0)
    matrix, right = generator.random((100, 100)) + 100.0 * np.eye(100), generator.random(100)
    seconds = []
    with threadpool_limits(limits=1, user_api="blas"):
        for _ in range(repetitions):
            started = time.perf_counter()
            np.linalg.solve(matrix, right)
            seconds.append(time.perf_counter() - started)
    return float(np.median(seconds))


def start_up(repetitions: int = 3) -> dict[str, dict[str, float]]:
    """Seconds of import, first and second call, with and without compiled kernels on disk, and of the command."""
    names = ("import", "first call", "second call")
    warm = dict(zip(names, in_fresh_process(FIRST_CALL), strict=True))
    with tempfile.TemporaryDirectory() as empty:
        cold = dict(zip(names, in_fresh_process(FIRST_CALL, NUMBA_CACHE_DIR=empty), strict=True))
    command = np.median([command_seconds(solver_processes.ROOT) for _ in range(repetitions)], axis=0)
    words = ("`bem simulate ...` to its answer, wall time", "`bem simulate ...` to its answer")
    warm |= dict(zip(words, command.tolist(), strict=True))
    return {"compiled before": warm, "nothing compiled": cold}


def measured(
    requests: list[solver_processes.Request],
    exact: np.ndarray,
    accuracies: tuple[str | float, ...],
    reference_count: int | None,
) -> list[dict[str, Any]]:
    """Cost and errors at every accuracy; failures are counted, and left out of the errors."""
    solver, levels = solver_processes.Solver(solver_processes.ROOT), []
    for accuracy in accuracies:
        target = resolve_accuracy(accuracy).target
        few = requests[:reference_count] if accuracy == "reference" else requests
        answers = solver_processes.in_turn({revision_comparison.NOW: solver}, few, accuracy, 1)[revision_comparison.NOW]
        found = solver_processes.judged(*answers, exact[: len(few)], target)
        levels.append({"accuracy": str(accuracy), "target": target, "trajectories": len(few), **found})
    solver.close()
    return levels


def percent(value: float) -> str:
    """A relative error in percent."""
    return f"{100.0 * value:.2g}"


def sections(content: dict[str, Any]) -> Iterator[Section]:
    """All tables of a result."""
    levels, work = content["levels"], ("steps", "iterations", "factorisations", "nodes")
    yield Section(
        "Cost",
        f"{content['count']} random protocols of the paper's box (seed {content['seed']}), one after the other on one "
        f"core of: {content['host']}. Milliseconds of processor time. Yardstick: one `numpy.linalg.solve` of a 100 x "
        f"100 system took {1e6 * content['yardstick_seconds']:.0f} microseconds.",
        ["Accuracy", "Target", "Trajectories", "Failed", "Mean (ms)", "Median (ms)", "95th (ms)", "Max (ms)"]
        + [name.capitalize() for name in work],
        [
            [level["accuracy"], f"{level['target']:g}", str(level["trajectories"]), str(len(level["failures"]))]
            + [f"{1e3 * level['seconds'][of]:.3g}" for of in ("mean", "median", "p95", "largest")]
            + [f"{level['work'][name]:.0f}" for name in work]
            for level in levels
        ],
    )
    yield Section(
        "Errors",
        "Relative errors in percent, median / 95th percentile / largest, against solutions refined to a target of "
        f"{content['truth_target']:g}, which {max(level['compared'] for level in levels)} of the protocols have; that "
        "of the force history is mean |dP| over the range of P at 120 measurement steps. `Met` is the share of the "
        "sample whose error is at most the target: pull-off force / hysteresis / force history.",
        ["Accuracy", "Target", *QUANTITIES.values(), "Met (%)"],
        [
            [level["accuracy"], f"{level['target']:g}"]
            + [
                " / ".join(percent(level["errors"][name][of]) for of in ("median", "p95", "largest"))
                for name in QUANTITIES
            ]
            + [" / ".join(f"{100.0 * level['met'][name]:.1f}" for name in QUANTITIES)]
            for level in levels
        ],
    )
    yield Section(
        "Start-up and memory",
        "Costs that the tables above leave out, in processor seconds unless stated otherwise. Numba compiles the "
        "kernels once per machine and keeps them on disk.",
        ["Quantity", "Value"],
        [
            [f"{what}, {state} (s)", f"{seconds:.3g}"]
            for state, found in content["start_up"].items()
            for what, seconds in found.items()
        ]
        + [["largest memory of one process over the sample at standard (MB)", f"{content['memory_bytes'] / 1e6:.0f}"]],
    )
    theory = content["persson_brener"]
    yield Section(
        "Known results",
        "At accuracy standard. Persson-Brener holds for a crack at the edge of a large contact; at the crack "
        "velocities of the paper's table the difference from it is "
        f"{percent(theory['median'])} % in the median and at most {percent(theory['largest'])} %.",
        ["Quantity", "Found", "Expected", "Source", "Difference (%)"],
        [
            [
                one["quantity"],
                f"{one['found']:.5g}",
                f"{one['expected']:.5g}",
                one["source"],
                percent(one["difference"]),
            ]
            for one in content["known_results"]
        ],
    )


def markdown(content: dict[str, Any]) -> str:
    """The tables as a document."""
    lines = ["# What the contact solver costs", "", f"Written by `{content['command']}`; do not edit.", ""]
    for section in sections(content):
        lines += [f"## {section.title}", "", section.note, ""]
        lines += ["| " + " | ".join(section.header) + " |", "|" + " --- |" * len(section.header)]
        lines += ["| " + " | ".join(cells) + " |" for cells in section.rows] + [""]
    failures = [f"{level['accuracy']}: {status}" for level in content["levels"] for _, status in level["failures"]]
    if failures:
        lines += ["## Not completed", "", *(f"- {failure}" for failure in failures), ""]
    return "\n".join(lines)


def main(
    count: Annotated[int, typer.Option(help="Protocols in the sample.")] = 300,
    seed: Annotated[int, typer.Option(help="Seed of the sample.")] = 1,
    reference_count: Annotated[int | None, typer.Option(help="Protocols at reference; all by default.")] = None,
    jobs: Annotated[int, typer.Option(help="Processes for the refined solutions, which are not timed.")] = 2,
    out: Annotated[Path | None, typer.Option(help="Result file to write.")] = None,
    report: Annotated[Path, typer.Option(help="Markdown file to write.")] = REPORT,
    baseline: Annotated[str, typer.Option(help="Git revision to compare with, instead of the report.")] = "",
    exact_by: Annotated[str, typer.Option("--exact", help="Revision of the refined solutions.")] = "",
    accuracy: Annotated[list[str] | None, typer.Option(help="Accuracy; repeatable.")] = None,
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each revision; the fastest counts.")] = 3,
    beyond: Annotated[int, typer.Option(min=0, help="Scenes of each sample beyond the box, with --baseline.")] = 100,
) -> None:
    """Measure, print the tables and write them."""
    accuracies = tuple(map(parse_accuracy, accuracy or ())) or revision_comparison.ACCURACIES
    for one in accuracies:
        resolve_accuracy(one)  # before anything runs
    command = f"bench_solver --count {count} --seed {seed}"
    if baseline:
        found = revision_comparison.compare(baseline, exact_by or baseline, accuracies, count, seed, repeats, jobs)
        revision_comparison.show(found)
        if beyond:
            found["beyond"] = beyond_the_box.compare(baseline, "standard", beyond, seed, repeats)
            beyond_the_box.show(found["beyond"])
        write_result(out or COMPARISON, f"{command} --baseline {baseline} --repeats {repeats}", plain(found))
        return
    requests = solver_processes.drawn(count, seed)
    rows = known_results()
    content = {
        **provenance(f"python -m experiments {command}"),
        "count": count,
        "seed": seed,
        "truth_target": solver_processes.EXACT_TARGET,
        "levels": measured(
            requests,
            solver_processes.refined(requests, solver_processes.ROOT, SOLVER_VERSION, jobs),
            accuracies,
            reference_count,
        ),
        "yardstick_seconds": yardstick(),
        "start_up": start_up(),
        "memory_bytes": in_fresh_process(MEMORY, count, seed)[0],
        "known_results": rows,
        "persson_brener": summary(rows),
    }
    write_result(out or OUT, command, plain(content))
    text = markdown(content)
    report.write_text(text, encoding="utf-8")
    print(text)

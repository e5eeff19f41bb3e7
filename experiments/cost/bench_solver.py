"""What accuracy costs: milliseconds and errors of the contact solver over a random sample of the paper's design.

Everything runs in one process on one core, trajectories one after the other. Errors are against the refined solutions
of `experiments.cost.solver_sample`. Wall and processor time are both reported: they agree when the machine is quiet.
Result: one JSON file, and the tables of `docs/solver-benchmark.md`. With `--baseline REVISION` the solver of the
working tree is compared with that of a git revision instead, as `experiments.cost.revision_comparison` does it.

Usage: `python -m experiments bench_solver [--count N] [--seed N] [--reference-count N] [--out FILE] [--report FILE]`,
or `python -m experiments bench_solver --baseline REVISION [--exact REVISION] [--accuracy NAME] [--count N]
[--seed N] [--repeats N]`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.progress import track
from threadpoolctl import threadpool_limits

from bem._support.command_line import run_main
from bem._support.provenance import provenance
from bem.accuracy import NAMED_TARGETS
from experiments.common import write_result
from experiments.cost import bench_report, revision_comparison
from experiments.cost.closed_forms import closed_forms, summary
from experiments.cost.solver_sample import RESULTS, TRUTH_TARGET, Case, relative_errors, sample_cases, truth
from experiments.timing import plain

OUT = RESULTS / "bench.json"
REPORT = Path("docs/solver-benchmark.md")
LEVELS: tuple[str | float, ...] = ("draft", "standard", "reference", 1e-2, 3e-3, 1e-3, 3e-4)
COMMAND = ("simulate", "--tabor", "3.2", "--peak-indentation", "15", "--loading-rate", "1000")
COMMAND += ("--dwell-time", "0.008", "--unloading-rate", "1000")
FIRST_CALL = """
import time
started = time.perf_counter()
from experiments.cost.solver_sample import sample_cases
case = sample_cases(1, 1)[0]
imported = time.perf_counter()
case.run("standard")
called = time.perf_counter()
case.run("standard")
print(imported - started, called - imported, time.perf_counter() - called)
"""
MEMORY = """
import resource, sys
from pathlib import Path
from experiments.cost.solver_sample import sample_cases
for case in sample_cases(int(sys.argv[1]), int(sys.argv[2])):
    case.run("standard")
status = Path("/proc/self/status")
if status.is_file():  # the resource usage of a child begins with that of its parent on Linux
    print(1024 * next(int(line.split()[1]) for line in status.open() if line.startswith("VmHWM")))
else:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024))
"""


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


def in_fresh_process(source: str, *arguments: object, **environment: str) -> list[float]:
    """Numbers that a piece of Python prints in a process of its own."""
    command = [sys.executable, "-c", source, *map(str, arguments)]
    answer = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return [float(word) for word in answer.stdout.split()]


def first_call() -> dict[str, dict[str, float]]:
    """Seconds of import, first and second call, with the compiled kernels on disk and with nothing."""
    names = ("import", "first_call", "second_call")
    warm = dict(zip(names, in_fresh_process(FIRST_CALL), strict=True))
    with tempfile.TemporaryDirectory() as empty:
        cold = dict(zip(names, in_fresh_process(FIRST_CALL, NUMBA_CACHE_DIR=empty), strict=True))
    return {"compiled before": warm, "nothing compiled": cold}


def command_seconds(repetitions: int = 3) -> dict[str, float]:
    """Median seconds, and median processor seconds, from `bem simulate` to its answer."""
    wall, processor = [], []
    for _ in range(repetitions):
        before, started = os.times(), time.perf_counter()
        subprocess.run([sys.executable, "-m", "bem", *COMMAND], capture_output=True, check=True)
        wall.append(time.perf_counter() - started)
        after = os.times()
        processor.append(after.children_user - before.children_user + after.children_system - before.children_system)
    return {"wall": float(np.median(wall)), "processor": float(np.median(processor))}


def distribution(values: np.ndarray) -> dict[str, float]:
    """Mean, median, 95th and 99th percentile and maximum."""
    low, p95, p99 = np.percentile(values, [50.0, 95.0, 99.0])
    found = {"mean": values.mean(), "median": low, "p95": p95, "p99": p99, "max": values.max()}
    return {name: float(value) for name, value in found.items()}


def measure(level: str | float, cases: list[Case], exact: np.ndarray) -> dict[str, Any]:
    """Cost and errors at one accuracy; failures are counted, and left out of the errors."""
    rows, wall, processor, statistics, failures = [], [], [], [], []
    for case in track(cases, description=f"accuracy {level}"):
        started = time.process_time()
        trajectory = case.run(level)
        processor.append(time.process_time() - started)
        wall.append(trajectory.stats.seconds)
        statistics.append((trajectory.stats.steps, trajectory.stats.iterations, trajectory.stats.nodes))
        if trajectory.completed:
            scalars = [trajectory.pull_off_force, trajectory.hysteresis, trajectory.stats.seconds]
            rows.append(np.concatenate([scalars, case.force_history(trajectory)]))
        else:
            failures.append(trajectory.status)
            rows.append(np.full(exact.shape[1], np.nan))
    found = relative_errors(np.array(rows), exact[: len(cases)])
    known = np.isfinite(found["force"])
    target = NAMED_TARGETS[level] if isinstance(level, str) else level
    steps, iterations, nodes = np.mean(statistics, axis=0)
    return {
        "accuracy": level if isinstance(level, str) else f"{level:g}",
        "target": target,
        "trajectories": len(cases),
        "failures": failures,
        "compared": int(np.sum(known)),
        "seconds": distribution(np.array(wall)),
        "processor_seconds": distribution(np.array(processor)),
        "errors": {name: distribution(values[known]) for name, values in found.items()},
        "met": {name: float(np.mean(values[known] <= target)) for name, values in found.items()},
        "steps": steps,
        "iterations": iterations,
        "nodes": nodes,
    }


def main(
    count: Annotated[int, typer.Option(help="Protocols in the sample.")] = 300,
    seed: Annotated[int, typer.Option(help="Seed of the sample.")] = 1,
    reference_count: Annotated[int | None, typer.Option(help="How many of them at reference; all by default.")] = None,
    jobs: Annotated[int, typer.Option(help="Processes for the refined solutions, which are not timed.")] = 2,
    out: Annotated[Path | None, typer.Option(help="Result file to write.")] = None,
    report: Annotated[Path, typer.Option(help="Markdown file to write.")] = REPORT,
    baseline: Annotated[str, typer.Option(help="Git revision to compare with, instead of the report.")] = "",
    exact_by: Annotated[str, typer.Option("--exact", help="Revision of the refined solutions; the baseline's.")] = "",
    accuracy: Annotated[list[str] | None, typer.Option(help="An accuracy to compare at; repeatable.")] = None,
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each revision, of which the fastest counts.")] = 3,
) -> None:
    """Measure, print the tables and write them."""
    if baseline:
        accuracies = [revision_comparison.asked(words) for words in accuracy or ()] or revision_comparison.ACCURACIES
        found = revision_comparison.compare(baseline, exact_by or baseline, accuracies, count, seed, repeats, jobs)
        revision_comparison.show(found)
        command = f"bench_solver --baseline {baseline} --count {count} --seed {seed} --repeats {repeats}"
        write_result(out or RESULTS / "comparison.json", command, plain(found))
        return
    exact = truth(count, seed, jobs=jobs)
    load_before = os.getloadavg()[0]
    yardstick_seconds = yardstick()
    cases = sample_cases(count, seed)
    first = first_call()
    cases[0].run("standard")
    levels = [measure(level, cases[:reference_count] if level == "reference" else cases, exact) for level in LEVELS]
    rows = closed_forms()
    content = {
        "count": count,
        "seed": seed,
        "truth_target": TRUTH_TARGET,
        "yardstick_seconds": yardstick_seconds,
        "load_before": load_before,
        "first_call": first,
        "levels": levels,
        "memory_bytes": in_fresh_process(MEMORY, count, seed)[0],
        "closed_forms": rows,
        "persson_brener": summary(rows),
        "command_seconds": command_seconds(),
        **provenance(f"python -m experiments.cost.bench_solver --count {count} --seed {seed}"),
    }
    out = out or OUT
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    bench_report.show(content)
    report.write_text(bench_report.markdown(content), encoding="utf-8")


if __name__ == "__main__":
    run_main(main)

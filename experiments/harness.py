"""The harness of all measurements: tools on cases, timed on one core, written in one format.

A tool is a function from a case to an answer, an array. `run` calls it on every case and returns the answers and the
processor seconds; each question (a module of `measurements/` or of a folder beside it) lists its tools and cases and
summarises them. A question is a function `study` that returns the content of its result; `python -m experiments`
publishes it together with its command and provenance.

Times are processor seconds of whole calls on one thread. The first call, which loads compiled kernels, is not counted.
If other programs compete for the core, processor seconds fall below wall seconds, and also exceed those of an idle
machine. A measurement is therefore not published if its processor seconds are too small a share of the wall seconds.
"""

import hashlib
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

import numpy as np
import typer

from bem._support.interruption import without_interrupts
from bem._support.outputs import write_whole
from bem._support.text_files import plain

NOT_PUBLISHED = Path("results/measurements")
"""Folder of measurements made on a busy machine."""
LEAST_SHARE = 0.9
"""Least ratio of processor seconds to wall seconds; below it, the machine counts as busy."""
SAID_EVERY = 20.0  # seconds between two lines on progress
BUDGET = 240.0  # seconds in all runs of a tool, beyond which it is not run again
Item = TypeVar("Item")
Jobs = Annotated[int, typer.Option(help="Processes.")]
Count = Annotated[int, typer.Option(min=1, help="Number of cases, of each kind where there are several.")]
Repeats = Annotated[int, typer.Option(min=1, help="Runs of each tool, where its budget of time allows.")]
Seed = Annotated[int, typer.Option(help="Seed of the draw.")]


def clock_seconds() -> tuple[float, float]:
    """Wall seconds, and processor seconds of this process on all cores, since any instant."""
    return time.perf_counter(), time.process_time()


class Clock:
    """Measures the code inside `with clock:`, in processor seconds, and their ratio to wall seconds over all runs."""

    def __init__(self) -> None:
        self.seconds = 0.0
        """Processor seconds of the last run."""
        self._wall = self._processor = 0.0

    @property
    def share(self) -> float | None:
        """Ratio of processor to wall seconds over all runs, of which one counts as at most 1; `None` without a run."""
        return self._processor / self._wall if self._wall > 0.0 else None

    def __enter__(self) -> Self:
        self._started = clock_seconds()
        return self

    def __exit__(self, *_: object) -> None:
        wall, self.seconds = np.subtract(clock_seconds(), self._started).tolist()
        self._wall, self._processor = self._wall + wall, self._processor + min(self.seconds, wall)


CLOCK = Clock()


def progress(items: Iterable[Item], label: str, total: int | None = None) -> Iterator[Item]:
    """Yield the items one by one, and say on standard error how many are done and how long the rest will take.

    The time of the first is left out of the estimate, because programs start and kernels are compiled in it. `total` is
    required if `items` has no length.
    """
    count = len(items) if total is None else total  # type: ignore[arg-type]
    started = printed = first = time.perf_counter()
    for done, item in enumerate(items, start=1):
        yield item
        now = time.perf_counter()
        first = now if done == 1 else first
        if now - printed > SAID_EVERY or (done == count and now - started > SAID_EVERY):
            left = f", {timedelta(seconds=round((now - first) * (count - done) / (done - 1)))} left" if done > 1 else ""
            print(f"{label}: {done} of {count}{left}", file=sys.stderr, flush=True)
            printed = now


def timed(function: Callable[[], Any], repeats: int = 1, *, first: bool = True) -> list[float]:
    """Processor seconds of each of `repeats` calls; with `first`, after one call that is not counted."""
    if first:
        function()
    seconds = []
    for _ in range(repeats):
        with CLOCK:
            function()
        seconds.append(CLOCK.seconds)
    return seconds


def run(
    tool: Callable[[Item], np.ndarray], cases: Sequence[Item], repeats: int, label: str
) -> tuple[np.ndarray, np.ndarray]:
    """Run a tool on every case, after one call that is not counted, and again while `BUDGET` allows.

    Returns:
        Answers of the first run, of shape (cases, size), and processor seconds, of shape (runs, cases).
    """
    tool(cases[0])
    answers, runs, spent = list[np.ndarray](), list[list[float]](), 0.0
    while not runs or (len(runs) < repeats and spent + spent / len(runs) <= BUDGET):
        seconds = []
        for case in progress(cases, f"{label}, run {len(runs) + 1} of {repeats}"):
            with CLOCK:
                result = tool(case)
            seconds.append(CLOCK.seconds)
            if not runs:
                answers.append(result)
        runs.append(seconds)
        spent += sum(seconds)
    return np.array(answers), np.array(runs)


def in_turn(calls: Mapping[Item, tuple[Callable[[int], Any], int]], rounds: int) -> dict[Item, float]:
    """Median processor seconds of a case by several calls that take turns, so that a slow moment hits all of them.

    `calls` are functions of the round's number, with the cases of one call; the first round is not counted.
    """
    spent: dict[Item, list[float]] = {name: [] for name in calls}
    for turn in range(-1, rounds):
        for name, (call, cases) in calls.items():
            with CLOCK:
                call(max(turn, 0))
            if turn >= 0:
                spent[name].append(CLOCK.seconds / cases)
    return {name: float(np.median(seconds)) for name, seconds in spent.items()}


def of_command(*arguments: str, **environment: str) -> tuple[float, float]:
    """Wall and processor seconds of a `bem` command, its workers included."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "bem", *arguments]
    subprocess.run(command, env=os.environ | environment, check=True, capture_output=True)
    wall, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def in_parallel(
    function: Callable[..., Item], arguments: Sequence[Sequence[Any]], *, jobs: int, label: str
) -> list[Item]:
    """Results of a function for each tuple of arguments, computed in `jobs` processes, in order."""
    from joblib import Parallel, delayed

    with without_interrupts():
        results = Parallel(n_jobs=jobs, return_as="generator")(delayed(function)(*some) for some in arguments)
    return list(progress(results, label, len(arguments)))


def kept(path: Path, compute: Callable[[], Any]) -> Any:
    """The content of a JSON file, computed and written if the file does not exist, so that a long run continues."""
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps(plain(compute())) + "\n")
    return json.loads(path.read_text(encoding="utf-8"))


def fingerprint(**parts: Any) -> str:
    """Digest that identifies a kept result; pass every value on which the result depends."""
    return hashlib.sha256(json.dumps(plain(parts), sort_keys=True).encode()).hexdigest()[:16]


def publish(out: Path, study: str, result: dict[str, Any], *, busy: bool) -> None:
    """Write a result and say where; of a measurement its numbers, with the ratio of processor seconds to wall seconds.

    Args:
        out: The result file.
        study: The study with its inputs and options, as the file records its command.
        result: The result; numbers that are not finite become `None` in a measurement, and are refused elsewhere.
        busy: Publish the measurement even if the machine was busy.

    Raises:
        RuntimeError: The machine was too busy; the measurement is written to `NOT_PUBLISHED`.
    """
    from experiments.common import write_result  # imported here, because it loads the solver

    share = CLOCK.share
    believed = share is None or share >= LEAST_SHARE
    path = out if busy or believed else NOT_PUBLISHED / out.name
    if share is not None:
        result = result | {"processor_share": share}
    write_result(path, study, result if out.parent.name == "studies" else plain(result))
    facts = {**result, **result.get("summary", {})}.items()
    numbers = ", ".join(f"{name} {number:.4g}" for name, number in facts if isinstance(number, int | float))
    print(path if out.parent.name == "studies" else f"{path}: {numbers}")
    if believed:
        return
    doubt = (
        "the machine was too busy to believe these seconds: the processor's must be at least "
        f"{100 * LEAST_SHARE:.0f} % of the wall's; received {100 * share:.0f} %"
    )
    if not busy:
        raise RuntimeError(
            f"{doubt}; they are kept in {str(path)!r} and not published; measure on an idle machine, or publish them "
            "with --busy (BUSY=yes for make)"
        )
    print(f"{doubt}; published nevertheless, because of --busy", file=sys.stderr)

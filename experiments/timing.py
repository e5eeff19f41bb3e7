"""Code shared by the measurements: options, timing, statistics, progress, and parallel processes.

Times are processor seconds of whole calls on one thread. The first call, which loads compiled kernels, is not counted.
If other programs compete for the core, processor seconds fall below wall seconds, and also exceed those of an idle
machine. A measurement is therefore not published if its processor seconds are too small a share of the wall seconds.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

import numpy as np
import typer

from bem._support.plain_json import plain

MEASUREMENTS = Path("published/measurements")
"""Folder of measurements: results that take long or depend on the machine."""
FORCE_ERROR = "mean |P - P*| / range of P*"
"""The error of a force history in all measurements of cost: see `force_error`."""
NOT_PUBLISHED = Path("results/measurements")
"""Folder of measurements made on a busy machine."""
LEAST_SHARE = 0.9
"""Least ratio of processor seconds to wall seconds; below it, the machine counts as busy."""
SAID_EVERY = 20.0  # seconds between two lines of progress if the output is not a terminal
Item = TypeVar("Item")
Busy = Annotated[bool, typer.Option("--busy", help="Publish the measurement even if the machine was busy.")]
Out = Annotated[Path, typer.Option(help="Result file to write.")]
DatasetFile = Annotated[Path, typer.Option(help="Data set file.")]
Models = Annotated[Path, typer.Option(help="Folder of trained models.")]
Jobs = Annotated[int, typer.Option(help="Processes.")]
"""Options of several measurements; every measurement of seconds has `Busy`."""


class Clock:
    """Measures the code inside `with clock:`: wall and processor seconds, and their ratio over all runs so far.

    Args:
        processor: Function that returns the processor seconds of this process, on all cores.
        wall: Function that returns the wall time in seconds.
    """

    def __init__(
        self,
        processor: Callable[[], float] = time.process_time,
        wall: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.wall, self.seconds = 0.0, 0.0
        """Wall and processor seconds of the last run."""
        self._clocks = (wall, processor)
        self._spent = [0.0, 0.0]

    @property
    def share(self) -> float:
        """Ratio of processor seconds to wall seconds over all runs; the ratio of one run counts as at most 1."""
        wall, processor = self._spent
        return processor / wall if wall > 0.0 else 1.0

    def __enter__(self) -> Self:
        self._started = [clock() for clock in self._clocks]
        return self

    def __exit__(self, *_: object) -> None:
        ended = [clock() for clock in self._clocks]
        self.wall, self.seconds = (end - begin for begin, end in zip(self._started, ended, strict=True))
        self._spent = [self._spent[0] + self.wall, self._spent[1] + min(self.seconds, self.wall)]


CLOCK = Clock()
"""The clock of this process."""


def force_error(found: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Mean absolute difference of two forces over the range of the exact one.

    Args:
        found: Forces of shape (count, steps); NaN at steps for which a tool gives no force. These are left out.
        exact: Exact forces, of the same shape.

    Returns:
        Errors of shape (count,); NaN for a trajectory without any force.
    """
    known = np.isfinite(found)
    total = np.sum(np.abs(np.where(known, found - exact, 0.0)), axis=1)
    counted = np.count_nonzero(known, axis=1)
    return np.where(counted > 0, total / np.maximum(counted, 1), np.nan) / np.ptp(exact, axis=1)


def fingerprint(**parts: Any) -> str:
    """Digest that identifies a cached result; pass every value on which the result depends."""
    return hashlib.sha256(json.dumps(plain(parts), sort_keys=True).encode()).hexdigest()[:16]


def progress(
    items: Iterable[Item], label: str, total: int | None = None, shares: Sequence[float] | None = None
) -> Iterator[Item]:
    """Yield the items one by one, and show how many are done and how long the rest will take.

    The time of the first is left out of the estimate, because programs start and kernels are compiled in it.

    Args:
        items: The items; each takes the same time, unless `shares` is given.
        label: Name of the items in the messages.
        total: Number of items, required if `items` has no length.
        shares: Expected time of each item, in any unit.
    """
    count = len(items) if total is None else total  # type: ignore[arg-type]
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import Progress

        with Progress(console=Console(stderr=True)) as bar:
            task = bar.add_task(label, total=count if shares is None else sum(shares))
            for done, item in enumerate(items):
                yield item
                bar.advance(task, 1.0 if shares is None else shares[done])
        return
    started = said = first = time.perf_counter()
    for done, item in enumerate(items, start=1):
        yield item
        now = time.perf_counter()
        if done == 1:
            first = now
        if now - said > SAID_EVERY or (done == count and now - started > SAID_EVERY):
            left = ""
            if done > 1:
                rest = (count - done) / (done - 1) if shares is None else sum(shares[done:]) / sum(shares[1:done])
                left = f", {timedelta(seconds=round((now - first) * rest))} left"
            print(f"{label}: {done} of {count}{left}", file=sys.stderr, flush=True)
            said = now


def in_parallel(
    function: Callable[..., Item], arguments: Sequence[Sequence[Any]], *, jobs: int, label: str, ordered: bool = True
) -> list[Item]:
    """Results of a function for each tuple of arguments, computed in `jobs` processes; in order, or as they arrive."""
    from joblib import Parallel, delayed

    order = "generator" if ordered else "generator_unordered"
    results = Parallel(n_jobs=jobs, return_as=order)(delayed(function)(*some) for some in arguments)
    return list(progress(results, label, len(arguments)))


def spread(values: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Count, mean, median, quartiles, 95th percentile and maximum of the finite values; NaN if there are none."""
    array = np.asarray(values, dtype=np.float64)
    array = array[np.isfinite(array)]
    names = {"median": 50.0, "low": 25.0, "high": 75.0, "p95": 95.0, "largest": 100.0}
    if array.size == 0:
        return {"count": 0, "mean": np.nan, **dict.fromkeys(names, np.nan)}
    found = {name: float(np.percentile(array, percent)) for name, percent in names.items()}
    return {"count": int(array.size), "mean": float(array.mean()), **found}


def timed(function: Callable[[], Any], repeats: int, *, first: bool = True) -> list[float]:
    """Processor seconds of each of `repeats` calls; with `first`, after one call that is not counted."""
    if first:
        function()
    seconds = []
    for _ in range(repeats):
        with CLOCK:
            function()
        seconds.append(CLOCK.seconds)
    return seconds


def in_fresh_process(source: str, *arguments: object, **environment: str) -> list[float]:
    """Run Python source in a new process and return the numbers that it prints."""
    command = [sys.executable, "-c", source, *map(str, arguments)]
    answer = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return [float(word) for word in answer.stdout.split()]


def publish(out: Path, study: str, content: Mapping[str, Any], *, busy: bool) -> None:
    """Write a measurement of time, with the ratio of processor seconds to wall seconds.

    Args:
        out: The result file.
        study: The module and its options, as the file records its command.
        content: The measurement.
        busy: Publish the measurement even if the machine was busy.

    Raises:
        RuntimeError: The machine was too busy; the measurement is written to `NOT_PUBLISHED`.
    """
    from experiments.common import write_result  # imported here, because it loads the solver

    share = CLOCK.share
    place = out if busy or share >= LEAST_SHARE else NOT_PUBLISHED / out.name
    write_result(place, study, plain({**content, "processor_share": share}))
    if share >= LEAST_SHARE:
        return
    doubt = (
        "the machine was too busy to believe these seconds: the processor's must be at least "
        f"{100 * LEAST_SHARE:.0f} % of the wall's; received {100 * share:.0f} %"
    )
    if not busy:
        raise RuntimeError(
            f"{doubt}; they are kept in {str(place)!r} and not published; measure on an idle machine, or publish them "
            "with --busy (BUSY=yes for make)"
        )
    print(f"{doubt}; published nevertheless, because of --busy", file=sys.stderr)


def exponent(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """Slope of log y over log x by linear least squares, and its standard error."""
    from scipy.stats import linregress  # half a second to import

    found = linregress(np.log(x), np.log(y))
    return float(found.slope), float(found.stderr)

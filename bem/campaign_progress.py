"""How a running campaign shows itself on a terminal: rate, failures and time left; silent elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta


@contextmanager
def progress_bar(total: int) -> Iterator[Callable[[int, int], None]]:
    """Give a function that shows how many trajectories are done and how many of them failed."""
    if not sys.stderr.isatty():
        yield lambda _done, _failed: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    begun: tuple[float, int] | None = None
    columns = BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[line]}")
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=total, line="starting workers")

        def show(done: int, failed: int) -> None:
            nonlocal begun
            # What an earlier call did says nothing about the rate of this one.
            begun = begun or (time.perf_counter(), done)
            line = rate_line(done - begun[1], total - done, failed, time.perf_counter() - begun[0])
            bar.update(task, completed=done, line=line)

        yield show


def rate_line(done: int, left: int, failed: int, seconds: float) -> str:
    """Rate, failures and time left in words; `done` trajectories took `seconds`."""
    failures = f"{failed} failed" if failed else "none failed"
    if not done or seconds <= 0.0:
        return failures
    rate = done / seconds
    return f"{rate:.1f} a second, {failures}, {timedelta(seconds=round(left / rate))} left"

"""Progress of a campaign or verification on a terminal: rate, failures and time left; nothing elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta


@contextmanager
def progress_bar(total: int, counted: str = "failed") -> Iterator[Callable[..., None]]:
    """Give a function of the number of trajectories done and of those `counted`, such as failed; it shows both.

    Its third argument is another total, where that was not known before.
    """
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    begun: tuple[float, int] | None = None
    columns = BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[line]}")
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=total, line="starting workers")

        def show(done: int, bad: int, of: int = total) -> None:
            nonlocal begun
            # What an earlier call did says nothing about the rate of this one.
            begun = begun or (time.perf_counter(), done)
            line = rate_line(done - begun[1], of - done, bad, time.perf_counter() - begun[0], counted)
            bar.update(task, completed=done, total=of, line=line)

        yield show


def rate_line(done: int, left: int, bad: int, seconds: float, counted: str = "failed") -> str:
    """Rate, number of those `counted` and time left, in words; `done` trajectories took `seconds`."""
    failures = f"{bad or 'none'} {counted}"
    if not done or seconds <= 0.0:
        return failures
    rate = done / seconds
    return f"{rate:.1f} a second, {failures}, {timedelta(seconds=round(left / rate))} left"

"""Progress of a campaign or verification on a terminal: counts and time left; nothing elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(total: int, counted: str = "failed") -> Iterator[Callable[..., None]]:
    """Give a function of the number of trajectories done and of those `counted`, such as failed; it shows both.

    Its third argument is another total, where that was not known before.
    """
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[line]}"), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=total, line="starting workers")
        change: Callable[..., None] = bar.reset  # what an earlier call did says nothing about the rate of this one

        def show(done: int, bad: int, of: int = total) -> None:
            nonlocal change
            change(task, completed=done, total=of, line=f"{bad or 'none'} {counted}, left:")
            change = bar.update

        yield show

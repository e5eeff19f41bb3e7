"""Display of the progress of a training: a progress bar on a terminal, one line per epoch elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from surrogate.training.loop import EpochReport


def epoch_line(epoch: EpochReport) -> str:
    """Return the result of an epoch as one line of text."""
    row = epoch.row
    left = timedelta(seconds=round(epoch.seconds_left))
    return (
        f"epoch {row['epoch']}/{epoch.epochs}  train MSE {row['train_mse']:.3e}  "
        f"validation MSE {row['validation_mse']:.3e}  rate {row['learning_rate']:.2e}  "
        f"{row['seconds']:.0f} s, at most {left} left"
    )


@contextmanager
def reporter(name: str) -> Iterator[Callable[[EpochReport], None]]:
    """Yield a function that displays the result of an epoch of the run `name`."""
    if not sys.stdout.isatty():
        yield lambda epoch: print(epoch_line(epoch), flush=True)
        return
    from rich.progress import BarColumn, Progress, TextColumn

    with Progress(TextColumn(name), BarColumn(), TextColumn("{task.fields[line]}")) as bar:
        task = bar.add_task(name, total=None, line="")
        yield lambda epoch: bar.update(task, completed=epoch.row["epoch"], total=epoch.epochs, line=epoch_line(epoch))

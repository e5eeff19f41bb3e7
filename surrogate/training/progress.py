"""Display of the progress of a training: a progress bar on a terminal, one line per epoch elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from surrogate.training.fitting import Report
    from surrogate.training.run_folder import Progress as Done


def epoch_line(done: Done, epochs: int) -> str:
    """Return the result of the latest epoch as one line of text."""
    row = done.history[-1]
    left = timedelta(seconds=round((epochs - done.epoch) * done.seconds / done.epoch))
    return (
        f"epoch {row['epoch']}/{epochs}  train MSE {row['train_mse']:.3e}  "
        f"validation MSE {row['validation_mse']:.3e}  rate {row['learning_rate']:.2e}  "
        f"{row['seconds']:.0f} s, at most {left} left"
    )


@contextmanager
def reporter(name: str) -> Iterator[Report]:
    """Yield a function that displays the result of an epoch of the run `name`."""
    if not sys.stdout.isatty():
        yield lambda *given: print(epoch_line(*given), flush=True)
        return
    from rich.progress import BarColumn, Progress, TextColumn

    with Progress(TextColumn(name), BarColumn(), TextColumn("{task.fields[line]}")) as bar:
        task = bar.add_task(name, total=None, line="")
        yield lambda done, epochs: bar.update(task, completed=done.epoch, total=epochs, line=epoch_line(done, epochs))

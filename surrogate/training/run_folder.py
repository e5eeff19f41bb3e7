"""What the folder of a run holds: which training, how far it is, and files that another process or damage changed.

The folder holds `history.csv` with one row per epoch, Keras's `backup/` of the last epoch and `best/` weights, and
`progress.json` with the learning curve, the facts that decide the result (`surrogate.training.identity`), and the
SHA-256 sums of the files in both folders and of itself. It is written last, once an epoch.
"""

from __future__ import annotations

import csv
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from bem._support.outputs import write_whole
from surrogate.export.onnx_file import sha256
from surrogate.training.identity import TrainingIdentity, facts_that_differ

COLUMNS = {
    "learning_rate": "learning_rate",
    "train_mse": "loss",
    "validation_mse": "val_loss",
    "validation_mae": "val_mae",
    "seconds": "seconds",
    "cpu_seconds": "cpu_seconds",
}
"""Columns of `history.csv` after `epoch`, from 1, and their names in Keras's logs; errors are of the scaled force."""

PROGRESS = "progress.json"


@dataclass
class Progress:
    """Progress of a run.

    Args:
        history: One row per epoch, with the columns of `history.csv`; the seconds accumulate.
        finished: Whether the training has ended by its recipe.
    """

    history: list[dict[str, float]] = field(default_factory=list)
    finished: bool = False

    @property
    def epoch(self) -> int:
        """Number of completed epochs."""
        return len(self.history)

    @property
    def best_epoch(self) -> int:
        """The first epoch with the smallest validation error; zero before the first one."""
        errors = [row["validation_mse"] for row in self.history]
        return errors.index(min(errors)) + 1 if errors else 0

    @property
    def best_mse(self) -> float:
        """The smallest validation error."""
        return min((row["validation_mse"] for row in self.history), default=float("inf"))

    @property
    def seconds(self) -> float:
        """Wall-clock seconds of all epochs so far."""
        return self.history[-1]["seconds"] if self.history else 0.0

    @property
    def cpu_seconds(self) -> float:
        """Processor seconds of all epochs so far."""
        return self.history[-1]["cpu_seconds"] if self.history else 0.0


Report = Callable[[Progress, int], None]
"""Called after each epoch, with the progress and the largest number of epochs."""


def print_epoch(done: Progress, epochs: int) -> None:
    """Print the result of the latest epoch as one line of text."""
    row = done.history[-1]
    left = timedelta(seconds=round((epochs - done.epoch) * done.seconds / done.epoch))
    print(
        f"epoch {row['epoch']}/{epochs}  train MSE {row['train_mse']:.3e}  "
        f"validation MSE {row['validation_mse']:.3e}  rate {row['learning_rate']:.2e}  "
        f"{row['seconds']:.0f} s, at most {left} left",
        flush=True,
    )


@contextmanager
def locked(folder: Path, facts: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Make the directory of a run, unless it exists, and hold its lock inside the context.

    Raises:
        ValueError: another process is training there, or it holds progress of other `facts`; the message names the
            differences.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        lock = FileLock(folder / "lock", timeout=0).acquire()
    except Timeout:
        raise ValueError(
            f"Expected a training folder that nobody uses; wait for the other training or end it, or choose another "
            f"folder with --runs. Received: {folder}, where another process is training"
        ) from None
    with lock:  # outside the `try`, so that a lock that times out during the training is not taken for this one
        found = None if facts is None else read_progress(folder)
        if found and (other := facts_that_differ(found[1], facts)):
            raise ValueError(
                f"Expected a checkpoint of the same training in {folder}; remove it to start again, or give the "
                f"training another name. Received: a checkpoint of another {', '.join(other)}"
            )
        yield


def save_progress(folder: Path, progress: Progress, facts: Mapping[str, Any], files: list[Path]) -> None:
    """Write `history.csv` and, atomically, `progress.json`, with the sums of the files that a resumption will read."""
    with (folder / "history.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["epoch", *COLUMNS], lineterminator="\n")
        writer.writeheader()
        writer.writerows(progress.history)
    content = json.dumps({"facts": facts, "history": progress.history, "sums": sums_of(files)})
    write_whole(folder / PROGRESS, f"{content}\n{_sum(content.encode())}\n")


def read_progress(folder: Path) -> tuple[Progress, dict[str, Any], list[str]] | None:
    """Return progress, facts and sums of files that `save_progress` wrote; `None` if there is nothing.

    Raises:
        ValueError: the file is damaged.
    """
    path = folder / PROGRESS
    if not path.is_file():
        return None
    content, _, rest = path.read_bytes().partition(b"\n")
    if rest != f"{_sum(content)}\n".encode():
        raise damage(path, folder)
    found = json.loads(content)
    return Progress(found["history"]), found["facts"], found["sums"]


def sums_of(files: list[Path]) -> list[str]:
    """Return the SHA-256 sums of files; an empty text for one that is missing."""
    return [sha256(path) if path.is_file() else "" for path in files]


def damage(path: Path, folder: Path) -> ValueError:
    """Return the error about a damaged file in the directory of a run."""
    return ValueError(
        f"Expected what the training saved; restore the file, or remove {folder} to train from the start. "
        f"Received: {path}, which is damaged"
    )


def set_aside(folder: Path, wanted: TrainingIdentity) -> Path | None:
    """Rename the directory of a run whose progress is of another training, whatever its backend.

    Returns:
        The new path, or `None` if there is no progress of another training.

    Raises:
        ValueError: the progress is damaged, or another process is training there.
    """
    found = read_progress(folder)
    if found is None or not facts_that_differ(found[1], wanted.fingerprint, but=("backend",)):
        return None
    number = 1
    while (aside := folder.with_name(f"{folder.name}.outdated-{number}")).exists():
        number += 1
    with locked(folder):
        return folder.rename(aside)


def _sum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()

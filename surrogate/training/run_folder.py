"""What the folder of a run holds: which training, how far it is, and files that another process or damage changed.

The folder holds `history.csv` with one row per epoch, Keras's `backup/` of the last epoch and `best/` weights, and
`progress.json` with the learning curve, the facts that decide the result (`surrogate.training.identity`), and the
SHA-256 sums of the files in both folders and of itself. It is written last, once an epoch.
"""

from __future__ import annotations

import csv
import hashlib
import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from bem._support.outputs import write_whole
from surrogate.onnx.file import sha256
from surrogate.training.identity import facts_that_differ

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
BACKUP = ("backup/latest.weights.h5", "backup/training_metadata.json")
"""Files of Keras's newer backup; those of the older one end in `.bkp`."""


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

    def spent(self, clock: str) -> float:
        """Seconds of all epochs so far, by the wall clock (`"seconds"`) or of the processor (`"cpu_seconds"`)."""
        return self.history[-1][clock] if self.history else 0.0


Report = Callable[[Progress, int], None]
"""Called after each epoch, with the progress and the largest number of epochs."""


def print_epoch(done: Progress, epochs: int) -> None:
    """Print the result of the latest epoch as one line of text."""
    row = done.history[-1]
    left = timedelta(seconds=round((epochs - done.epoch) * row["seconds"] / done.epoch))
    print(
        f"epoch {row['epoch']}/{epochs}  train MSE {row['train_mse']:.3e}  "
        f"validation MSE {row['validation_mse']:.3e}  rate {row['learning_rate']:.2e}  "
        f"{row['seconds']:.0f} s, at most {left} left",
        flush=True,
    )


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Make the directory of a run, unless it exists, and hold its lock inside the context.

    Raises:
        ValueError: another process is training there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        lock = FileLock(folder / "lock", timeout=0).acquire()
    except Timeout:
        raise ValueError(
            f"the folder of a training must be free: wait for the other training or end it, or choose another "
            f"folder with --runs; received {folder}, where another process is training"
        ) from None
    with lock:  # outside the `try`, so that a lock that times out during the training is not taken for this one
        yield


def save_progress(folder: Path, progress: Progress, facts: Mapping[str, Any]) -> None:
    """Write `history.csv` and, atomically, `progress.json`; then remove all but the best weights."""
    with (folder / "history.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["epoch", *COLUMNS], lineterminator="\n")
        writer.writeheader()
        writer.writerows(progress.history)
    best = best_weights(folder, progress)
    sums = [_sum_of(path) for path in (*(folder / name for name in BACKUP), best)]
    payload = json.dumps({"facts": facts, "history": progress.history, "sums": sums})
    write_whole(folder / PROGRESS, f"{payload}\n{hashlib.sha256(payload.encode()).hexdigest()}\n")
    for path in best.parent.glob("*.weights.h5"):
        if path != best:
            path.unlink()


def read_progress(folder: Path) -> tuple[Progress, dict[str, Any], list[str]] | None:
    """Return progress, facts and sums of files that `save_progress` wrote; `None` if there is nothing.

    Raises:
        ValueError: the file is damaged.
    """
    path = folder / PROGRESS
    if not path.is_file():
        return None
    payload, _, checksum = path.read_bytes().partition(b"\n")
    if checksum != f"{hashlib.sha256(payload).hexdigest()}\n".encode():
        raise _damage(path, folder)
    stored = json.loads(payload)
    return Progress(stored["history"]), stored["facts"], stored["sums"]


def resumed(folder: Path, facts: Mapping[str, Any]) -> Progress:
    """Return the progress of a training, and put the backup that belongs to it where Keras looks for it.

    Keras keeps the backups of two epochs. After an interruption between backup and progress, the older one counts.

    Raises:
        ValueError: the folder holds progress of other `facts`, whose differences the message names, or a damaged file.
    """
    (folder / "best").mkdir(parents=True, exist_ok=True)
    stored = read_progress(folder)
    if stored is None:
        shutil.rmtree(folder / "backup", ignore_errors=True)
        return Progress()
    progress, trained, (*sums, best_sum) = stored
    if differing := facts_that_differ(trained, facts):
        raise ValueError(
            f"the checkpoint in {folder} must be of the same training: remove it to start again, or give the "
            f"training another name; received a checkpoint of another {', '.join(differing)}"
        )
    backup = [folder / name for name in BACKUP]
    older = [path.with_name(f"{path.name}.bkp") for path in backup]
    if [_sum_of(path) for path in backup] != sums:
        if [_sum_of(path) for path in older] != sums:
            raise _damage(backup[0], folder)
        for path, other_path in zip(backup, older, strict=True):
            shutil.copyfile(other_path, path)
    if _sum_of(best := best_weights(folder, progress)) != best_sum:
        raise _damage(best, folder)
    return progress


def best_weights(folder: Path, progress: Progress) -> Path:
    """Return the path of the weights with the smallest validation error."""
    return folder / "best" / f"{progress.best_epoch:05d}.weights.h5"


def _sum_of(path: Path) -> str:
    """Return the SHA-256 sum of a file; an empty text for one that is missing."""
    return sha256(path) if path.is_file() else ""


def _damage(path: Path, folder: Path) -> ValueError:
    return ValueError(
        f"files of a training must be as it saved them: restore the file, or remove {folder} to train from the start; "
        f"received {path}, which is damaged"
    )

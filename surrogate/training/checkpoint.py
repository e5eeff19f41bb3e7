"""Checkpoint of a training run, written after each epoch, so that an interrupted run resumes with the same results."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bem._support.outputs import write_whole
from surrogate.training.identity import TrainingIdentity, fingerprint_differences

if TYPE_CHECKING:
    import keras

HISTORY_COLUMNS = (
    "epoch",
    "learning_rate",
    "train_mse",
    "validation_mse",
    "validation_mae",
    "seconds",
    "cpu_seconds",
)
"""Columns of `history.csv`: the epoch, from 1; the learning rate; errors of the scaled force; accumulated seconds."""

FINGERPRINT = "fingerprint.json"
"""File with the fingerprint of a run by `model.fit`; in a run by the package's loop, `checkpoint.npz` contains it."""


@dataclass
class Progress:
    """Progress of a run.

    Args:
        history: One row per epoch, with the columns `HISTORY_COLUMNS`; the seconds accumulate.
        best_mse: The smallest validation MSE so far.
        best_epoch: The epoch with that validation MSE.
        best_weights: The trainable weights of that epoch; empty for a training by `model.fit`.
        flat_from: Epoch from which `[plateau]` counts its patience.
        finished: Whether the training has ended by its recipe.
    """

    history: list[dict[str, float]] = field(default_factory=list)
    best_mse: float = float("inf")
    best_epoch: int = 0
    best_weights: list[np.ndarray] = field(default_factory=list)
    flat_from: int = 0
    finished: bool = False

    @property
    def epoch(self) -> int:
        """Number of completed epochs."""
        return len(self.history)

    @property
    def seconds(self) -> float:
        """Wall-clock seconds of all epochs so far."""
        return self.history[-1]["seconds"] if self.history else 0.0

    @property
    def cpu_seconds(self) -> float:
        """Processor seconds of all epochs so far."""
        return self.history[-1]["cpu_seconds"] if self.history else 0.0

    def add(self, row: dict[str, float]) -> None:
        """Append the row of an epoch; it becomes the best epoch if its validation MSE is the smallest so far."""
        self.history.append(row)
        if row["validation_mse"] < self.best_mse:
            self.best_mse, self.best_epoch = row["validation_mse"], self.epoch


def save_checkpoint(path: Path, model: keras.Model, progress: Progress, *, fingerprint: str) -> None:
    """Write weights, random states, optimizer and progress to one file, atomically."""
    from keras import ops

    state = {name: getattr(progress, name) for name in ("history", "best_mse", "best_epoch", "flat_from")}
    arrays = {"state": np.array(json.dumps({"fingerprint": fingerprint, **state}))}
    arrays |= {f"model_{i}": ops.convert_to_numpy(v) for i, v in enumerate(model.variables)}
    arrays |= {f"optimizer_{i}": ops.convert_to_numpy(v) for i, v in enumerate(model.optimizer.variables)}
    arrays |= {f"best_{i}": value for i, value in enumerate(progress.best_weights)}
    content = BytesIO()
    np.savez(content, **arrays)
    write_whole(path, content.getbuffer())


def load_checkpoint(path: Path, model: keras.Model, *, fingerprint: str) -> Progress:
    """Restore a checkpoint into a compiled model of the same architecture.

    Raises:
        ValueError: the checkpoint is of another training.
    """
    with np.load(path) as stored:
        arrays = dict(stored)
    state = json.loads(str(arrays["state"]))
    _require_same(state.pop("fingerprint"), fingerprint, path.parent)
    for prefix, variables in (("model", model.variables), ("optimizer", model.optimizer.variables)):
        for index, variable in enumerate(variables):
            variable.assign(arrays[f"{prefix}_{index}"])
    best = [arrays[f"best_{index}"] for index in range(len(model.trainable_variables))]
    return Progress(best_weights=best, **state)


def require_same_run(folder: Path, fingerprint: str) -> None:
    """Check that the directory of a run holds no checkpoint of another training.

    Raises:
        ValueError: it does; the message names the differences.
    """
    if (found := stored_fingerprint(folder)) is not None:
        _require_same(found, fingerprint, folder)


def stored_fingerprint(folder: Path) -> str | None:
    """Return the fingerprint of the checkpoint in the directory of a run; `None` without a checkpoint."""
    if (folder / FINGERPRINT).is_file():
        return (folder / FINGERPRINT).read_text(encoding="utf-8")
    if not (folder / "checkpoint.npz").is_file():
        return None
    with np.load(folder / "checkpoint.npz") as stored:
        return json.loads(str(stored["state"]))["fingerprint"]


def _require_same(found: str, wanted: str, folder: Path) -> None:
    if other := fingerprint_differences(found, wanted):
        raise ValueError(
            f"Expected a checkpoint of the same training in {folder}; remove it to start again, or give the training "
            f"another name. Received: a checkpoint of another {', '.join(other)}"
        )


def set_aside(folder: Path, wanted: TrainingIdentity) -> Path | None:
    """Rename the directory of a run whose checkpoint is of another training, so that the run can start again.

    Args:
        folder: Directory of the run.
        wanted: The training that will use the directory; its backend does not matter.

    Returns:
        The new path, or `None` if there is no checkpoint of another training.
    """
    found = stored_fingerprint(folder)
    if found is None or not fingerprint_differences(found, wanted.fingerprint, but=("backend",)):
        return None
    number = 1
    while (aside := folder.with_name(f"{folder.name}.outdated-{number}")).exists():
        number += 1
    return folder.rename(aside)


def save_history(path: Path, history: list[dict[str, float]]) -> None:
    """Write the history as CSV, one row per epoch, with the columns `HISTORY_COLUMNS`."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, HISTORY_COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(history)

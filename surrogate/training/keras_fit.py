"""Training by `model.fit` and Keras's own callbacks, for recipes with `loop = "fit"`.

`ReduceLROnPlateau` and `EarlyStopping` follow the validation loss by Keras's rules. `SwapEMAWeights` averages the
weights if the recipe does. `CSVLogger` writes the learning curve, `ModelCheckpoint` the best weights, and
`BackupAndRestore` the state after each epoch. After an interruption Keras restores weights and optimizer, but not the
counters of its callbacks; `Memory` restores them from the learning curve. The batches have the order of the package's
loop, drawn from (seed, epoch), so that an interrupted training follows the learning curve of an uninterrupted one.

The directory of a run holds `log.csv` (written by `CSVLogger`), `history.csv` (the same with the columns of this
package), `backup/`, `best/` and `fingerprint.json`.

Source: the paper's section "Training and hyperparameters" states what these callbacks do; all else is Keras's default.
"""

from __future__ import annotations

import csv
import json
import shutil
import time
from pathlib import Path
from typing import Any

import h5py
import keras
import numpy as np

from surrogate.training.checkpoint import FINGERPRINT, Progress
from surrogate.training.loop import (
    Examples,
    TrainingTask,
    active_dropout,
    compile_by,
    is_over,
    learning_rate,
    order_of,
    require_epochs,
    require_finite,
)
from surrogate.training.recipe import Recipe

COLUMNS = {
    "learning_rate": "learning_rate",
    "train_mse": "loss",
    "validation_mse": "val_loss",
    "validation_mae": "val_mae",
    "seconds": "seconds",
    "cpu_seconds": "cpu_seconds",
}
"""Columns of `history.csv` and their names in Keras's logs. In `log.csv`, epochs start at zero."""
VALIDATION_BATCH = 256
"""Trajectories in a batch of the validation set."""


class Batches(keras.utils.PyDataset):
    """Batches of the training set, in the order of one epoch.

    Args:
        examples: Scaled trajectories of the training set.
        recipe: How to train; its seed and batch size are used.
    """

    def __init__(self, examples: Examples, recipe: Recipe) -> None:
        super().__init__()
        self.examples, self.recipe = examples, recipe
        self.shuffle(0)

    def shuffle(self, epoch: int) -> None:
        """Draw the order of an epoch; epochs start at zero, as in Keras."""
        self.order = order_of(self.recipe, epoch + 1, len(self.examples))

    def __len__(self) -> int:
        return -(-len(self.order) // self.recipe.batch_size)

    def __getitem__(self, index: int) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        size, examples = self.recipe.batch_size, self.examples
        batch = self.order[index * size : (index + 1) * size]
        return (examples.sequence[batch], examples.tabor[batch]), examples.force[batch]


class Meter(keras.callbacks.Callback):
    """Callback that draws order and dropout of each epoch, and adds seconds and learning rate to the logs."""

    def __init__(self, batches: Batches, progress: Progress) -> None:
        super().__init__()
        self.batches, self.progress = batches, progress

    def on_epoch_begin(self, epoch: int, logs: dict[str, Any] | None = None) -> None:  # noqa: ARG002
        """Start the clocks, and set the random state of dropout, which a weights file does not hold."""
        self.batches.shuffle(epoch)
        _seed_dropout(self.model, self.batches.recipe.seed, epoch)
        self.started = time.perf_counter(), time.process_time()

    def on_epoch_end(self, epoch: int, logs: dict[str, Any]) -> None:
        """Check the validation loss and complete the logs."""
        require_finite(logs["val_loss"], epoch + 1)
        logs["learning_rate"] = learning_rate(self.model)
        logs["seconds"] = self.progress.seconds + time.perf_counter() - self.started[0]
        logs["cpu_seconds"] = self.progress.cpu_seconds + time.process_time() - self.started[1]


class Memory(keras.callbacks.Callback):
    """Callback that restores the counters of others after an interruption, by replaying the completed epochs."""

    def __init__(self, callbacks: list[keras.callbacks.Callback], progress: Progress) -> None:
        super().__init__()
        self.callbacks, self.progress = callbacks, progress

    def on_train_begin(self, logs: dict[str, Any] | None = None) -> None:  # noqa: ARG002
        """Replay the epochs; the learning rate remains the one that Keras restored."""
        if not self.callbacks:
            return
        rate = learning_rate(self.model)
        for epoch, row in enumerate(self.progress.history):
            for callback in self.callbacks:
                callback.on_epoch_end(epoch, {"val_loss": row["validation_mse"]})
        self.model.optimizer.learning_rate = rate


class Reporter(keras.callbacks.Callback):
    """Callback that writes the history, reports the epoch, removes all but the best weights, and ends the training."""

    def __init__(self, task: TrainingTask, progress: Progress) -> None:
        super().__init__()
        self.task, self.progress = task, progress

    def on_epoch_end(self, epoch: int, logs: dict[str, Any]) -> None:
        """End the epoch; this callback is the last one, so that all others have written their files."""
        self.progress.add({"epoch": epoch + 1} | {name: float(logs[key]) for name, key in COLUMNS.items()})
        stops = self.task.end_epoch(self.progress)
        best = _best(self.task.folder, self.progress.best_epoch)
        for path in best.parent.glob("*.weights.h5"):
            if path != best:
                path.unlink()
        if stops:
            self.model.stop_training = True


def fit(task: TrainingTask) -> Progress:
    """Train a model by `model.fit`, or resume the training in the same folder that was interrupted.

    The folder holds the files that the docstring of the module lists. The caller has checked that they are of the same
    training (`surrogate.training.checkpoint.require_same_run`).

    Returns:
        The progress, as `surrogate.training.loop.train` returns it.

    Raises:
        ValueError: the run in the folder has more epochs than the recipe.
        FloatingPointError: the validation error is not finite.
    """
    model, recipe, folder, validation = task.model, task.recipe, task.folder, task.validation
    batches = Batches(task.training, recipe)
    compile_by(recipe, model, len(batches), metrics=["mae"])
    (folder / "best").mkdir(parents=True, exist_ok=True)
    (folder / FINGERPRINT).write_text(task.fingerprint, encoding="utf-8")
    progress = _resumed(folder, len(batches))
    require_epochs(recipe, progress, folder)
    if not is_over(recipe, progress):
        model.fit(
            batches,
            epochs=recipe.epochs,
            shuffle=False,  # `Batches` has the order of the epoch already
            validation_data=((validation.sequence, validation.tabor), validation.force),
            validation_batch_size=VALIDATION_BATCH,
            callbacks=_callbacks(task, batches, progress),
            verbose=0,
        )
    progress.finished = is_over(recipe, progress)
    if progress.finished:
        model.load_weights(_best(folder, progress.best_epoch))
    return progress


def _callbacks(task: TrainingTask, batches: Batches, progress: Progress) -> list[keras.callbacks.Callback]:
    """Return Keras's callbacks and those of this module, in the order of their calls."""
    from keras import callbacks

    recipe, folder = task.recipe, task.folder
    plateau: list[keras.callbacks.Callback] = []
    if recipe.plateau:
        rule = recipe.plateau
        plateau = [
            callbacks.ReduceLROnPlateau(factor=rule.factor, patience=rule.patience, min_lr=rule.minimum_rate),
            callbacks.EarlyStopping(patience=rule.stop_after),
        ]
    averaging = []
    if recipe.weight_average is not None:
        averaging = [callbacks.SwapEMAWeights(swap_on_epoch=True)]
        # A restored model holds the averaged weights, as it did when the backup was written.
        averaging[0]._ema_weights_in_model = bool(progress.history)
    return [
        Meter(batches, progress),
        *plateau,
        callbacks.CSVLogger(folder / "log.csv", append=True),
        *averaging,
        callbacks.ModelCheckpoint(
            folder / "best" / "{epoch:05d}.weights.h5",
            save_best_only=True,
            save_weights_only=True,
            initial_value_threshold=progress.best_mse if progress.history else None,
        ),
        callbacks.BackupAndRestore(folder / "backup", double_checkpoint=True, delete_checkpoint=False),
        Memory(plateau, progress),
        Reporter(task, progress),
    ]


def _resumed(folder: Path, steps: int) -> Progress:
    """Return the progress that the backup holds, and remove later epochs from `log.csv`."""
    epochs, log = _backed_up(folder / "backup", steps), folder / "log.csv"
    progress = Progress()
    if epochs == 0:
        log.unlink(missing_ok=True)
        return progress
    with log.open(newline="", encoding="utf-8") as file:
        names = (reader := csv.DictReader(file)).fieldnames or []
        rows = [row for row in reader if int(row["epoch"]) < epochs]
    with log.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)
    for row in rows:
        progress.add({"epoch": int(row["epoch"]) + 1} | {name: float(row[key]) for name, key in COLUMNS.items()})
    return progress


def _backed_up(backup: Path, steps: int) -> int:
    """Return the number of epochs in the newer complete backup of Keras's two; zero without one.

    Where only the older backup is complete, it replaces the newer one. Where none is, the directory is removed.
    Keras writes the weights before the number of epochs. A backup is complete if the optimizer in the weights file has
    made `steps` iterations per epoch.
    """
    weights, metadata = backup / "latest.weights.h5", backup / "training_metadata.json"
    for suffix in ("", ".bkp"):
        try:
            epochs = json.loads(metadata.with_name(metadata.name + suffix).read_text(encoding="utf-8"))["epoch"]
            with h5py.File(weights.with_name(weights.name + suffix)) as file:
                complete = int(file["optimizer/vars/0"][()]) == epochs * steps
        except (OSError, ValueError, KeyError):
            continue
        if complete:
            if suffix:
                for path in (weights, metadata):
                    shutil.copyfile(path.with_name(path.name + suffix), path)
            return epochs
    shutil.rmtree(backup, ignore_errors=True)
    return 0


def _seed_dropout(model: keras.Model, seed: int, epoch: int) -> None:
    """Set the random state of dropout from (seed, epoch).

    Under PyTorch the process has one random state; under other backends each dropout layer has its own.
    """
    if keras.backend.backend() == "torch":
        import torch

        torch.manual_seed(int(np.random.default_rng([seed, epoch]).integers(2**31)))
    for index, layer in enumerate(active_dropout(model)):
        state = layer.seed_generator.state
        state.assign(np.random.default_rng([seed, epoch, index]).integers(2**31, size=state.shape))


def _best(folder: Path, epoch: int) -> Path:
    return folder / "best" / f"{epoch:05d}.weights.h5"

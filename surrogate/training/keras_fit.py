"""Training by `model.fit` and Keras's own callbacks, for recipes with `loop = "fit"`: what a Keras user would write.

`ReduceLROnPlateau` and `EarlyStopping` follow the validation loss by Keras's rules, `SwapEMAWeights` averages where the
recipe does, `CSVLogger` keeps the curve, `ModelCheckpoint` the best weights, `BackupAndRestore` the state after each
epoch. After an interruption Keras restores weights and optimizer, but its callbacks have forgotten their counts; here
these are taken from the curve again. Batches come in the order of the package's loop, drawn from (seed, epoch), so that
a training that was interrupted follows the curve of one that was not.

A run's directory holds `log.csv` (of `CSVLogger`), `history.csv` (the same with the package's columns), `backup/`,
`best/` and `fingerprint.json`.
"""

from __future__ import annotations

import csv
import json
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import keras
import numpy as np

from surrogate.training.checkpoint import FINGERPRINT, Progress, save_history
from surrogate.training.loop import EpochReport, Examples, compile_by, is_over, order_of, require_epochs
from surrogate.training.recipe import Recipe

COLUMNS = {
    "learning_rate": "learning_rate",
    "train_mse": "loss",
    "validation_mse": "val_loss",
    "validation_mae": "val_mae",
    "seconds": "seconds",
    "cpu_seconds": "cpu_seconds",
}
"""What the columns of `history.csv` are called in Keras's logs; `log.csv` counts epochs from zero."""
VALIDATION_BATCH = 256


class Batches(keras.utils.PyDataset):
    """Batches of an epoch; Keras counts epochs from zero."""

    def __init__(self, examples: Examples, recipe: Recipe) -> None:
        super().__init__()
        self.examples, self.recipe = examples, recipe
        self.shuffle(0)

    def shuffle(self, epoch: int) -> None:
        """Draw the order of an epoch."""
        self.order = order_of(self.recipe, epoch + 1, len(self.examples))

    def __len__(self) -> int:
        return -(-len(self.order) // self.recipe.batch_size)

    def __getitem__(self, index: int) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        size, examples = self.recipe.batch_size, self.examples
        batch = self.order[index * size : (index + 1) * size]
        return (examples.sequence[batch], examples.tabor[batch]), examples.force[batch]


class Meter(keras.callbacks.Callback):
    """Draws the order and the dropout of each epoch, and adds its seconds and rate to what the other callbacks see."""

    def __init__(self, batches: Batches, progress: Progress) -> None:
        super().__init__()
        self.batches, self.progress = batches, progress

    def on_epoch_begin(self, epoch: int, logs: dict[str, Any] | None = None) -> None:  # noqa: ARG002
        """Start the clocks, and dropout from (seed, epoch), as files of weights do not hold what it has drawn."""
        self.batches.shuffle(epoch)
        _draw_from(self.model, self.batches.recipe.seed, epoch)
        self.started = time.perf_counter(), time.process_time()

    def on_epoch_end(self, epoch: int, logs: dict[str, Any]) -> None:
        """Read them."""
        if not np.isfinite(logs["val_loss"]):
            raise FloatingPointError(f"Training diverged: validation error {logs['val_loss']} in epoch {epoch + 1}")
        logs["learning_rate"] = float(keras.ops.convert_to_numpy(self.model.optimizer.learning_rate))
        logs["seconds"] = self.progress.seconds + time.perf_counter() - self.started[0]
        logs["cpu_seconds"] = self.progress.cpu_seconds + time.process_time() - self.started[1]


class Memory(keras.callbacks.Callback):
    """Gives callbacks their counts back after an interruption, by showing them the epochs that are behind."""

    def __init__(self, callbacks: list[keras.callbacks.Callback], progress: Progress) -> None:
        super().__init__()
        self.callbacks, self.progress = callbacks, progress

    def on_train_begin(self, logs: dict[str, Any] | None = None) -> None:  # noqa: ARG002
        """Show them; the learning rate is the restored one."""
        if not self.callbacks:
            return
        rate = keras.ops.convert_to_numpy(self.model.optimizer.learning_rate).item()
        for epoch, row in enumerate(self.progress.history):
            for callback in self.callbacks:
                callback.on_epoch_end(epoch, {"val_loss": row["validation_mse"]})
        self.model.optimizer.learning_rate = rate


class Reporter(keras.callbacks.Callback):
    """Writes the history, reports the epoch, and ends the training where that is asked for."""

    def __init__(
        self,
        recipe: Recipe,
        folder: Path,
        progress: Progress,
        should_stop: Callable[[], bool],
        report: Callable[[EpochReport], None],
    ) -> None:
        super().__init__()
        self.recipe, self.folder, self.progress = recipe, folder, progress
        self.should_stop, self.report = should_stop, report

    def on_epoch_end(self, epoch: int, logs: dict[str, Any]) -> None:
        """Come last, when all others have kept what they keep."""
        progress = self.progress
        _count(progress, {"epoch": epoch + 1} | {name: float(logs[key]) for name, key in COLUMNS.items()})
        save_history(self.folder / "history.csv", progress.history)
        for path in (self.folder / "best").glob("*.weights.h5"):
            if path != _best(self.folder, progress.best_epoch):
                path.unlink()
        left = (self.recipe.epochs - progress.epoch) * progress.seconds / progress.epoch
        self.report(EpochReport(self.recipe.epochs, progress.history[-1], left))
        if self.should_stop():
            self.model.stop_training = True


def fit(
    model: keras.Model,
    training: Examples,
    validation: Examples,
    *,
    recipe: Recipe,
    folder: Path,
    fingerprint: str = "",
    should_stop: Callable[[], bool] = lambda: False,
    report: Callable[[EpochReport], None] = lambda _: None,
) -> Progress:
    """Train a model by `model.fit`, or go on where an earlier call in the same folder was interrupted.

    Arguments, result and errors are those of `surrogate.training.loop.train`; the folder keeps the files that the
    module's docstring lists.
    """
    batches = Batches(training, recipe)
    compile_by(recipe, model, len(batches), metrics=["mae"])
    (folder / "best").mkdir(parents=True, exist_ok=True)
    (folder / FINGERPRINT).write_text(fingerprint, encoding="utf-8")
    progress = _resumed(folder, len(batches))
    require_epochs(recipe, progress, folder)
    if not is_over(recipe, progress):
        model.fit(
            batches,
            epochs=recipe.epochs,
            shuffle=False,  # the batches are drawn already
            validation_data=((validation.sequence, validation.tabor), validation.force),
            validation_batch_size=VALIDATION_BATCH,
            callbacks=_callbacks(recipe, folder, batches, progress, should_stop, report),
            verbose=0,
        )
    progress.finished = is_over(recipe, progress)
    if progress.finished:
        model.load_weights(_best(folder, progress.best_epoch))
    return progress


def _callbacks(
    recipe: Recipe,
    folder: Path,
    batches: Batches,
    progress: Progress,
    should_stop: Callable[[], bool],
    report: Callable[[EpochReport], None],
) -> list[keras.callbacks.Callback]:
    """Keras's callbacks between those of this module; each sees what those before it have done."""
    from keras import callbacks

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
        # The backup was taken with the average in the model.
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
        Reporter(recipe, folder, progress, should_stop, report),
    ]


def _resumed(folder: Path, steps: int) -> Progress:
    """The epochs that the backup holds; of later ones, cut off by an interruption, the log is cleared."""
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
        _count(progress, {"epoch": int(row["epoch"]) + 1} | {name: float(row[key]) for name, key in COLUMNS.items()})
    return progress


def _backed_up(backup: Path, steps: int) -> int:
    """Epochs in the newer of the two backups that is whole; the other one, or a broken one, is replaced or removed.

    Keras writes the weights first and the number of epochs after it: they fit together where the optimizer has made as
    many steps.
    """
    weights, told = backup / "latest.weights.h5", backup / "training_metadata.json"
    for suffix in ("", ".bkp"):
        try:
            epochs = json.loads(told.with_name(told.name + suffix).read_text(encoding="utf-8"))["epoch"]
            with h5py.File(weights.with_name(weights.name + suffix)) as file:
                whole = int(file["optimizer/vars/0"][()]) == epochs * steps
        except (OSError, ValueError, KeyError):
            continue
        if whole:
            if suffix:
                for path in (weights, told):
                    shutil.copyfile(path.with_name(path.name + suffix), path)
            return epochs
    shutil.rmtree(backup, ignore_errors=True)
    return 0


def _draw_from(model: keras.Model, seed: int, epoch: int) -> None:
    """Let dropout draw from (seed, epoch); that of PyTorch draws from the process, that of others from the layer."""
    if keras.backend.backend() == "torch":
        import torch

        torch.manual_seed(int(np.random.default_rng([seed, epoch]).integers(2**31)))
    layers = [one for one in model._flatten_layers() if isinstance(one, keras.layers.Dropout) and one.rate]
    for place, layer in enumerate(layers):
        state = layer.seed_generator.state
        state.assign(np.random.default_rng([seed, epoch, place]).integers(2**31, size=state.shape))


def _count(progress: Progress, row: dict[str, float]) -> None:
    """Add an epoch to the history, and note whether it is the best."""
    progress.history.append(row)
    if row["validation_mse"] < progress.best_mse:
        progress.best_mse, progress.best_epoch = row["validation_mse"], progress.epoch


def _best(folder: Path, epoch: int) -> Path:
    return folder / "best" / f"{epoch:05d}.weights.h5"

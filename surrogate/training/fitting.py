"""Training by `model.fit` and Keras's own callbacks, for every model, recipe and backend.

`ReduceLROnPlateau` and `EarlyStopping` follow the validation loss by Keras's rules. `SwapEMAWeights` averages the
weights if the recipe does. `ModelCheckpoint` writes the best weights, and `BackupAndRestore` the state after each
epoch. After an interruption Keras restores weights and optimizer, but not the counters of its callbacks; `Keeper`
restores them from the learning curve. Order and dropout of an epoch are drawn from (seed, epoch), so that an
interrupted training ends with the same numbers as an uninterrupted one. The loss is the mean squared error of the
scaled force, in float32; a recipe may weight the steps around the largest force. `surrogate.training.run_folder`
describes the folder of a run.

Source: the paper's section "Training and hyperparameters" states what these callbacks do; all else is Keras's default.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import keras
import numpy as np

from surrogate.data.examples import Examples
from surrogate.training.recipe import Recipe
from surrogate.training.run_folder import COLUMNS, Progress, Report, damage, read_progress, save_progress, sums_of
from surrogate.training.soap import Soap

BACKUP = ("backup/latest.weights.h5", "backup/training_metadata.json")
"""Files of Keras's newer backup; those of the older one end in `.bkp`."""
VALIDATION_BATCH = 256
"""Trajectories in a batch of the validation set."""
NEAR = 2
"""Steps to either side of the largest force that a recipe's `peak_weight` is about."""


def fit(
    model: keras.Model,
    training: Examples,
    validation: Examples,
    recipe: Recipe,
    folder: Path,
    *,
    facts: Mapping[str, Any],
    should_stop: Callable[[], bool] = lambda: False,
    report: Report = lambda *_: None,
) -> Progress:
    """Train a model, or resume the training in the same folder that was interrupted or had fewer epochs.

    The caller has checked that the folder is of the same training (`surrogate.training.run_folder.locked`).

    Args:
        model: An untrained model, built after `keras.utils.set_random_seed(recipe.seed)`.
        training: Scaled trajectories of the training set.
        validation: Scaled trajectories of the validation set.
        recipe: How to train.
        folder: Directory of the run.
        facts: What decides the result of the training, ready for JSON; stored with the progress.
        should_stop: Called after each epoch; `True` ends the training early, and a later call resumes it.
        report: See `Report`.

    Returns:
        The progress. If `finished` is true, the model holds the best weights; otherwise `should_stop` ended the
        training, and a later call resumes it.

    Raises:
        ValueError: the run in the folder has more epochs than the recipe, or a damaged file.
        FloatingPointError: the validation error is not finite.
    """
    batches = Batches(training, recipe)
    compile_by(recipe, model, len(batches), metrics=["mae"])
    (folder / "best").mkdir(parents=True, exist_ok=True)
    progress = _resumed(folder)
    if progress.epoch > recipe.epochs:
        raise ValueError(
            f"Expected at least {progress.epoch} epochs, which {folder} has already trained. "
            f"Received: epochs={recipe.epochs}"
        )

    def keep() -> bool:
        """Save and report an epoch, and remove all but the best weights; return whether to stop."""
        best = _best(folder, progress.best_epoch)
        save_progress(folder, progress, facts, [*(folder / name for name in BACKUP), best])
        report(progress, recipe.epochs)
        for path in best.parent.glob("*.weights.h5"):
            if path != best:
                path.unlink()
        return should_stop()

    if not is_over(recipe, progress):
        model.fit(
            batches,
            epochs=recipe.epochs,
            shuffle=False,  # `Batches` has the order of the epoch already
            validation_data=((validation.sequence, validation.tabor), validation.force),
            validation_batch_size=VALIDATION_BATCH,
            callbacks=_callbacks(folder, batches, progress, keep),
            verbose=0,
        )
    progress.finished = is_over(recipe, progress)
    if progress.finished:
        model.load_weights(_best(folder, progress.best_epoch))
    return progress


def started(build: Callable[[], keras.Model], seed: int) -> keras.Model:
    """Return a new model to train, whose weights are drawn from a seed."""
    keras.config.set_floatx("float32")
    keras.utils.set_random_seed(seed)
    return with_fused_lstm(build())


def with_weights(bare: keras.Model, trained: keras.Model) -> keras.Model:
    """Return a new model after giving it the weights of a trained one, whose layers and optimizer may be others."""
    bare.set_weights([keras.ops.convert_to_numpy(variable) for variable in trained.weights])
    return bare


def with_fused_lstm(model: keras.Model) -> keras.Model:
    """Return the model to train: under PyTorch a copy with fused LSTM layers, under other backends the model itself."""
    if keras.backend.backend() != "torch":
        return model
    from surrogate.training.torch_lstm import with_torch_lstm

    return with_torch_lstm(model)


def compile_by(recipe: Recipe, model: keras.Model, steps: int, metrics: Sequence[str] = ()) -> None:
    """Compile a model with the recipe's optimizer and learning-rate schedule.

    Args:
        recipe: How to train.
        model: The model, whose weights exist.
        steps: Number of batches in an epoch.
        metrics: Names of metrics that Keras computes beside the loss.
    """
    rate: Any = recipe.learning_rate
    if recipe.cosine:
        warmup = min(round(recipe.cosine.warmup_epochs * steps), recipe.epochs * steps - 1)
        rate = keras.optimizers.schedules.CosineDecay(
            initial_learning_rate=0.0 if warmup else recipe.learning_rate,
            decay_steps=recipe.epochs * steps - warmup,
            warmup_target=recipe.learning_rate if warmup else None,
            warmup_steps=warmup,
        )
    optimizer = {"adam": keras.optimizers.Adam, "soap": Soap}[recipe.optimizer](
        rate,
        global_clipnorm=recipe.gradient_norm,
        use_ema=recipe.weight_average is not None,
        ema_momentum=max(0.0, 1.0 - 1.0 / ((recipe.weight_average or 1.0) * recipe.epochs * steps)),
    )
    optimizer.build(model.trainable_variables)
    # JAX is fast only with XLA; under TensorFlow on a CPU, XLA makes an LSTM four times slower.
    compiled = keras.backend.backend() == "jax"
    model.compile(optimizer=optimizer, loss="mse", metrics=list(metrics) or None, jit_compile=compiled)


def is_over(recipe: Recipe, progress: Progress) -> bool:
    """Return whether training ends here: by the number of epochs, or by early stopping."""
    flat = progress.epoch - progress.best_epoch
    return progress.epoch >= recipe.epochs or bool(recipe.plateau and flat >= recipe.plateau.stop_after)


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
        """Draw the order of an epoch from (seed, epoch); epochs start at zero, as in Keras."""
        self.order = np.random.default_rng([self.recipe.seed, epoch + 1]).permutation(len(self.examples))

    def __len__(self) -> int:
        return -(-len(self.order) // self.recipe.batch_size)

    def __getitem__(self, index: int) -> tuple[Any, ...]:
        size, examples = self.recipe.batch_size, self.examples
        batch = self.order[index * size : (index + 1) * size]
        inputs, force = (examples.sequence[batch], examples.tabor[batch]), examples.force[batch]
        if self.recipe.peak_weight is None:
            return inputs, force
        return inputs, force, peak_weights(force, self.recipe.peak_weight)


def peak_weights(force: np.ndarray, more: float) -> np.ndarray:
    """Return weights of the steps of forces (batch, steps, 1), shape (batch, steps), with a mean of one."""
    steps = np.arange(force.shape[1])
    weights = 1.0 + more * (np.abs(steps - force.argmax(axis=1)) <= NEAR)
    return (weights / weights.mean()).astype(np.float32)


class Meter(keras.callbacks.Callback):
    """Callback that draws order and dropout of each epoch, and adds seconds and learning rate to the logs."""

    def __init__(self, batches: Batches, progress: Progress) -> None:
        super().__init__()
        self.batches, self.progress = batches, progress

    def on_epoch_begin(self, epoch: int, logs: dict[str, Any] | None = None) -> None:  # noqa: ARG002
        """Start the clocks, and set the random state of dropout, which a weights file does not hold."""
        self.batches.shuffle(epoch)
        _set_dropout(self.model, self.batches.recipe, epoch)
        self.started = time.perf_counter(), time.process_time()

    def on_epoch_end(self, epoch: int, logs: dict[str, Any]) -> None:
        """Check the validation loss and complete the logs."""
        if not np.isfinite(logs["val_loss"]):
            raise FloatingPointError(f"Training diverged: validation error {logs['val_loss']} in epoch {epoch + 1}")
        logs["learning_rate"] = _learning_rate(self.model)
        logs["seconds"] = self.progress.seconds + time.perf_counter() - self.started[0]
        logs["cpu_seconds"] = self.progress.cpu_seconds + time.process_time() - self.started[1]


class Keeper(keras.callbacks.Callback):
    """The last callback, which keeps the progress, and ends the training when asked to.

    Before the first epoch, it restores the counters of other callbacks by replaying the completed epochs.
    """

    def __init__(self, progress: Progress, keep: Callable[[], bool], counting: list[keras.callbacks.Callback]) -> None:
        super().__init__()
        self.progress, self.keep, self.counting = progress, keep, counting

    def on_train_begin(self, logs: dict[str, Any] | None = None) -> None:  # noqa: ARG002
        """Replay the epochs; the learning rate remains the one that Keras restored."""
        if not self.counting:
            return
        rate = _learning_rate(self.model)
        for epoch, row in enumerate(self.progress.history):
            for callback in self.counting:
                callback.on_epoch_end(epoch, {"val_loss": row["validation_mse"]})
        self.model.optimizer.learning_rate = rate

    def on_epoch_end(self, epoch: int, logs: dict[str, Any]) -> None:
        """Add the epoch to the history, and keep it."""
        row = {"epoch": epoch + 1} | {name: float(logs[key]) for name, key in COLUMNS.items()}
        self.progress.history.append(row)
        self.model.stop_training |= self.keep()


def _callbacks(
    folder: Path, batches: Batches, progress: Progress, keep: Callable[[], bool]
) -> list[keras.callbacks.Callback]:
    """Return Keras's callbacks and those of this module, in the order of their calls."""
    from keras import callbacks

    recipe = batches.recipe
    plateau: list[keras.callbacks.Callback] = []
    if recipe.plateau:
        rule = recipe.plateau
        threshold = {} if rule.least_gain is None else {"min_delta": rule.least_gain}
        plateau = [
            callbacks.ReduceLROnPlateau(
                factor=rule.factor, patience=rule.patience, min_lr=rule.minimum_rate, **threshold
            ),
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
        *averaging,
        callbacks.ModelCheckpoint(
            folder / "best" / "{epoch:05d}.weights.h5",
            save_best_only=True,
            save_weights_only=True,
            initial_value_threshold=progress.best_mse if progress.history else None,
        ),
        callbacks.BackupAndRestore(folder / "backup", double_checkpoint=True, delete_checkpoint=False),
        Keeper(progress, keep, plateau),
    ]


def _resumed(folder: Path) -> Progress:
    """Return the progress, and put the backup that belongs to it where Keras looks for it.

    Keras keeps the backups of two epochs. After an interruption between backup and progress, the older one counts.

    Raises:
        ValueError: a file is damaged.
    """
    found = read_progress(folder)
    if found is None:
        shutil.rmtree(folder / "backup", ignore_errors=True)
        return Progress()
    progress, _, sums = found
    backup = [folder / name for name in BACKUP]
    for suffix in ("", ".bkp"):
        kept = [path.with_name(path.name + suffix) for path in backup]
        if sums_of(kept) == sums[:-1]:
            break
    else:
        raise damage(backup[0], folder)
    if suffix:
        for path, other in zip(backup, kept, strict=True):
            shutil.copyfile(other, path)
    if sums_of([best := _best(folder, progress.best_epoch)]) != sums[-1:]:
        raise damage(best, folder)
    return progress


def _learning_rate(model: keras.Model) -> float:
    return float(keras.ops.convert_to_numpy(model.optimizer.learning_rate))


def _set_dropout(model: keras.Model, recipe: Recipe, epoch: int) -> None:
    """Switch dropout off where the recipe says so, and set its random state from (seed, epoch).

    Under PyTorch the process has one random state; under other backends each dropout layer has its own.
    """
    layers = [one for one in model._flatten_layers() if isinstance(one, keras.layers.Dropout) and one.rate > 0.0]
    if layers and recipe.dropout_until is not None and epoch + 1 > recipe.dropout_until * recipe.epochs:
        while layers:
            layers.pop().rate = 0.0
        model.make_train_function(force=True)  # the compiled function holds the old rates
    if keras.backend.backend() == "torch":
        import torch

        torch.manual_seed(int(np.random.default_rng([recipe.seed, epoch]).integers(2**31)))
    for index, layer in enumerate(layers):
        state = layer.seed_generator.state
        state.assign(np.random.default_rng([recipe.seed, epoch, index]).integers(2**31, size=state.shape))


def _best(folder: Path, epoch: int) -> Path:
    return folder / "best" / f"{epoch:05d}.weights.h5"

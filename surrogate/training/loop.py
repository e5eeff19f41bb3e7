"""The training loop of the package: one implementation for every model, recipe and backend.

The order of the training set in an epoch is drawn from (seed, epoch). Each batch is one call of the compiled
`train_on_batch`. After each epoch the loop computes the validation error, with the averaged weights if the recipe
averages, and writes a checkpoint of all that the next epoch depends on: weights, optimizer, random states, best
weights, history. A run that was interrupted and resumed therefore ends with the same numbers as an uninterrupted one.
The loss is the mean squared error of the scaled force, in float32.

Source: the paper's section "Training and hyperparameters" for the loss, the learning-rate schedule on a plateau, early
stopping and the restoration of the best weights.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import keras
import numpy as np

from surrogate.inference.keras_backend import predict_scaled
from surrogate.training.checkpoint import Progress, load_checkpoint, save_checkpoint, save_history
from surrogate.training.recipe import Recipe
from surrogate.training.soap import Soap


@dataclass(frozen=True)
class Examples:
    """Scaled trajectories: the two inputs of a model and the target.

    Args:
        sequence: A 3D float32 array of shape `(batch, steps, channels)`.
        tabor: A 2D float32 array of shape `(batch, 1)`.
        force: A 3D float32 array of shape `(batch, steps, 1)`.
    """

    sequence: np.ndarray
    tabor: np.ndarray
    force: np.ndarray

    def __len__(self) -> int:
        return len(self.sequence)


@dataclass(frozen=True)
class EpochReport:
    """Result of one epoch.

    Args:
        epochs: Largest number of epochs of the run.
        row: The epoch's row of the history, by column (`surrogate.training.checkpoint.HISTORY_COLUMNS`).
        seconds_left: Estimated wall-clock time until the last epoch, in seconds.
    """

    epochs: int
    row: dict[str, float]
    seconds_left: float


@dataclass(frozen=True)
class TrainingTask:
    """The arguments of `train` and of `surrogate.training.keras_fit.fit`.

    Args:
        model: An untrained model, built after `keras.utils.set_random_seed(recipe.seed)`.
        training: Scaled trajectories of the training set.
        validation: Scaled trajectories of the validation set.
        recipe: How to train.
        folder: Directory of the run, for checkpoints and `history.csv`.
        fingerprint: Identity of the training (`surrogate.training.identity`), stored with the checkpoint.
        should_stop: Called after each epoch; `True` ends the training early, and a later call resumes it.
        report: Called after each epoch.
    """

    model: keras.Model
    training: Examples
    validation: Examples
    recipe: Recipe
    folder: Path
    fingerprint: str = ""
    should_stop: Callable[[], bool] = lambda: False
    report: Callable[[EpochReport], None] = lambda _: None

    def end_epoch(self, progress: Progress) -> bool:
        """Write `history.csv`, report the last epoch, and return whether to stop."""
        save_history(self.folder / "history.csv", progress.history)
        seconds_left = (self.recipe.epochs - progress.epoch) * progress.seconds / progress.epoch
        self.report(EpochReport(self.recipe.epochs, progress.history[-1], seconds_left))
        return self.should_stop()


def train(task: TrainingTask) -> Progress:
    """Train a model, or resume the training in the same folder that was interrupted or had fewer epochs.

    The folder holds `checkpoint.npz` and `history.csv`.

    Returns:
        The progress. If `finished` is true, the model holds the best weights; otherwise `should_stop` ended the
        training, and a later call resumes it.

    Raises:
        ValueError: the checkpoint in the folder is of another training, or has more epochs than the recipe.
        FloatingPointError: the validation error is not finite.
    """
    model, recipe, training, validation = task.model, task.recipe, task.training, task.validation
    compile_by(recipe, model, steps=-(-len(training) // recipe.batch_size))
    progress = Progress()
    checkpoint = task.folder / "checkpoint.npz"
    if checkpoint.exists():
        progress = load_checkpoint(checkpoint, model, fingerprint=task.fingerprint)
    require_epochs(recipe, progress, task.folder)

    while not is_over(recipe, progress):
        clock, cpu = time.perf_counter(), time.process_time()
        epoch = progress.epoch + 1
        if recipe.dropout_until is not None and epoch > recipe.dropout_until * recipe.epochs:
            _switch_off_dropout(model)
        train_mse = _train_epoch(model, training, recipe, epoch)
        with averaged_weights(model):
            residual = predict_scaled(model, validation.sequence, validation.tabor) - validation.force[..., 0]
            validation_mse = float(np.mean(np.square(residual, dtype=np.float64)))
            require_finite(validation_mse, epoch)
            if validation_mse < progress.best_mse:
                progress.best_weights = [keras.ops.convert_to_numpy(v) for v in model.trainable_variables]
        row = {
            "epoch": epoch,
            "learning_rate": learning_rate(model),
            "train_mse": train_mse,
            "validation_mse": validation_mse,
            "validation_mae": float(np.mean(np.abs(residual))),
            "seconds": progress.seconds + time.perf_counter() - clock,
            "cpu_seconds": progress.cpu_seconds + time.process_time() - cpu,
        }
        progress.add(row)
        _follow_plateau(model, recipe, progress)
        save_checkpoint(checkpoint, model, progress, fingerprint=task.fingerprint)
        if task.end_epoch(progress):
            break

    progress.finished = is_over(recipe, progress)
    if progress.finished:
        _assign(model, progress.best_weights)
    return progress


@contextmanager
def averaged_weights(model: keras.Model) -> Iterator[None]:
    """Set the model's weights to their moving average inside the context, if its optimizer keeps one."""
    if not model.optimizer.use_ema:
        yield
        return
    raw = [keras.ops.convert_to_numpy(variable).copy() for variable in model.trainable_variables]
    model.optimizer.finalize_variable_values(model.trainable_variables)
    try:
        yield
    finally:
        _assign(model, raw)


def _assign(model: keras.Model, weights: list[np.ndarray]) -> None:
    for variable, value in zip(model.trainable_variables, weights, strict=True):
        variable.assign(value)


def learning_rate(model: keras.Model) -> float:
    """Return the current learning rate of a compiled model."""
    return float(keras.ops.convert_to_numpy(model.optimizer.learning_rate))


def require_finite(validation_error: float, epoch: int) -> None:
    """Raise `FloatingPointError` if the validation error of an epoch is NaN or infinite."""
    if not np.isfinite(validation_error):
        raise FloatingPointError(f"Training diverged: validation error {validation_error} in epoch {epoch}")


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


def active_dropout(model: keras.Model) -> list[keras.layers.Dropout]:
    """Return the dropout layers of a model, nested ones included, whose rate is above zero."""
    return [layer for layer in model._flatten_layers() if isinstance(layer, keras.layers.Dropout) and layer.rate > 0.0]


def _switch_off_dropout(model: keras.Model) -> None:
    if layers := active_dropout(model):
        for layer in layers:
            layer.rate = 0.0
        model.make_train_function(force=True)  # the compiled function holds the old rates


def order_of(recipe: Recipe, epoch: int, count: int) -> np.ndarray:
    """Return the order of `count` trajectories in an epoch: a permutation of shape `(count,)`; epochs start at 1."""
    return np.random.default_rng([recipe.seed, epoch]).permutation(count)


def require_epochs(recipe: Recipe, progress: Progress, folder: Path) -> None:
    """Check that the run in `folder` has not already trained for more epochs than the recipe.

    Raises:
        ValueError: it has.
    """
    if progress.epoch > recipe.epochs:
        raise ValueError(
            f"Expected at least {progress.epoch} epochs, which {folder} has already trained. "
            f"Received: epochs={recipe.epochs}"
        )


def _train_epoch(model: keras.Model, training: Examples, recipe: Recipe, epoch: int) -> float:
    """Train for one epoch and return the mean loss over its batches."""
    order = order_of(recipe, epoch, len(training))
    model.reset_metrics()
    loss = np.nan
    for start in range(0, len(order), recipe.batch_size):
        batch = order[start : start + recipe.batch_size]
        # Keras returns the mean loss since `reset_metrics`, not the loss of the batch.
        loss = model.train_on_batch([training.sequence[batch], training.tabor[batch]], training.force[batch])
    return float(loss)


def _follow_plateau(model: keras.Model, recipe: Recipe, progress: Progress) -> None:
    """Reduce the learning rate on a plateau of the validation error, if the recipe has `[plateau]`."""
    if recipe.plateau is None:
        return
    epoch = progress.epoch
    if epoch == progress.best_epoch:
        progress.flat_from = epoch
    if epoch - progress.flat_from >= recipe.plateau.patience:
        progress.flat_from = epoch
        model.optimizer.learning_rate = max(learning_rate(model) * recipe.plateau.factor, recipe.plateau.minimum_rate)


def is_over(recipe: Recipe, progress: Progress) -> bool:
    """Return whether training ends here: by the number of epochs, or by early stopping."""
    flat = progress.epoch - progress.best_epoch
    return progress.epoch >= recipe.epochs or bool(recipe.plateau and flat >= recipe.plateau.stop_after)

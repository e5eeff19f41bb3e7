"""The training loop: one implementation for every model, recipe and backend.

Batches come from numpy arrays in an order drawn from (seed, epoch), each is one compiled `train_on_batch`. After every
epoch the validation error is measured, with the averaged weights where the recipe averages, and everything the next
epoch depends on goes to a checkpoint: weights, optimizer, random states, best weights, history. A run that was killed
and resumed therefore ends with the same numbers as an undisturbed one. The loss is the mean squared error on the scaled
force; mixed precision stays off.
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
    """Scaled trajectories.

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
    """Result of one epoch: a row of the history, and the progress of the run."""

    epochs: int
    row: dict[str, float]
    seconds_left: float


def train(
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
    """Train a model, or go on where an earlier call in the same folder was interrupted or asked for fewer epochs.

    Args:
        model: An untrained model, built after `keras.utils.set_random_seed(recipe.seed)`.
        training: Scaled training trajectories.
        validation: Scaled validation trajectories.
        recipe: How to train.
        folder: Where `checkpoint.npz` and `history.csv` are kept.
        fingerprint: Identifies the run; a checkpoint of another one is refused.
        should_stop: Asked after every epoch; `True` ends the call early, resumably.
        report: Called after every epoch.

    Returns:
        The progress made. Where its `finished` is true the model holds the best weights; otherwise training was
        asked to stop and a later call resumes.

    Raises:
        ValueError: the folder's checkpoint belongs to another run, or is of more epochs than the recipe asks for.
        FloatingPointError: the validation error is not finite.
    """
    steps = -(-len(training) // recipe.batch_size)
    compile_by(recipe, model, steps)
    progress = Progress()
    checkpoint = folder / "checkpoint.npz"
    if checkpoint.exists():
        progress = load_checkpoint(checkpoint, model, fingerprint=fingerprint)
    require_epochs(recipe, progress, folder)

    while not is_over(recipe, progress):
        clock, cpu = time.perf_counter(), time.process_time()
        epoch = progress.epoch + 1
        if recipe.dropout_until is not None and epoch > recipe.dropout_until * recipe.epochs:
            _switch_off_dropout(model)
        train_mse = _train_epoch(model, training, recipe, epoch)
        with averaged_weights(model):
            residual = predict_scaled(model, validation.sequence, validation.tabor) - validation.force[..., 0]
            validation_mse = float(np.mean(np.square(residual, dtype=np.float64)))
            if not np.isfinite(validation_mse):
                raise FloatingPointError(f"Training diverged: validation error {validation_mse} in epoch {epoch}")
            if validation_mse < progress.best_mse:
                progress.best_mse, progress.best_epoch = validation_mse, epoch
                progress.best_weights = [keras.ops.convert_to_numpy(v) for v in model.trainable_variables]
        row = {
            "epoch": epoch,
            "learning_rate": float(keras.ops.convert_to_numpy(model.optimizer.learning_rate)),
            "train_mse": train_mse,
            "validation_mse": validation_mse,
            "validation_mae": float(np.mean(np.abs(residual))),
            "seconds": progress.seconds + time.perf_counter() - clock,
            "cpu_seconds": progress.cpu_seconds + time.process_time() - cpu,
        }
        progress.history.append(row)
        _follow_plateau(model, recipe, progress)
        save_checkpoint(checkpoint, model, progress, fingerprint=fingerprint)
        save_history(folder / "history.csv", progress.history)
        report(EpochReport(recipe.epochs, row, (recipe.epochs - epoch) * progress.seconds / epoch))
        if should_stop():
            break

    progress.finished = is_over(recipe, progress)
    if progress.finished:
        for variable, value in zip(model.trainable_variables, progress.best_weights, strict=True):
            variable.assign(value)
    return progress


@contextmanager
def averaged_weights(model: keras.Model) -> Iterator[None]:
    """Put the moving average of the weights into the model for a while, where its optimizer keeps one."""
    if not model.optimizer.use_ema:
        yield
        return
    raw = [keras.ops.convert_to_numpy(variable).copy() for variable in model.trainable_variables]
    model.optimizer.finalize_variable_values(model.trainable_variables)
    try:
        yield
    finally:
        for variable, value in zip(model.trainable_variables, raw, strict=True):
            variable.assign(value)


def with_fused_lstm(model: keras.Model) -> keras.Model:
    """Return the model to train: under PyTorch a copy whose LSTMs are fused, elsewhere the model itself."""
    if keras.backend.backend() != "torch":
        return model
    from surrogate.training.torch_lstm import with_torch_lstm

    return with_torch_lstm(model)


def compile_by(recipe: Recipe, model: keras.Model, steps: int, metrics: Sequence[str] = ()) -> None:
    """Give a model the recipe's optimizer and schedule; an epoch has `steps` batches."""
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
    # XLA is what makes JAX fast; on TensorFlow's CPU it makes an LSTM four times slower.
    compiled = keras.backend.backend() == "jax"
    model.compile(optimizer=optimizer, loss="mse", metrics=list(metrics) or None, jit_compile=compiled)


def _switch_off_dropout(model: keras.Model) -> None:
    active = [one for one in model._flatten_layers() if isinstance(one, keras.layers.Dropout) and one.rate > 0.0]
    if not active:
        return
    for layer in active:
        layer.rate = 0.0
    model.make_train_function(force=True)  # the compiled one holds the old rates


def order_of(recipe: Recipe, epoch: int, count: int) -> np.ndarray:
    """Return the order in which an epoch, counted from 1, goes through so many trajectories."""
    return np.random.default_rng([recipe.seed, epoch]).permutation(count)


def require_epochs(recipe: Recipe, progress: Progress, folder: Path) -> None:
    """Refuse a training that has gone further than it is asked to.

    Raises:
        ValueError: it is of more epochs than the recipe asks for.
    """
    if progress.epoch > recipe.epochs:
        raise ValueError(
            f"Expected at least the {progress.epoch} epochs that {folder} has trained. Received: epochs={recipe.epochs}"
        )


def _train_epoch(model: keras.Model, training: Examples, recipe: Recipe, epoch: int) -> float:
    order = order_of(recipe, epoch, len(training))
    model.reset_metrics()
    loss = np.nan
    for start in range(0, len(order), recipe.batch_size):
        batch = order[start : start + recipe.batch_size]
        # Keras returns the mean loss since the metrics were reset, not the batch's.
        loss = model.train_on_batch([training.sequence[batch], training.tabor[batch]], training.force[batch])
    return float(loss)


def _follow_plateau(model: keras.Model, recipe: Recipe, progress: Progress) -> None:
    """Shrink the rate where the recipe says so."""
    if recipe.plateau is None:
        return
    epoch = progress.epoch
    if epoch == progress.best_epoch:
        progress.flat_from = epoch
    if epoch - progress.flat_from >= recipe.plateau.patience:
        progress.flat_from = epoch
        rate = float(keras.ops.convert_to_numpy(model.optimizer.learning_rate))
        model.optimizer.learning_rate = max(rate * recipe.plateau.factor, recipe.plateau.minimum_rate)


def is_over(recipe: Recipe, progress: Progress) -> bool:
    """Tell whether the recipe ends here: by the number of epochs, or because the error has been flat for long."""
    flat = progress.epoch - progress.best_epoch
    return progress.epoch >= recipe.epochs or bool(recipe.plateau and flat >= recipe.plateau.stop_after)

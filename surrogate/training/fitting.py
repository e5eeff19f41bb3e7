"""Training by `model.fit` and Keras's own callbacks, for every model, recipe and backend.

`ReduceLROnPlateau` and `EarlyStopping` follow the validation loss by Keras's rules. `SwapEMAWeights` averages the
weights if the recipe does. `ModelCheckpoint` writes the best weights, and `BackupAndRestore` the state after each
epoch. After an interruption Keras restores weights and optimizer, but not the counters of its callbacks; these are
restored from the learning curve. Order and dropout of an epoch are drawn from (seed, epoch), so that an interrupted
training ends with the same numbers as an uninterrupted one. The loss is the mean squared error of the scaled force, in
float32. `surrogate.training.run_folder` describes the folder of a run.

Source: the paper's section "Training and hyperparameters" states what these callbacks do; all else is Keras's default.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import keras
import numpy as np

from surrogate.data.examples import Examples
from surrogate.training.recipe import Recipe
from surrogate.training.run_folder import COLUMNS, Progress, Report, best_weights, resumed, save_progress
from surrogate.training.soap import Soap
from surrogate.training.torch_lstm import with_fused_lstm

CLOCKS = {"seconds": time.perf_counter, "cpu_seconds": time.process_time}
VALIDATION_BATCH = 256
"""Trajectories in a batch of the validation set."""


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

    The caller holds the lock of the folder (`surrogate.training.run_folder.locked`).

    Args:
        model: An untrained model, built after `keras.utils.set_random_seed(recipe.seed)`.
        training: Scaled trajectories of the training set.
        validation: Scaled trajectories of the validation set.
        recipe: How to train.
        folder: Directory of the run.
        facts: What decides the result of the training, ready for JSON; those stored with the progress must be equal.
        should_stop: Called after each epoch; `True` ends the training early, and a later call resumes it.
        report: See `Report`.

    Returns:
        The progress. If `finished` is true, the model holds the best weights; otherwise `should_stop` ended the
        training, and a later call resumes it.

    Raises:
        ValueError: the run in the folder is of other facts, has more epochs than the recipe, or a damaged file.
        FloatingPointError: the validation error is not finite.
    """
    batches = Batches(training, recipe)
    compile_by(recipe, model, len(batches), metrics=["mae"])
    progress = resumed(folder, facts)
    if progress.epoch > recipe.epochs:
        raise ValueError(
            f"epochs must be at least {progress.epoch}, which {folder} has already trained; received {recipe.epochs}"
        )

    def keep() -> bool:
        """Save and report an epoch; return whether to stop."""
        save_progress(folder, progress, facts)
        report(progress, recipe.epochs)
        return should_stop()

    if not is_over(recipe, progress):
        model.fit(
            batches,
            epochs=recipe.epochs,
            shuffle=False,  # `Batches` has the order of the epoch already
            validation_data=((validation.sequence, validation.tabor), validation.force),
            validation_batch_size=VALIDATION_BATCH,
            callbacks=_callbacks(model, batches, progress, folder, keep),
            verbose=0,
        )
    progress.finished = is_over(recipe, progress)
    if progress.finished:
        model.load_weights(best_weights(folder, progress))
    return progress


def started(build: Callable[[], keras.Model], seed: int) -> keras.Model:
    """Return a new model to train, whose weights are drawn from a seed."""
    keras.config.set_floatx("float32")
    keras.utils.set_random_seed(seed)
    return with_fused_lstm(build())


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
        return (examples.sequence[batch], examples.tabor[batch]), examples.force[batch]


def _callbacks_of(recipe: Recipe, progress: Progress) -> tuple[list[Any], list[Any]]:
    """Return Keras's callbacks of a recipe's plateau, and of its average of weights, as far as it has them."""
    from keras import callbacks

    plateau, averaging = [], []
    if rule := recipe.plateau:
        threshold = {} if rule.least_gain is None else {"min_delta": rule.least_gain}
        plateau = [
            callbacks.ReduceLROnPlateau(
                factor=rule.factor, patience=rule.patience, min_lr=rule.minimum_rate, **threshold
            ),
            callbacks.EarlyStopping(patience=rule.stop_after),
        ]
    if recipe.weight_average is not None:
        averaging = [callbacks.SwapEMAWeights(swap_on_epoch=True)]
        # A restored model holds the averaged weights, as it did when the backup was written.
        averaging[0]._ema_weights_in_model = bool(progress.history)
    return plateau, averaging


def _callbacks(
    model: keras.Model, batches: Batches, progress: Progress, folder: Path, keep: Callable[[], bool]
) -> list[keras.callbacks.Callback]:
    """Return Keras's callbacks between those that begin and keep an epoch, in the order of their calls."""
    from keras import callbacks

    recipe, since = batches.recipe, dict.fromkeys(CLOCKS, 0.0)
    plateau, averaging = _callbacks_of(recipe, progress)

    def learning_rate() -> float:
        return float(keras.ops.convert_to_numpy(model.optimizer.learning_rate))

    def begin(epoch: int, _: Any) -> None:
        """Draw order and dropout of an epoch, whose random state a weights file does not hold; start the clocks."""
        batches.shuffle(epoch)
        _set_dropout(model, recipe, epoch)
        since.update({name: clock() for name, clock in CLOCKS.items()})

    def complete(epoch: int, logs: dict[str, Any]) -> None:
        """Check the validation loss, and add learning rate and seconds to the logs."""
        if not np.isfinite(logs["val_loss"]):
            raise FloatingPointError(f"Training diverged: validation error {logs['val_loss']} in epoch {epoch + 1}")
        logs["learning_rate"] = learning_rate()
        logs.update({name: progress.spent(name) + clock() - since[name] for name, clock in CLOCKS.items()})

    def replay(_: Any) -> None:
        """Restore the counters of the plateau, from the first rate on; then the rate is the one that Keras restored."""
        if plateau:
            rate, model.optimizer.learning_rate = learning_rate(), recipe.learning_rate
            for epoch, row in enumerate(progress.history):
                for callback in plateau:
                    callback.on_epoch_end(epoch, {"val_loss": row["validation_mse"]})
            model.optimizer.learning_rate = rate

    def end(epoch: int, logs: dict[str, Any]) -> None:
        """Add the epoch to the history, keep it, and end the training when asked to."""
        progress.history.append({"epoch": epoch + 1} | {name: float(logs[key]) for name, key in COLUMNS.items()})
        model.stop_training |= keep()

    return [
        callbacks.LambdaCallback(on_epoch_begin=begin, on_epoch_end=complete),
        *plateau,
        *averaging,
        callbacks.ModelCheckpoint(
            folder / "best" / "{epoch:05d}.weights.h5",
            save_best_only=True,
            save_weights_only=True,
            initial_value_threshold=progress.best_mse if progress.history else None,
        ),
        callbacks.BackupAndRestore(folder / "backup", double_checkpoint=True, delete_checkpoint=False),
        callbacks.LambdaCallback(on_train_begin=replay, on_epoch_end=end),
    ]


def _set_dropout(model: keras.Model, recipe: Recipe, epoch: int) -> None:
    """Switch dropout off where the recipe says so, and set its random state from (seed, epoch).

    Under PyTorch the process has one random state; under other backends each dropout layer has its own.
    """
    layers = [
        layer for layer in model._flatten_layers() if isinstance(layer, keras.layers.Dropout) and layer.rate > 0.0
    ]
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

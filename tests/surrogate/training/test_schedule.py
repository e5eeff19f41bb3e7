"""Order of the batches, learning rate and its changes, epoch by epoch and step by step, against numbers by hand."""

from dataclasses import replace
from types import SimpleNamespace

import keras
import numpy as np
import pytest

from surrogate.training.checkpoint import Progress
from surrogate.training.loop import Examples, _follow_plateau, _train_epoch, compile_by, is_over
from surrogate.training.recipe import Cosine, Plateau, Recipe

RECIPE = Recipe(name="test", seed=3, batch_size=4, epochs=10, learning_rate=0.1)
PLATEAU = replace(RECIPE, plateau=Plateau(factor=0.5, patience=2, minimum_rate=0.03, stop_after=4))


def small_model():
    given = keras.Input((3,))
    return keras.Model(given, keras.layers.Dense(1)(given))


def compiled(recipe, steps=20):
    model = small_model()
    compile_by(recipe, model, steps)
    return model.optimizer


def rates(recipe, at, steps=20):
    schedule = compiled(recipe, steps)._learning_rate
    return [float(keras.ops.convert_to_numpy(schedule(step))) for step in at]


def test_the_rate_rises_to_its_peak_and_falls_by_half_a_cosine_to_zero():
    warmed = replace(RECIPE, cosine=Cosine(warmup_epochs=2))
    # 200 steps, of which 40 rise; half of the other 160 are done at step 120.
    assert rates(warmed, (0, 20, 40, 120, 200)) == pytest.approx([0.0, 0.05, 0.1, 0.05, 0.0], abs=1e-7)
    cold = replace(RECIPE, cosine=Cosine())
    assert rates(cold, (0, 100, 200)) == pytest.approx([0.1, 0.05, 0.0], abs=1e-7)
    # Also where the warm-up would last longer than the training.
    endless = replace(RECIPE, cosine=Cosine(warmup_epochs=50))
    assert rates(endless, (0, 199), steps=20) == pytest.approx([0.0, 0.1], abs=1e-7)


def test_a_recipe_sets_clipping_and_the_averages_time_constant():
    found = compiled(replace(RECIPE, gradient_norm=0.7, weight_average=0.1))
    assert (found.global_clipnorm, found.use_ema) == (0.7, True)
    # A tenth of 200 steps.
    assert found.ema_momentum == pytest.approx(1.0 - 1.0 / 20.0)
    assert not compiled(RECIPE).use_ema
    assert compiled(RECIPE).global_clipnorm is None
    assert float(keras.ops.convert_to_numpy(compiled(RECIPE).learning_rate)) == pytest.approx(0.1)


def followed(errors):
    """The rate after each epoch of these validation errors, and whether training is over then."""
    model = SimpleNamespace(optimizer=SimpleNamespace(learning_rate=keras.Variable(0.1)))
    progress, found = Progress(), []
    for epoch, error in enumerate(errors, start=1):
        progress.add({"epoch": epoch, "validation_mse": error})
        _follow_plateau(model, PLATEAU, progress)
        rate = float(keras.ops.convert_to_numpy(model.optimizer.learning_rate))
        found.append((round(rate, 6), is_over(PLATEAU, progress)))
    return found


def test_a_plateau_shrinks_the_rate_to_its_minimum_and_ends_the_training():
    assert followed([5, 4, 6, 6, 3, 6, 6, 6, 6]) == [
        (0.1, False),
        (0.1, False),
        (0.1, False),
        (0.05, False),
        (0.05, False),
        (0.05, False),
        (0.03, False),
        (0.03, False),
        (0.03, True),
    ]
    assert is_over(RECIPE, Progress(history=[{}] * 10, best_epoch=10))
    assert not is_over(RECIPE, Progress(history=[{}] * 9, best_epoch=0))


class Watched:
    """A model that remembers its batches."""

    def __init__(self):
        self.batches = []

    def reset_metrics(self):
        self.batches.clear()

    def train_on_batch(self, inputs, force):
        np.testing.assert_array_equal(inputs[0][:, 0, 0], inputs[1][:, 0])
        np.testing.assert_array_equal(inputs[0][:, 0, 0], force[:, 0, 0])
        self.batches.append(force[:, 0, 0].astype(int).tolist())
        return len(self.batches)


def test_every_epoch_sees_all_examples_once_in_an_order_of_seed_and_epoch():
    numbers = np.arange(10.0).reshape(-1, 1, 1)
    examples = Examples(sequence=numbers, tabor=numbers[:, 0], force=numbers)
    model, orders = Watched(), {}
    for seed, epoch in ((3, 1), (3, 2), (4, 1), (3, 1)):
        loss = _train_epoch(model, examples, replace(RECIPE, seed=seed), epoch)
        assert [len(batch) for batch in model.batches] == [4, 4, 2]
        assert loss == 3.0
        order = [number for batch in model.batches for number in batch]
        assert sorted(order) == list(range(10))
        assert orders.setdefault((seed, epoch), order) == order
    assert len({tuple(order) for order in orders.values()}) == 3

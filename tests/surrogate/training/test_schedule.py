"""Order of the batches, learning rate and its changes, epoch by epoch and step by step, against numbers by hand."""

from dataclasses import replace

import keras
import numpy as np
import pytest

from surrogate.data.examples import Examples
from surrogate.training.fitting import Batches, compile_by, is_over
from surrogate.training.recipe import Cosine, Plateau, Recipe
from surrogate.training.run_folder import Progress

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


def test_every_epoch_sees_all_examples_once_in_an_order_of_seed_and_epoch():
    numbers = np.arange(10.0).reshape(-1, 1, 1)
    examples, orders = Examples(sequence=numbers, tabor=numbers[:, 0], force=numbers), {}
    for seed, epoch in ((3, 0), (3, 1), (4, 0), (3, 0)):
        batches = Batches(examples, replace(RECIPE, seed=seed))
        batches.shuffle(epoch)
        found = [batches[index] for index in range(len(batches))]
        assert [len(force) for _, force in found] == [4, 4, 2]
        for (sequence, tabor), force in found:
            np.testing.assert_array_equal(sequence[:, 0, 0], force[:, 0, 0])
            np.testing.assert_array_equal(tabor[:, 0], force[:, 0, 0])
        order = np.concatenate([force[:, 0, 0] for _, force in found]).tolist()
        assert sorted(order) == list(range(10))
        assert orders.setdefault((seed, epoch), order) == order
    assert len({tuple(order) for order in orders.values()}) == 3


@pytest.mark.parametrize(
    ("errors", "over"), [([5, 4, 6, 6, 3, 6, 6, 6], False), ([5, 4, 6, 6, 3, 6, 6, 6, 6], True), ([9] * 10, True)]
)
def test_a_training_ends_by_early_stopping_or_by_its_epochs(errors, over):
    progress = Progress([{"validation_mse": error} for error in errors])
    assert is_over(PLATEAU, progress) == over
    assert is_over(RECIPE, progress) == (len(errors) == 10)
    assert progress.best_mse == min(errors)
    assert errors[progress.best_epoch - 1] == min(errors)

"""Recipes, and what they set: order of the batches, learning rate and its changes against numbers by hand."""

from dataclasses import replace

import keras
import numpy as np
import pytest

from surrogate.data.examples import Examples
from surrogate.training.fitting import Batches, compile_by, is_over
from surrogate.training.recipe import Cosine, Plateau, Recipe
from surrogate.training.run_folder import Progress


def test_packaged_recipes():
    paper, swift = Recipe.load("paper"), Recipe.load("swift")
    assert (paper.batch_size, paper.learning_rate, paper.epochs, paper.plateau.stop_after) == (8, 1e-4, 2000, 30)
    assert (paper.loop, swift.loop) == ("fit", None)
    worded = Recipe.load("paper-as-worded")
    assert (worded.plateau.least_gain, paper.plateau.least_gain) == (0.0, None)
    assert worded.with_overrides(name="paper", plateau=paper.plateau) == paper
    # What a recipe is known by has no key for a default, so that trainings from before the key stay the same.
    assert "least_gain" not in paper.as_dict()["plateau"]
    assert (swift.optimizer, swift.batch_size, swift.learning_rate, swift.epochs) == ("soap", 64, 4e-3, 30)
    assert swift.with_overrides(epochs=3, seed=None).epochs == 3


WHOLE = 'name = "mine"\nseed = 0\nbatch_size = 8\nepochs = 3\nlearning_rate = 1e-3\n'
PACES = "factor = 0.5\npatience = 1\nminimum_rate = 0\nstop_after"
REFUSED = [
    ("seed = 0", "seed = -1", "seed must be a whole number from 0 .*received -1"),
    ("= 8", '= "eight"', "batch_size must be a whole number from 1 to 9223372036854775807; received 'eight'"),
    ("= 3", "= true", "epochs must be a whole number from 1 to .*; received True"),
    ("= 3", "= 0", "epochs must be a whole number from 1"),
    ("1e-3", "nan", "learning_rate must be a finite number greater than 0; received nan"),
    (WHOLE, WHOLE + 'loop = "own"', "loop must be fit; received 'own'"),
    (WHOLE, WHOLE + "weight_average = 2", "weight_average must .* greater than 0 and at most 1; received 2"),
    (WHOLE, WHOLE + "dropout_until = 2", "dropout_until must .* received 2"),
    (WHOLE, WHOLE + 'optimizer = "sgd"', "optimizer must be adam or soap"),
    (WHOLE, WHOLE + "gradient_norm = 0.0", "gradient_norm must"),
    (WHOLE, f"{WHOLE}[plateau]\n{PACES} = 0", "stop_after must be a whole number from 1 to .*; received 0"),
    (
        WHOLE,
        f"{WHOLE}[plateau]\n{PACES} = 1\n[cosine]",
        r"\[cosine\] and \[plateau\] must not stand together; received both",
    ),
    (
        WHOLE,
        f"{WHOLE}[plateau]\npatience = 3",
        r"the table \[plateau\] must have factor, patience, .*, optionally least_gain; received .* without factor, "
        "minimum_rate, stop_after",
    ),
    (WHOLE, f"{WHOLE}[cosine]\nwarm = 1", r"the table \[cosine\] must have optionally warmup_epochs; .* with warm"),
    (WHOLE, f"{WHOLE}cosine = 3", r"the table \[cosine\] must be a table; received 3"),
    (WHOLE, "name = mine", r"a training recipe must be TOML; received .*\(Invalid value \(at line 1, column 8\)\)"),
    (
        WHOLE,
        'name = "mine"\npatience = 3\nspeed = 1',
        "a training recipe must have name, seed, batch_size, epochs, learning_rate, optionally "
        "optimizer, .*, optionally plateau; received .* without seed, batch_size, epochs, "
        "learning_rate and with patience, speed",
    ),
    (WHOLE, "".join(f"key_{number} = 1\n" for number in range(10_000)) + WHOLE, "with key_0, .* key_9999"),
]


@pytest.mark.parametrize(("old", "new", "said"), REFUSED, ids=range(len(REFUSED)))
def test_bad_recipe_gives_one_sentence(old, new, said, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(WHOLE.replace(old, new))
    with pytest.raises(ValueError, match=said) as refused:
        Recipe.load(path)
    assert str(path) in str(refused.value)
    assert len(str(refused.value)) < 1000


def test_an_unknown_recipe_is_told_the_known():
    with pytest.raises(FileNotFoundError, match="paper, paper-as-worded, swift"):
        Recipe.load("slow")


RECIPE = Recipe(name="test", seed=3, batch_size=4, epochs=10, learning_rate=0.1)
ON_PLATEAU = replace(RECIPE, plateau=Plateau(factor=0.5, patience=2, minimum_rate=0.03, stop_after=4))


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


def test_rate_warms_up_and_falls_by_a_cosine():
    warmed = replace(RECIPE, cosine=Cosine(warmup_epochs=2))
    # 200 steps, of which 40 rise; half of the other 160 are done at step 120.
    assert rates(warmed, (0, 20, 40, 120, 200)) == pytest.approx([0.0, 0.05, 0.1, 0.05, 0.0], abs=1e-7)
    cold = replace(RECIPE, cosine=Cosine())
    assert rates(cold, (0, 100, 200)) == pytest.approx([0.1, 0.05, 0.0], abs=1e-7)
    # Also where the warm-up would last longer than the training.
    endless = replace(RECIPE, cosine=Cosine(warmup_epochs=50))
    assert rates(endless, (0, 199), steps=20) == pytest.approx([0.0, 0.1], abs=1e-7)


def test_recipe_sets_clipping_and_averaging():
    found = compiled(replace(RECIPE, gradient_norm=0.7, weight_average=0.1))
    assert (found.global_clipnorm, found.use_ema) == (0.7, True)
    # A tenth of 200 steps.
    assert found.ema_momentum == pytest.approx(1.0 - 1.0 / 20.0)
    assert not compiled(RECIPE).use_ema
    assert compiled(RECIPE).global_clipnorm is None
    assert float(keras.ops.convert_to_numpy(compiled(RECIPE).learning_rate)) == pytest.approx(0.1)


def test_seed_and_epoch_order_the_batches():
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
def test_early_stopping_or_epochs_end_it(errors, over):
    progress = Progress([{"validation_mse": error} for error in errors])
    assert is_over(ON_PLATEAU, progress) == over
    assert is_over(RECIPE, progress) == (len(errors) == 10)
    assert progress.best_mse == min(errors)
    assert errors[progress.best_epoch - 1] == min(errors)

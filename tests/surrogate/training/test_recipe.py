import pytest

from surrogate.training.recipe import Plateau, Recipe


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


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"seed": -1}, "seed must be a whole number from 0 .*received -1"),
        ({"loop": "own"}, "loop must be fit; received 'own'"),
        ({"weight_average": 2}, "weight_average must .* greater than 0 and at most 1; received 2"),
        ({"epochs": 0}, "epochs must be a whole number from 1"),
        ({"dropout_until": 2}, "dropout_until must .* received 2"),
        ({"optimizer": "sgd"}, "optimizer must be adam or soap"),
        ({"gradient_norm": 0.0}, "gradient_norm must"),
        ({"plateau": Plateau(0.5, 1, 1e-3, 3)}, r"one of \[cosine\] and \[plateau\]"),
    ],
)
def test_values_out_of_range_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        Recipe.load("swift").with_overrides(**change)


def test_an_unknown_recipe_is_told_the_known():
    with pytest.raises(FileNotFoundError, match="paper, paper-as-worded, swift"):
        Recipe.load("slow")


WHOLE = 'name = "mine"\nseed = 0\nbatch_size = 8\nepochs = 3\nlearning_rate = 1e-3\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            'name = "mine"\npatience = 3\nspeed = 1\n',
            "Expected name, seed, batch_size, epochs, learning_rate, "
            "optionally optimizer, optionally gradient_norm, "
            "optionally weight_average, optionally dropout_until, optionally loop, optionally cosine, "
            "optionally plateau in a training recipe. Received: {} without seed, "
            "batch_size, epochs, learning_rate and with patience, speed",
        ),
        (
            f"{WHOLE}[plateau]\npatience = 3\n",
            "Expected factor, patience, minimum_rate, stop_after, optionally least_gain in the table [plateau]. "
            "Received: {} without factor, minimum_rate, stop_after",
        ),
        (
            f"{WHOLE}[cosine]\nwarm = 1\n",
            "Expected optionally warmup_epochs in the table [cosine]. Received: {} with warm",
        ),
        (f"{WHOLE}cosine = 3\n", "Expected the table [cosine]. Received: 3 in {}"),
        (
            WHOLE.replace("8", '"eight"'),
            "batch_size must be a whole number from 1 to 9223372036854775807; received 'eight' in {}",
        ),
        (
            WHOLE.replace("1e-3", "nan"),
            "learning_rate must be a finite number greater than 0; received nan in {}",
        ),
        (
            WHOLE.replace("= 3", "= true"),
            "epochs must be a whole number from 1 to 9223372036854775807; received True in {}",
        ),
        ("name = mine", "Expected a training recipe in TOML. Received: {} (Invalid value (at line 1, column 8))"),
        (
            f"{WHOLE}[plateau]\nfactor = 0.5\npatience = 1\nminimum_rate = 0\nstop_after = 0\n",
            "stop_after must be a whole number from 1 to 9223372036854775807; received 0 in {}",
        ),
    ],
    ids=["keys", "plateau", "cosine", "no table", "text", "nan", "boolean", "no TOML", "range"],
)
def test_a_bad_recipe_is_one_sentence_that_names_what_is_allowed(text, said, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"Expected|must be") as refused:
        Recipe.load(path)
    assert str(refused.value) == said.format(path)


def test_a_recipe_of_any_name_is_read_back(tmp_path):
    (tmp_path / "mine.toml").write_text(WHOLE.replace('"mine"', "'my \"best\" \\ one'"))
    chosen = Recipe.load(tmp_path / "mine.toml")
    (tmp_path / "again.toml").write_text(chosen.to_toml())
    assert Recipe.load(tmp_path / "again.toml") == chosen


def test_many_unknown_keys_are_named_in_part(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("".join(f"key_{number} = 1\n" for number in range(10_000)) + WHOLE)
    with pytest.raises(ValueError, match=r"with key_0, .* key_9999") as refused:
        Recipe.load(path)
    assert len(str(refused.value)) < 1000

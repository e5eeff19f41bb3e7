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
    (WHOLE, WHOLE + "peak_weight = 0", "peak_weight must .* received 0"),
    (WHOLE, WHOLE + 'optimizer = "sgd"', "optimizer must be adam or soap"),
    (WHOLE, WHOLE + "gradient_norm = 0.0", "gradient_norm must"),
    (WHOLE, f"{WHOLE}[plateau]\n{PACES} = 0", "stop_after must be a whole number from 1 to .*; received 0"),
    (WHOLE, f"{WHOLE}[plateau]\n{PACES} = 1\n[cosine]", r"one of \[cosine\] and \[plateau\]"),
    (
        WHOLE,
        f"{WHOLE}[plateau]\npatience = 3",
        r"Expected factor, patience, .*, optionally least_gain in the table "
        r"\[plateau\]\. Received: .* without factor, minimum_rate, stop_after",
    ),
    (WHOLE, f"{WHOLE}[cosine]\nwarm = 1", r"optionally warmup_epochs in the table \[cosine\]\. .* with warm"),
    (WHOLE, f"{WHOLE}cosine = 3", r"Expected the table \[cosine\]\. Received: 3"),
    (WHOLE, "name = mine", r"a training recipe in TOML\. Received: .*\(Invalid value \(at line 1, column 8\)\)"),
    (
        WHOLE,
        'name = "mine"\npatience = 3\nspeed = 1',
        "Expected name, seed, batch_size, epochs, learning_rate, optionally "
        "optimizer, .*, optionally plateau in a training recipe. Received: .* without seed, batch_size, epochs, "
        "learning_rate and with patience, speed",
    ),
    (WHOLE, "".join(f"key_{number} = 1\n" for number in range(10_000)) + WHOLE, "with key_0, .* key_9999"),
]


@pytest.mark.parametrize(("old", "new", "said"), REFUSED, ids=range(len(REFUSED)))
def test_a_bad_recipe_is_one_sentence_that_names_what_is_allowed(old, new, said, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(WHOLE.replace(old, new))
    with pytest.raises(ValueError, match=f"^(Expected .*)?{said}") as refused:
        Recipe.load(path)
    assert str(path) in str(refused.value)
    assert len(str(refused.value)) < 1000


def test_an_unknown_recipe_is_told_the_known():
    with pytest.raises(FileNotFoundError, match="paper, paper-as-worded, swift"):
        Recipe.load("slow")
    with pytest.raises(ValueError, match=r"one of \[cosine\] and \[plateau\]"):
        Recipe.load("swift").with_overrides(plateau=Plateau(0.5, 1, 1e-3, 3))


def test_a_recipe_of_any_name_is_read_back(tmp_path):
    (tmp_path / "mine.toml").write_text(WHOLE.replace('"mine"', "'my \"best\" \\ one'"))
    chosen = Recipe.load(tmp_path / "mine.toml")
    (tmp_path / "again.toml").write_text(chosen.to_toml())
    assert Recipe.load(tmp_path / "again.toml") == chosen

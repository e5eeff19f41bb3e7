from bem._support.wording import listed

MODELS = [f"M{family}-{way}" for family in range(1, 7) for way in ("concat", "FiLM", "gated")]


def test_alike_choices_come_first():
    assert listed(["slow", "fast"], "fats") == "fast, slow"


def test_many_choices_are_counted():
    assert listed(MODELS, "M1-conat").startswith("M1-concat, ")
    assert listed(MODELS, "M1-conat").endswith(" or 15 others")


def test_without_an_alike_choice_many_are_not_all_listed():
    text = listed([f"model-{number}" for number in range(50)] + ["accurate", "fast"], "xyz")
    assert text.startswith("fast, ")
    assert text.endswith(" or 40 others")


def test_without_an_alike_choice_all_are_listed():
    assert listed(MODELS, "xyz").split(", ") == MODELS

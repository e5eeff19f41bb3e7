"""How a model looks in every figure, and how those that are missing are named."""

from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import paper_names


def test_each_model_has_one_look():
    looks = {(models_style.color(name), models_style.marker(name)["marker"]) for name in paper_names()}
    assert len(looks) == 18
    assert models_style.marker("M1-concat")["marker"] == "^"
    assert models_style.color("M1-concat") == drawing.BLUE
    ours = {drawing.BLUE, drawing.RED, drawing.GREEN, drawing.VIOLET, drawing.ORANGE, drawing.SKY, drawing.BLACK}
    assert drawing.PAPER not in ours
    assert models_style.paper_marker("M1-concat")["markeredgecolor"] == drawing.PAPER


def test_missing_models_are_named():
    assert models_style.missing_note([]) == ""
    missing = ["M1-gated", *(f"M2-{c}" for c in ("concat", "FiLM", "gated"))]
    note = "not trained yet, 4 of 18: M1-gated, all of M2"
    assert models_style.missing_note(missing) == note
    differences = {name: ["recipe"] for name in ("M3-FiLM", "M4-FiLM", "M1-concat-8-epochs")} | {"M6-FiLM": ["split"]}
    assert models_style.missing_note(missing, differences) == (
        f"{note}; trained with another recipe: M3-FiLM, M4-FiLM; trained with another split: M6-FiLM"
    )
    assert models_style.missing_note([], {"M3-FiLM": ["recipe", "backend"]}) == (
        "trained with another recipe and backend: M3-FiLM"
    )


def test_equal_numbers_of_seeds_stated_once():
    def ranked(**seeds):
        return {"models": {name: [{}] * count for name, count in seeds.items()}}

    drawn = ["M1-concat", "M1-FiLM"]
    same, mixed = (ranked(**{"M1-concat": 3, "M1-FiLM": count}) for count in (3, 0))
    assert models_style.spread_line(same, drawn) == "median, least and largest of 3 seeds each"
    assert models_style.spread_line(mixed, drawn) == "median, least and largest of 3 or 1 seeds each"
    assert models_style.spread_line(ranked(**{"M1-concat": 1}), drawn) == ""

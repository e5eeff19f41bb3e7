"""Captions beside figures, what is said where a result is missing, and how models look and are named."""

import inspect
import json
import subprocess
import sys

import pytest

from experiments.places import FOLDERS, Places
from paper_figures.__main__ import caption, function_of, main, modules, save
from paper_figures.figures import models
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table
from surrogate.architectures.naming import names
from tests.paper_figures.results import comparison
from tests.processes import ROOT

FIGURES = [name for name in modules() if not name.startswith("table-")]


@pytest.mark.parametrize("name", FIGURES)
def test_a_caption_says_what_is_shown_and_what_differs(name, tmp_path):
    text = caption(name, [tmp_path / "some.json"])
    assert text.startswith("# ")
    for part in ("**Shown.** ", "**Data.** ", "**Different from the paper.** "):
        assert len(text.split(part)[1].split("\n\n")[0]) > 20
    assert str(tmp_path / "some.json") in text
    assert f"`python -m paper_figures {name}`" in text


def test_a_figure_without_a_caption_is_told_where_it_belongs():
    with pytest.raises(ValueError, match=r"Expected a table \[figure-mine\] with a text `shown` in .*captions.toml"):
        caption("figure-mine", [])


def test_a_caption_belongs_beside_each_figure_of_a_target(tmp_path):
    figures, tables = tmp_path / "figures", tmp_path / "tables"
    products = {"a": drawing.figure(height=2.0), "n": Table(["n"], [["1"]], "."), "b": drawing.figure(height=2.0)}
    assert save(products, "figure-1", figures, tables) == [figures / "a.md", figures / "b.md"]
    assert {path.name for path in figures.iterdir()} == {"a.pdf", "a.png", "b.pdf", "b.png"}
    assert {path.name for path in tables.iterdir()} == {"n.md", "n.csv", "n.tex"}


def test_the_command_writes_the_caption(tmp_path, examples):
    path = tmp_path / "examples.json"
    path.write_text(json.dumps(examples), encoding="utf-8")
    command = [sys.executable, "-m", "paper_figures", "figure-3", "--results", str(tmp_path)]
    subprocess.run([*command, "--dataset-examples", str(path)], cwd=ROOT, check=True)
    written = (tmp_path / "figures" / "figure-3.md").read_text(encoding="utf-8")
    assert written == caption("figure-3", [path])


ASKED = {
    name: [one for one in inspect.signature(function_of(name)).parameters if one != "family"] for name in modules()
}


@pytest.mark.parametrize("shown", ASKED)
def test_a_missing_result_names_the_command_that_makes_it(shown, tmp_path):
    places = Places(tmp_path, tmp_path / "published")
    for name in set(ASKED[shown]) - FOLDERS.keys():
        target = shown if places.path(name).parent == tmp_path / "studies" else name.replace("_", "-")
        with pytest.raises(FileNotFoundError, match=rf"`make (measure-)?{target}` makes it"):
            places.read(name, shown)


@pytest.mark.parametrize("words", [[], ["--leave-out"]])
def test_a_figure_without_its_results_is_an_error_unless_it_may_be_left_out(words, tmp_path, monkeypatch, capsys):
    known = ["paper_figures", "figure-learning-curves", "--results", str(tmp_path), "--published", str(tmp_path)]
    monkeypatch.setattr("sys.argv", [*known, *words])
    with pytest.raises(SystemExit) as end:
        main()
    said = capsys.readouterr()
    assert (end.value.code, "model_comparison.json' not found" in said.out + said.err) == (0 if words else 2, True)
    assert said.out.startswith("figure-learning-curves is left out: ") == bool(words)


def test_learning_curves_are_drawn_where_a_model_with_them_is_published():
    assert models.figure_learning_curves(comparison(["M1-concat", "M4-gated"])).axes[1].lines
    with pytest.raises(FileNotFoundError, match="no FiLM or gated model is published; `make models` trains them"):
        models.figure_learning_curves(comparison(["M1-concat", "M2-concat"]))


def test_a_result_that_no_module_makes_is_to_be_restored(tmp_path):
    with pytest.raises(FileNotFoundError, match="restore it from the repository"):
        Places(tmp_path, tmp_path).read("step_length", "docs-numbers")


def test_each_model_looks_the_same_everywhere_and_none_like_the_papers():
    looks = {(models_style.color(name), models_style.marker(name)["marker"]) for name in names()}
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


def test_seeds_are_stated_once_if_all_models_have_the_same_number():
    def ranked(**seeds):
        return {"models": {name: [{}] * count for name, count in seeds.items()}}

    drawn = ["M1-concat", "M1-FiLM"]
    same, other = (ranked(**{"M1-concat": 3, "M1-FiLM": count}) for count in (3, 0))
    assert models_style.spread_line(same, drawn) == "median, least and largest of 3 seeds each"
    assert models_style.spread_line(other, drawn) == "median, least and largest of 3 or 1 seeds each"
    assert models_style.spread_line(ranked(**{"M1-concat": 1}), drawn) == ""

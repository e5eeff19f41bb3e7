"""Captions beside figures, and what is said where a result is missing."""

import inspect
import json
from importlib import import_module

import pytest

from experiments.places import FOLDERS, Places
from paper_figures.__main__ import caption, main, modules, save
from paper_figures.models import figure_learning_curves
from paper_figures.style import drawing
from paper_figures.style.writing import Table
from tests.paper_figures.results import comparison

FIGURES = [name for name, module in modules().items() if not module.startswith("paper_figures.tables.")]


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


def test_the_command_writes_the_caption(tmp_path, examples, monkeypatch):
    path = tmp_path / "examples.json"
    path.write_text(json.dumps(examples), encoding="utf-8")
    words = ["figure-3", "--results", str(tmp_path), "--dataset-examples", str(path)]
    monkeypatch.setattr("sys.argv", ["paper_figures", *words])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    written = (tmp_path / "figures" / "figure-3.md").read_text(encoding="utf-8")
    assert written == caption("figure-3", [path])


ASKED = {
    name: [one for one in inspect.signature(import_module(module).compose).parameters if one != "family"]
    for name, module in modules().items()
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
    assert figure_learning_curves.compose(comparison(["M1-concat", "M4-gated"])).axes[1].lines
    with pytest.raises(FileNotFoundError, match="no FiLM or gated model is published; `make models` trains them"):
        figure_learning_curves.compose(comparison(["M1-concat", "M2-concat"]))


def test_a_result_that_no_module_makes_is_to_be_restored(tmp_path):
    with pytest.raises(FileNotFoundError, match="restore it from the repository"):
        Places(tmp_path, tmp_path).read("step_length", "docs-numbers")

"""A figure or table whose result file is missing names the command that makes it."""

import inspect
from importlib import import_module

import pytest

from experiments.places import FOLDERS, Places
from paper_figures.__main__ import main, modules
from paper_figures.models import figure_learning_curves
from tests.paper_figures.results import comparison

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

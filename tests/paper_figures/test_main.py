"""Captions beside figures, and what is said where a result is missing."""

import json

import pytest

from bem._support.command_line import run_main
from paper_figures.__main__ import caption, main, modules, save
from paper_figures.models import figure_learning_curves
from paper_figures.style import drawing
from paper_figures.style.writing import Table
from surrogate.architectures.naming import PAPER_FAMILIES
from tests.paper_figures.results import comparison

FIGURES = [name for name, module in modules().items() if not module.startswith("paper_figures.tables.")]


@pytest.mark.parametrize("name", FIGURES)
def test_caption_states_differences(name, tmp_path):
    text = caption(name, [tmp_path / "some.json"])
    assert text.startswith("# ")
    for heading in ("**Shown.** ", "**Data.** ", "**Different from the paper.** "):
        assert len(text.split(heading)[1].split("\n\n")[0]) > 20
    assert str(tmp_path / "some.json") in text
    assert f"`make {name}`" in text


def test_missing_caption_is_refused():
    with pytest.raises(ValueError, match=r"Expected a table \[figure-mine\] with a text `shown` in .*captions.toml"):
        caption("figure-mine", [])


def test_each_figure_has_a_caption_beside(tmp_path):
    figures, tables = tmp_path / "figures", tmp_path / "tables"
    products = {"a": drawing.figure(height=2.0), "n": Table(["n"], [["1"]], "."), "b": drawing.figure(height=2.0)}
    assert save(products, figures / "figure-1.pdf") == [figures / "a.md", figures / "b.md"]
    assert {path.name for path in figures.iterdir()} == {"a.pdf", "a.png", "b.pdf", "b.png"}
    assert {path.name for path in tables.iterdir()} == {"n.md", "n.csv", "n.tex"}


def run(monkeypatch, *arguments):
    monkeypatch.setattr("sys.argv", ["paper_figures", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        run_main(main)
    return end.value.code


def test_the_command_writes_the_caption(tmp_path, examples, monkeypatch):
    path = tmp_path / "examples.json"
    path.write_text(json.dumps(examples), encoding="utf-8")
    assert run(monkeypatch, "figure-3", path, "--out", tmp_path / "mine.pdf") == 0
    assert (tmp_path / "mine.md").read_text(encoding="utf-8") == caption("figure-3", [path])


@pytest.mark.parametrize("arguments", [[], ["--leave-out"]])
def test_a_figure_without_its_results(arguments, tmp_path, monkeypatch, capsys):
    path = tmp_path / "studies" / "model_comparison.json"
    status = run(monkeypatch, "figure-learning-curves", path, "--out", tmp_path / "a.pdf", *arguments)
    output = capsys.readouterr()
    assert (status, "model_comparison.json' not found" in output.out + output.err) == (0 if arguments else 2, True)
    assert output.out.startswith("figure-learning-curves is left out: ") == bool(arguments)


def test_an_unknown_figure_is_refused(tmp_path, monkeypatch, capsys):
    assert run(monkeypatch, "figure-0", tmp_path, "--out", tmp_path / "a.pdf") == 2
    assert "received 'figure-0'" in capsys.readouterr().err


def test_learning_curves_of_published_models():
    assert figure_learning_curves.compose(comparison(["M1-concat", "M4-gated"])).axes[len(PAPER_FAMILIES) + 3].lines
    with pytest.raises(FileNotFoundError, match="no FiLM or gated model is published; `make models` trains them"):
        figure_learning_curves.compose(comparison(["M1-concat", "M2-concat"]))

"""Every figure has a caption beside it, which names the data it was drawn from."""

import json
import subprocess
import sys

import pytest

from paper_figures.__main__ import caption, modules, save
from paper_figures.style import drawing
from paper_figures.style.writing import Table
from tests.processes import ROOT

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


def test_the_command_writes_the_caption(tmp_path, examples):
    path = tmp_path / "examples.json"
    path.write_text(json.dumps(examples), encoding="utf-8")
    command = [sys.executable, "-m", "paper_figures", "figure-3", "--results", str(tmp_path)]
    subprocess.run([*command, "--dataset-examples", str(path)], cwd=ROOT, check=True)
    written = (tmp_path / "figures" / "figure-3.md").read_text(encoding="utf-8")
    assert written == caption("figure-3", [path])

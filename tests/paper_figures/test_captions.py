"""Every figure has a caption beside it, which names the data it was drawn from."""

import tomllib

import pytest

from paper_figures.__main__ import CAPTIONS, caption, modules, save
from paper_figures.style import drawing

FIGURES = [name for name, module in modules().items() if not module.startswith("paper_figures.tables.")]


def test_every_figure_has_a_caption_and_no_caption_is_without_figure():
    assert set(tomllib.loads(CAPTIONS.read_text(encoding="utf-8"))) == set(FIGURES)


@pytest.mark.parametrize("name", FIGURES)
def test_a_caption_says_what_is_shown_and_what_differs(name, tmp_path):
    text = caption(name, [tmp_path / "some.json"])
    assert text.startswith("# ")
    for part in ("**Shown.** ", "**Data.** ", "**Different from the paper.** "):
        assert len(text.split(part)[1].split("\n\n")[0]) > 20
    assert str(tmp_path / "some.json") in text
    assert f"`python -m paper_figures {name}`" in text


def test_the_caption_lies_beside_the_figure(tmp_path):
    save(drawing.figure(height=2.0), "figure-1", tmp_path / "figures", tmp_path / "tables", [tmp_path / "data.json"])
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {"figure-1.pdf", "figure-1.png", "figure-1.md"}

"""The worked page on effects is run as it stands."""

import doctest
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "effects.md"


def test_every_example_of_the_page_holds():
    found = doctest.testfile(str(PAGE), module_relative=False)
    assert found.attempted > 10
    assert found.failed == 0


def test_picture_of_the_page_is_there():
    assert (PAGE.parent / "images" / "figure-effects.png").is_file()
    assert "images/figure-effects.png" in PAGE.read_text(encoding="utf-8")

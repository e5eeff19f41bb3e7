"""The worked pages on effects and on cost are run as they stand."""

import doctest
import re
from pathlib import Path

import pytest

import bem
from tests.processes import ROOT

PAGE = ROOT / "docs" / "effects.md"
COST = PAGE.with_name("cost.md")


def test_the_files_the_page_names_are_there():
    home = Path(bem.__file__).parent
    here = {path.stem for path in home.rglob("*.py")}
    named = set(re.findall(r"`(\w+)\.py`", PAGE.read_text(encoding="utf-8")))
    assert len(named) >= 8
    assert named <= here


@pytest.mark.parametrize(("page", "least"), [(PAGE, 10), (COST, 4)])
def test_every_example_of_the_page_holds(page, least):
    found = doctest.testfile(str(page), module_relative=False)
    assert found.attempted > least
    assert found.failed == 0


def test_picture_of_the_page_is_there():
    assert (PAGE.parent / "images" / "figure-effects.png").is_file()
    assert "images/figure-effects.png" in PAGE.read_text(encoding="utf-8")

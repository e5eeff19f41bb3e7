"""A figure or table whose result file is missing names the command that makes it."""

from pathlib import Path

import pytest

from experiments.places import Places
from experiments.registry import entries
from paper_figures.__main__ import modules
from tests.paper_figures.results import arguments_of

SHOWN = [entry for entry in entries() if entry.kind in ("paper", "cost")]


@pytest.mark.parametrize("entry", SHOWN, ids=lambda entry: entry.name)
def test_a_missing_result_names_the_command_that_makes_it(entry, tmp_path):
    places = Places(tmp_path, tmp_path / "published")
    for name in set(entry.reads) - entry.optional - {"dataset", "more-models"}:
        with pytest.raises(FileNotFoundError, match=r"`make ([\w-]+)` makes it") as raised:
            places.read(name, f"make {entry.name}")
        study = "studies" in str(raised.value)
        assert (f"`make {entry.name}`" in str(raised.value)) == study
        assert study == (Path(places.path(name)).parent == tmp_path / "studies")


@pytest.mark.parametrize("entry", SHOWN, ids=lambda entry: entry.name)
def test_a_line_of_the_makefile_reads_what_its_module_asks_for(entry):
    asked = arguments_of(modules()[entry.name])
    assert asked.keys() == set(entry.reads) - {"more-models"}
    assert {name for name, optional in asked.items() if optional} == entry.optional - {"more-models"}


def test_every_figure_has_a_line():
    assert modules().keys() - {entry.name for entry in SHOWN} == {"figure-own-architecture"}

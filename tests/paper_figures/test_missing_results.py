"""A figure or table whose result file is missing names the command that makes it."""

import inspect
from importlib import import_module

import pytest

from experiments.places import FOLDERS, Places
from paper_figures.__main__ import modules

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


def test_a_result_that_no_module_makes_is_to_be_restored(tmp_path):
    with pytest.raises(FileNotFoundError, match="restore it from the repository"):
        Places(tmp_path, tmp_path).read("step_length", "docs-numbers")

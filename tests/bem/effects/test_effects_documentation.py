"""The worked pages on effects and on cost are run as they stand, and say of files what a run of them finds."""

import doctest
import re
from pathlib import Path

import pytest

import bem
from bem import Elastic, HardContact, Scene, StandardLinearSolid
from experiments.effects.files import code_of, functions_of, lines_of, shared_files

PAGE = Path(__file__).parents[3] / "docs" / "effects.md"
COST = PAGE.with_name("cost.md")
SLS = StandardLinearSolid(0.1)
SCENES = {
    "hertz": Scene(1.5, Elastic(), HardContact()),
    "adhesion": Scene(1.5),
    "memory": Scene(1.5, SLS),
    "memory, no adhesion": Scene(1.5, SLS, HardContact()),
    "spring": Scene(1.5, spring=5.0),
}
ADDED = {"no adhesion": ("hertz", "adhesion"), "adhesion": ("adhesion", "hertz")}
ADDED["a relaxation process"] = ("memory", "adhesion")
ADDED["a spring"] = ("spring", "adhesion")


@pytest.fixture(scope="module")
def code():
    return code_of(SCENES)


def test_the_files_the_page_names_are_there():
    home = Path(bem.__file__).parent
    here = {path.stem for path in home.rglob("*.py")}
    named = set(names(PAGE.read_text(encoding="utf-8")))
    assert len(named) > 10
    assert named <= here


def names(cell):
    return re.findall(r"`(\w+)\.py`", cell)


@pytest.mark.parametrize(("page", "least"), [(PAGE, 10), (COST, 4)])
def test_every_example_of_the_page_holds(page, least):
    found = doctest.testfile(str(page), module_relative=False)
    assert found.attempted > least
    assert found.failed == 0


@pytest.mark.slow
@pytest.mark.parametrize("effect", ADDED)
def test_the_page_names_the_files_an_effect_runs(code, effect):
    with_it, without = (code[name] for name in ADDED[effect])
    row = next(line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {effect} |"))
    _, _, own, elsewhere, *_ = row.split("|")
    files = {file for file, _ in functions_of(with_it) - functions_of(without)} - {"linear_algebra"}
    lines = {file for file, _ in lines_of(with_it) - lines_of(without)} - files - {"linear_algebra", "simulation"}
    assert names(own) == sorted(files)
    assert names(elsewhere) == sorted(lines)


@pytest.mark.slow
def test_a_relaxation_process_adds_the_same_with_and_without_adhesion(code):
    added = functions_of(code["memory"]) - functions_of(code["adhesion"])
    assert added == functions_of(code["memory, no adhesion"]) - functions_of(code["hertz"])
    # The elastic contact jumps, which the other is kept from, and only its force must be followed.
    of_jumps = {("instabilities", "smallest_eigenvalue"), ("course", "with_jump"), ("state", "influence_of")}
    elastic_only = of_jumps | {("extrapolation", "expected_force")}
    assert functions_of(code["adhesion"]) - functions_of(code["memory"]) <= elastic_only


@pytest.mark.slow
def test_the_page_names_the_files_all_scenes_run(code):
    text = PAGE.read_text(encoding="utf-8")
    paragraph = text[text.index("All scenes\n") : text.index("Beyond that")]
    assert set(names(paragraph)) <= set(shared_files(code))


def test_picture_of_the_page_is_there():
    assert (PAGE.parent / "images" / "figure-effects.png").is_file()
    assert "images/figure-effects.png" in PAGE.read_text(encoding="utf-8")

"""What the READMEs tell a stranger to type works, and prints what they say it prints."""

import re
from importlib import import_module

import pytest
from matplotlib.testing.compare import compare_images

from paper_figures.__main__ import modules
from paper_figures.style import drawing
from tests.paper_figures.inputs import read_inputs
from tests.processes import ROOT, python

README = (ROOT / "README.md").read_text(encoding="utf-8")
PICTURES = ROOT / "docs/images"
RULE = (ROOT / "Makefile").read_text(encoding="utf-8").replace("\\\n\t\t", "").partition("\nreadme-pictures:")[2]
PLOTS = re.findall(r"\$\(VENV\)/bin/(\w+) (.*--plot) docs/images/(\S+)", RULE.partition("\n\n")[0])
# A search that is cut ends elsewhere on another processor.
DRAWN = [plot for plot in PLOTS if not plot[1].startswith("fit")]
SOLVER_README = (ROOT / "bem/README.md").read_text(encoding="utf-8")


def python_examples(text):
    return re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)


def printed(examples, capsys):
    """Lines printed by examples that follow each other, as in one session."""
    session = {}
    for example in examples:
        exec(compile(example, "README.md", "exec"), session)
    return capsys.readouterr().out.splitlines()


def test_it_fits_on_one_screen():
    assert len(README.splitlines()) < 60


def test_solver_examples_print_as_stated(capsys):
    examples = python_examples(SOLVER_README)
    expected = re.findall(r"^print\(.*\)  # (.*)$", "\n".join(examples), flags=re.MULTILINE)
    assert expected
    assert printed(examples, capsys) == expected


@pytest.mark.parametrize("program", [pytest.param("bem", marks=pytest.mark.slow), "surrogate"])
def test_first_commands_answer_with_units(program, tmp_path):
    (command,) = re.findall(rf"^\.venv/bin/{program} (.*)$", README, flags=re.MULTILINE)
    done = python("-m", program, *command.split(), cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, check=True)
    assert re.search(r"^pull-off force +7\.\d+ .*pi R dgamma$", done.stdout, flags=re.MULTILINE)
    assert not list(tmp_path.iterdir())  # nobody watches


@pytest.mark.parametrize("name", ["README.md", "bem/README.md"])
def test_what_it_links_to_exists(name):
    for target in re.findall(r"\]\(([^)#:]+)\)", (ROOT / name).read_text(encoding="utf-8")):
        assert ((ROOT / name).parent / target).exists(), target


@pytest.mark.slow
@pytest.mark.parametrize(("program", "options", "name"), DRAWN)
def test_pictures_are_those_of_their_commands(program, options, name, tmp_path):
    python("-m", program, *options.split(), tmp_path / name, cwd=ROOT, check=True)
    assert compare_images(PICTURES / name, tmp_path / name, tol=2.0) is None, "make readme-pictures"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["figure-effects", "figure-accuracy-cost"])
def test_figures_of_the_guide_are_those_of_the_measurements(name, tmp_path):
    drawing.save(import_module(modules()[name]).compose(*read_inputs(name)), name, tmp_path)
    assert compare_images(PICTURES / f"{name}.png", tmp_path / f"{name}.png", tol=2.0) is None, "make readme-pictures"

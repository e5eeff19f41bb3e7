"""The guide's Python runs, its commands and make targets exist, and the site builds without a broken link."""

import fnmatch
import importlib
import os
import re
import shlex
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path

import griffe
import pytest

from tests.processes import ROOT, ended, python
from tests.surrogate.conftest import write_dataset

PAGES = sorted((ROOT / "docs").glob("*.md"))
API_PAGES = ("api-bem", "api-surrogate", "laboratory")
PUBLIC = ("bem", "bem.lab", "bem.materials_library", "surrogate")
TUTORIALS = sorted((ROOT / "docs/tutorials").glob("[0-9]*_*.py"))
EXAMPLES = [
    pytest.param(page.name, textwrap.dedent(code), id=f"{page.stem}-{number}")
    for page in PAGES
    for number, code in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL))
    if not code.startswith(">>>")  # a page of interactive examples has its printed results checked as doctests
]


@pytest.mark.parametrize(("page", "code"), EXAMPLES)
def test_the_examples_of_the_guide_run(page, code, capsys):
    exec(compile(code, page, "exec"), {})
    printed = capsys.readouterr().out
    assert "nan" not in printed
    assert "No model is adequate" not in printed


@pytest.mark.slow
def test_guide_to_own_architecture_works(tmp_path):
    page = (ROOT / "docs/train.md").read_text(encoding="utf-8")
    text = page.split("## An architecture of your own")[1].split("\n## ")[0]
    (tmp_path / "my_model.py").write_text(textwrap.dedent(re.findall(r"```python\n(.*?)```", text, re.DOTALL)[0]))
    write_dataset(tmp_path / "published.h5", 60)
    blocks = [textwrap.dedent(block) for block in re.findall(r"```console\n(.*?)```", text, re.DOTALL)]
    commands = [line for block in blocks for line in block.replace("\\\n", " ").splitlines() if line]
    assert [command.split()[0] for command in commands] == ["surrogate"] * 5 + ["python"] * 2 + ["rm"] * 2
    for command in commands:
        # A small data set instead of the published one, for an epoch.
        arguments = shlex.split(command.replace("--epochs 5", "--epochs 1"))
        if arguments[0] == "rm":
            subprocess.run(command, shell=True, cwd=tmp_path, check=True)
            continue
        program = [sys.executable, "-m", "surrogate"] if arguments[0] == "surrogate" else [sys.executable]
        arguments += ["--dataset", "published.h5"] if arguments[1] in ("train", "evaluate") else []
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        done = ended(*program, *arguments[1:], cwd=tmp_path, env=environment)
        assert done.returncode == 0, f"{command}: {done.stderr}"
    assert {path.name for path in tmp_path.rglob("*") if path.is_file()} == {"my_model.py", "published.h5"}


@pytest.mark.slow
@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: path.stem)
def test_each_tutorial_runs(tutorial, tmp_path):
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "agg", "OMP_NUM_THREADS": "1"}
    environment["TMPDIR"] = str(tmp_path)
    done = python("-W", "error::RuntimeWarning", tutorial, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr
    assert not re.search(r"\bnan\b", done.stdout)


def test_tutorials_are_listed_with_pictures():
    assert len(TUTORIALS) == 10
    for tutorial in TUTORIALS:
        code = tutorial.read_text(encoding="utf-8")
        assert re.match(r'"""\n# \w', code), "the title of the page"
        assert "plt.subplots" in code


def test_code_fits_beside_the_navigation():
    # Text between blocks of code may be wider; in a tutorial, it is a comment.
    texts = {path: re.sub(r'\A""".*?"""', "", path.read_text(encoding="utf-8"), flags=re.DOTALL) for path in TUTORIALS}
    wide = [
        f"{path.name}: {line}"
        for path, text in texts.items()
        for line in text.splitlines()
        if line[:1] != "#" and len(line) > 88
    ]
    for page in PAGES:
        for block in re.findall(
            r"^ *```\w+\n(.*?)^ *```", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
        ):
            wide += [f"{page.name}: {line}" for line in block.splitlines() if len(line) > 88]
    assert not wide


def test_the_files_it_names_exist():
    for page in PAGES:
        for path in re.findall(r"python (examples/\w+\.py)", page.read_text(encoding="utf-8")):
            assert (ROOT / path).is_file(), f"{page.name}: {path}"


def test_data_files_have_a_licence():
    table = (ROOT / "docs/index.md").read_text(encoding="utf-8").split("## Licences")[1]
    rows = [line.split(" | ") for line in table.splitlines() if line.startswith("| ") and "`" in line]
    licences = {pattern: row[1] for row in rows for pattern in re.findall(r"`([^`]+)`", row[0])}
    listed = ended("git", "ls-files", "-z", cwd=ROOT, check=True).stdout
    data = re.compile(r"\.(csv|h5|ibw|json|jpk|jpk-force-map|mplstyle|npz|onnx|png|svg|toml|txt|zip)")
    code = re.compile(r"pyproject\.toml|docs/ruff\.toml|\.devcontainer/.*|demo/[^/]*\.json|demo/src/.*|tests/.*")
    used = set()
    for path in map(Path, listed.split("\0")):
        if not data.fullmatch(path.suffix) or code.fullmatch(path.as_posix()):
            continue
        patterns = [pattern for pattern in licences if fnmatch.fnmatchcase(path.as_posix(), pattern)]
        assert len(patterns) == 1, path
        used |= {*patterns}
        if path.is_relative_to("bem/materials_library"):
            stated = tomllib.loads((ROOT / path).read_text(encoding="utf-8")).get("licence", "none stated")
            assert licences[patterns[0]] == stated
    assert used == set(licences)


def test_entries_of_the_reference_exist():
    loader = griffe.GriffeLoader(search_paths=[ROOT])
    packages = {name: loader.load(name) for name in ("bem", "surrogate")}
    for page in API_PAGES:
        text = (ROOT / f"docs/{page}.md").read_text(encoding="utf-8")
        for package, name in re.findall(r"^::: (\w+)\.(\S+)", text, flags=re.MULTILINE):
            assert packages[package][name].docstring, f"{page}: {package}.{name}"


def test_public_functions_state_returns():
    loader = griffe.GriffeLoader(search_paths=[ROOT])
    nodes = [loader.load(package) for package in ("bem", "surrogate")]
    names = {
        name
        for page in API_PAGES
        for name in re.findall(
            r"^::: (\S+)", (ROOT / f"docs/{page}.md").read_text(encoding="utf-8"), flags=re.MULTILINE
        )
    }
    silent, seen = [], 0
    while nodes:
        node = nodes.pop()
        nodes += [] if node.is_alias else [member for name, member in node.members.items() if not name.startswith("_")]
        shown = any(node.path == name or node.path.startswith(f"{name}.") for name in names)
        if node.is_alias or not node.is_function or not node.docstring or not shown:
            continue
        seen += 1
        sections = {section.kind.value for section in node.docstring.parse("google", warnings=False)}
        if "parameters" in sections and str(node.returns) != "None" and not sections & {"returns", "yields"}:
            silent.append(node.path)
    assert seen > 100
    assert not silent


@pytest.mark.slow
def test_site_builds_without_broken_links(tmp_path):
    # Tutorials that have not run yet are shown without results; `make docs` runs them.
    arguments = ("-m", "mkdocs", "build", "--config-file", ".mkdocs.yml", "--strict", "--quiet", "--site-dir", tmp_path)
    result = python(*arguments, cwd=ROOT, env=os.environ | {"RUN_TUTORIALS": "false"})
    assert result.returncode == 0, result.stdout + result.stderr
    assert "bem.simulation.simulate" in (tmp_path / "api-bem/index.html").read_text(encoding="utf-8")
    of_names = sorted((tmp_path / "api").glob("*/index.html"))
    files = [*(tmp_path / name / "index.html" for name in API_PAGES), *of_names]
    pages = "".join(file.read_text(encoding="utf-8") for file in files)
    assert "predict_history" in pages
    for package in PUBLIC:
        for name in importlib.import_module(package).__all__:
            assert re.search(rf'id="{package.split(".")[0]}\.[\w.]*\b{name}"', pages), f"{package}.{name}"
    for tutorial in TUTORIALS:
        assert (tmp_path / "gallery" / tutorial.stem / "index.html").is_file()
        assert (tmp_path / "gallery" / f"{tutorial.stem}.ipynb").is_file()
    index = (tmp_path / "gallery/index.html").read_text(encoding="utf-8")
    assert {f'href="{tutorial.stem}/"' in index for tutorial in TUTORIALS} == {True}
    assert "<blockquote" not in pages, "an example of a docstring is code, not a quotation"
    returned = [part for page in of_names for part in page.read_text(encoding="utf-8").split("Returns:</span>")[1:]]
    assert returned
    for page in of_names:
        _, *returned = page.read_text(encoding="utf-8").split("Returns:</span>")
        rows = [table.partition("</tbody>")[0].partition("<tbody>")[2].count("<tr") for table in returned]
        assert set(rows) <= {1}, "what is returned is one thing, in one row"

"""A result is made anew when a module or a file that its run used has changed, and only then."""

import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MODEL_FILES = (
    "run.json",
    "split.json",
    "recipe.toml",
    "metrics.json",
    "history.csv",
    "model.weights.h5",
    "scaling.json",
)
READ = {
    "study_a": ("bem/reference_solutions/hertz.py", "experiments/paper_values/a.csv"),
    "model_comparison": ("surrogate/data/metrics.py", "published/models/M1-FiLM/metrics.json", "published/models"),
}


@pytest.fixture
def tree(tmp_path):
    """The Makefile over two stand-in studies and figures; the runner stands in too and notes what READ says."""
    lines = (ROOT / "Makefile").read_text(encoding="utf-8").splitlines(keepends=True)
    kept = [line for line in lines if not re.match(r"[\w-]+\.(paper|cost|study|makes|publishes) :=", line)]
    registry = """study_a.study := solver
model_comparison.study := dataset models
figure-a.paper := study_a data_efficiency?  ## A figure
table-b.paper := model_comparison  ## A table
"""
    (tmp_path / "Makefile").write_text(registry + "".join(kept), encoding="utf-8")
    for name in ("M1-concat", "M1-FiLM"):
        (tmp_path / "published/models" / name).mkdir(parents=True)
        for file in MODEL_FILES:
            (tmp_path / "published/models" / name / file).touch()
    others = ("published/dataset.h5", "published/data_efficiency.json", "bem/solver/version.py", "bem/cli/app.py")
    code = ("bem/plots.py", "requirements.lock", "pyproject.toml")
    for file in (*others, *code, *(path for paths in READ.values() for path in paths)):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        if not (tmp_path / file).is_dir():
            (tmp_path / file).touch()
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/python").write_text(RUNNER, encoding="utf-8")
    (tmp_path / "bin/python").chmod(0o755)
    (tmp_path / ".installed").touch()
    return tmp_path


RUNNER = f"""#!{sys.executable}
import os, pathlib, sys, time
words = sys.argv[2:]
target = pathlib.Path(words[words.index("--depends") + 1])
name = words[1] if words[0] == "paper_figures" else words[3]
with open("ran", "a") as file:
    print(name, file=file)
used = [path for path in {READ!r}.get(name, ()) if os.path.exists(path)]
note = target.parent / ".depends" / (target.stem + ".d")
note.parent.mkdir(parents=True, exist_ok=True)
note.write_text("\\n".join([f"{{target}}: " + " ".join(used), *(path + ":" for path in used)]) + "\\n")
started = time.time() - 1e-2
os.utime(note, (started, started))
target.touch()
"""


def ran(tree, *words, goal=("figure-a", "table-b")):
    """What is run by make, once, for the figure and the table."""
    (tree / "ran").unlink(missing_ok=True)
    # File systems count time in steps; what happens next must be later than what was before.
    time.sleep(0.05)
    command = ["make", "-s", "VENV=.", *words, *goal]
    subprocess.run(command, cwd=tree, capture_output=True, text=True, check=True)
    return set((tree / "ran").read_text(encoding="utf-8").split()) if (tree / "ran").is_file() else set()


ALL = {"study_a", "model_comparison", "figure-a", "table-b"}


def test_nothing_is_made_twice(tree):
    assert ran(tree) == ALL
    assert ran(tree) == set()


@pytest.mark.parametrize(
    ("touched", "again"),
    [
        ("bem/reference_solutions/hertz.py", {"study_a", "figure-a"}),
        ("experiments/paper_values/a.csv", {"study_a", "figure-a"}),
        ("surrogate/data/metrics.py", {"model_comparison", "table-b"}),
        ("published/models/M1-FiLM/metrics.json", {"model_comparison", "table-b"}),
        ("published/data_efficiency.json", {"figure-a"}),
        ("bem/cli/app.py", set()),
        ("bem/plots.py", set()),
    ],
)
def test_touching_an_input_makes_anew_what_was_made_from_it(touched, again, tree):
    ran(tree)
    time.sleep(0.05)
    (tree / touched).touch()
    assert ran(tree) == again
    assert ran(tree) == set()


@pytest.mark.parametrize("gone", ["bem/reference_solutions/hertz.py", "published/models/M1-FiLM"])
def test_what_was_made_from_something_that_is_gone_is_made_once_more(gone, tree):
    ran(tree)
    time.sleep(0.05)
    shutil.rmtree(tree / gone) if (tree / gone).is_dir() else (tree / gone).unlink()
    assert ran(tree) == ({"study_a", "figure-a"} if gone.startswith("bem") else {"model_comparison", "table-b"})
    assert ran(tree) == set()


def test_a_result_without_its_note_is_made_anew(tree):
    ran(tree)
    (tree / "results/studies/.depends/study_a.d").unlink()
    assert ran(tree) == {"study_a", "figure-a"}


def test_a_run_notes_the_modules_and_files_that_it_used(tmp_path):
    """The smallest of the real studies, and a figure of it."""
    published = tmp_path / "published"
    (published / "measurements").mkdir(parents=True)
    shutil.copy(ROOT / "published/measurements/cost_growth.json", published / "measurements")
    target = tmp_path / "out/figures/figure-solver-scaling.pdf"
    words = ["--results", tmp_path / "out", "--published", published, "--depends", target]
    command = [sys.executable, "-m", "paper_figures", "figure-solver-scaling", *words]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    assert target.is_file()
    noted = (target.parent / ".depends/figure-solver-scaling.d").read_text(encoding="utf-8")
    rule = noted.partition(":\n")[0]
    head, _, used = rule.partition(": ")
    assert head == str(target)
    names = set(used.replace("\\\n", " ").split())
    assert {"paper_figures/measurements/figure_solver_scaling.py", "paper_figures/style/paper.mplstyle"} <= names
    assert str(published / "measurements/cost_growth.json") in names
    assert not any(name.startswith(("bem/solver", "bem/cli", "/usr", "published")) for name in names)
    assert (target.parent / ".depends/figure-solver-scaling.d").stat().st_mtime < target.stat().st_mtime


def test_paper_values_count_among_what_a_run_used(tmp_path):
    words = ["--depends", tmp_path / "x.json", "inconsistencies", "--results", tmp_path, "--out", tmp_path / "x.json"]
    subprocess.run([sys.executable, "-m", "experiments", *words], cwd=ROOT, check=True, capture_output=True)
    noted = (tmp_path / ".depends/x.d").read_text(encoding="utf-8")
    for name in ("experiments/paper_values/quartiles.csv", "bem/reference_solutions/hertz.py", "published/dataset.h5"):
        assert f" {name}" in noted
        assert f"\n{name}:" in noted
    assert "MANIFEST" not in noted
    assert f"{tmp_path}:" not in noted

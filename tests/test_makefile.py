"""Every figure and table of the paper is a target that `make help` names, and the documents name no other."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from experiments.registry import entries

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def targets():
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    listed = subprocess.run(["make", "-s", "help-all"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"^  ([a-z0-9-]+) ", listed, flags=re.MULTILINE))


def test_figures_and_tables_of_the_paper_have_targets(targets):
    wanted = {f"figure-{name}" for name in (*"1234567", "architectures", "features", "fms-transfer", "learning-curves")}
    wanted |= {f"table-{name}" for name in ("protocols-dataset", "protocols-canonical", "quartiles", "persson-brener")}
    wanted |= {
        "figure-mse-mae",
        "model-paper-recipe",
        "model-large",
        "model-budgets",
        "graphical-abstract",
        "figures",
        "tables",
        "paper",
        "report",
        "smoke",
        "paper-from-scratch",
    }
    assert wanted <= targets


def test_help_shows_first_what_rests_on_published_results_and_names_the_rest(targets):
    shown = subprocess.run(["make", "-s", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    first, *others = re.split(r"^\S.*$", shown, flags=re.MULTILINE)[2:-1]
    assert re.findall(r"^  ([a-z-]+)  ", first, flags=re.MULTILINE)[0] == "setup"
    assert len(shown.splitlines()) < 50
    assert {name for group in others for name in group.split()} | set(re.findall(r"^  (\S+)", first, re.M)) == targets


@pytest.mark.parametrize("name", ["REPRODUCING.md", "REPRODUCTION.md"])
def test_documents_name_targets_that_exist(name, targets):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert {found for words in re.findall(r"`make ([a-z0-9 -]+?)[`(]", text) for found in words.split()} <= targets


def commands(*words):
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    done = subprocess.run(["make", "-n", *words], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.replace("\\\n", "")


def test_models_beside_the_eighteen_are_trained_by_their_own_recipes_and_labels(tmp_path):
    (tmp_path / "dataset.h5").touch()
    lines = commands("more-models", f"OUT={tmp_path}/out", f"PUBLISHED={tmp_path}", "-o", f"{tmp_path}/dataset.h5")
    campaign = re.search(r"bem campaign .*--out \S+/out/dataset/extra\.h5", lines)[0]
    assert "--design paper --seed 1 --count 112050" in campaign
    trained = {
        label: " ".join(rest.split(" --dataset")[0].split())
        for label, rest in re.findall(r"surrogate train M1-concat --label (\S+) (.*)", lines)
    }
    assert trained == {
        "M1-concat-paper": "--recipe paper",
        "M1-concat-8-epochs": "--recipe swift --epochs 8",
        "M1-concat-15-epochs": "--recipe swift --epochs 15",
        "M1-concat-60-epochs": "--recipe swift --epochs 60",
        "M1-concat-inputs-C": "--recipe swift --features C",
        "M1-concat-large": f"--recipe swift --features C --extra {tmp_path}/out/dataset/extra.h5 --epochs 5",
    }


def test_another_model_is_trained_by_the_papers_recipe_under_its_own_label(tmp_path):
    lines = commands("model-paper-recipe", "MODEL=M3-FiLM", f"PUBLISHED={tmp_path}", "-o", f"{tmp_path}/dataset.h5")
    assert "surrogate train M3-FiLM --label M3-FiLM-paper --recipe paper " in " ".join(lines.split())


def test_latencies_are_listed_among_what_is_published(tmp_path):
    lines = commands("bench-surrogate", "bench-stream", f"PUBLISHED={tmp_path}")
    for name, option in (("surrogate_latency", ""), ("stream_latency", "--stream ")):
        path = f"{tmp_path}/measurements/{name}.json"
        assert f"-m experiments bench_surrogate {option}--models {tmp_path}/models --out {path}" in " ".join(
            lines.split()
        )
        assert re.search(rf"tools/manifest\.py --root {tmp_path} add {path}$", lines, flags=re.MULTILINE)


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "published/measurements").glob("*.json")))
def test_a_missing_measurement_names_a_target_that_makes_it(name, targets, tmp_path):
    path = tmp_path / "measurements" / f"{name}.json"
    command = ["make", "-s", f"PUBLISHED={tmp_path}", str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    (named,) = re.findall(r"`make ([a-z0-9-]+)`", done.stderr)
    assert named in targets
    assert f"--out {path}" in commands(named, f"PUBLISHED={tmp_path}", "-o", f"{tmp_path}/dataset.h5", "-o", str(path))


STUDIES = [entry.name for entry in entries() if entry.kind == "study"]


def test_what_the_report_and_the_figures_rest_on_looks_at_no_clock():
    studies = [ROOT / "experiments" / "paper" / f"{name}.py" for name in STUDIES]
    for path in [*studies, *(ROOT / "paper_figures").glob("*/*.py")]:
        source = path.read_text(encoding="utf-8")
        assert not re.search(r"perf_counter|process_time|\bCLOCK\b|\btimed\(|stats\.seconds", source), path.name


def test_learning_curves_are_drawn_where_a_model_with_them_is_published(tmp_path):
    def drawn(name):
        (tmp_path / "models" / name).mkdir(parents=True)
        (tmp_path / "models" / name / "run.json").touch()
        return "-m paper_figures figure-learning-curves" in commands("figures", f"PUBLISHED={tmp_path}")

    found = {name: drawn(name) for name in ("M1-concat", "M1-concat-large", "M1-concat-8-epochs", "M4-gated")}
    assert found == {"M1-concat": False, "M1-concat-large": False, "M1-concat-8-epochs": False, "M4-gated": True}


@pytest.mark.parametrize(("status", "listed"), [(0, True), (1, True), (75, True), (75, False)])
def test_what_was_published_until_then_is_listed_when_training_ends_otherwise(status, listed, tmp_path):
    """Programs stand in for Python and `surrogate`: one ends as asked, the other notes what it is asked."""
    (tmp_path / "bin").mkdir()
    train = f"mkdir -p {tmp_path}/models; exit {status}" if listed else f"exit {status}"
    for name, words in (("surrogate", train), ("python", f'echo "$@" >> {tmp_path}/noted')):
        (tmp_path / "bin" / name).write_text(f"#!/bin/sh\n{words}\n", encoding="utf-8")
        (tmp_path / "bin" / name).chmod(0o755)
    for file in (".installed", "dataset.h5"):
        (tmp_path / file).touch()
    words = [f"VENV={tmp_path}", f"PUBLISHED={tmp_path}", "-o", f"{tmp_path}/.installed"]
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    done = subprocess.run(["make", "-s", "models", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == (2 if status else 0)
    assert (f"Error {status}" in done.stderr) == (status != 0)
    noted = tmp_path / "noted"
    assert (noted.read_text(encoding="utf-8") if noted.is_file() else "") == (
        f"tools/manifest.py --root {tmp_path} add {tmp_path}/models\n" if listed else ""
    )


def test_a_part_of_the_data_set_is_not_published(tmp_path):
    def refused(*words):
        command = ["make", "-s", "require-full-dataset", *words]
        return "only all 12450" in subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stderr

    assert not refused()
    assert not refused("COUNT=5", f"PUBLISHED={tmp_path}/published")
    for published in ("published", "./published", ROOT / "published"):
        assert refused("COUNT=5", f"PUBLISHED={published}")


@pytest.mark.parametrize("name", ["OUT", "PUBLISHED"])
def test_a_folder_with_a_space_in_its_name_is_refused_in_one_sentence(name):
    found = subprocess.run(
        ["make", "-n", "table-models", f"{name}=two words"], cwd=ROOT, capture_output=True, text=True
    )
    assert found.returncode == 2
    assert found.stderr.count("\n") == 1
    assert f"{name} must be a path without spaces; received 'two words'" in found.stderr


@pytest.mark.parametrize("goal", ["figure-1", "table-models", "figures", "studies", "report"])
def test_published_files_are_read_from_a_folder_that_exists(goal):
    command = ["make", "--no-print-directory", "-n", goal, "PUBLISHED=nowhere"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (found.returncode, found.stdout, found.stderr.count("\n")) == (2, "", 1)
    assert "PUBLISHED must be a folder that exists; received 'nowhere'" in found.stderr


def test_setting_up_says_what_it_does_before_it_takes_minutes(tmp_path):
    """A program stands in for Python and for `bem`: it makes an environment of itself, and says what pip is asked."""
    python = tmp_path / "python"
    copies = 'mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && cp "$0" "$3/bin/bem"'
    words = f'[ "$2" != venv ] || {{ {copies}; }}; [ "$2" != pip ] || echo "$@"'
    python.write_text(f"#!/bin/sh\n{words}\n", encoding="utf-8")
    python.chmod(0o755)
    command = ["make", "--no-print-directory", "setup", f"VENV={tmp_path}/venv", f"PYTHON={python}"]
    first, *rest = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    assert first.startswith(f"Installing the locked packages into {tmp_path}/venv: about 3 GB on disk, 3 to 10 minutes")
    assert rest[0].startswith("-m pip install --disable-pip-version-check --require-hashes")  # which shows its progress
    assert rest[-2] == "Compiling the solver for this processor: about a minute"
    assert re.fullmatch(rf"{tmp_path}/venv is ready, \S+", rest[-1])


def test_a_small_installation_leaves_out_what_needs_keras_and_grows_when_asked(tmp_path):
    """A program stands in for Python and for `bem`, as above."""
    python = tmp_path / "python"
    copies = 'mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && cp "$0" "$3/bin/bem"'
    words = f'[ "$2" != venv ] || {{ {copies}; }}; [ "$2" != pip ] || echo "$@"'
    python.write_text(f"#!/bin/sh\n{words}\n", encoding="utf-8")
    python.chmod(0o755)

    def run(*targets):
        command = ["make", "--no-print-directory", *targets, f"VENV={tmp_path}/venv", f"PYTHON={python}"]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout

    def refused(*targets):
        with pytest.raises(subprocess.CalledProcessError) as caught:
            run(*targets)
        return caught.value.stderr

    small = run("setup-small")
    assert "about 1 GB" in small
    assert f"--constraint {tmp_path}/venv/versions.txt --editable .[tables]" in small
    versions = (tmp_path / "venv" / "versions.txt").read_text(encoding="utf-8")
    assert re.search(r"^numpy==\d", versions, flags=re.MULTILINE)
    assert "hash" not in versions
    assert "figure-4 figure-architectures are left out" in run("-n", "figures", f"OUT={tmp_path}/out")
    for goal in ("figure-4", "report"):
        assert f"{goal} needs Keras" in refused("-n", goal)
    assert "--require-hashes" not in run("setup-small")
    # A newer Python, which has no full installation, keeps the small one.
    own = tmp_path / "venv" / "bin" / "python"
    own.write_text('#!/bin/sh\n[ "$1" != -c ]\n', encoding="utf-8")
    assert "make setup needs Python 3.11 or 3.12" in refused("setup")
    assert "are left out" in run("-n", "figures", f"OUT={tmp_path}/out")
    shutil.copy(python, own)
    assert "--require-hashes" in run("setup")
    assert "are left out: they are drawn" not in run("-n", "figures", f"OUT={tmp_path}/out")

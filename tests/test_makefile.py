"""Every figure and table of the paper is a target that `make help` names, and the documents name no other."""

import os
import re
import shutil
import subprocess
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def targets():
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    listed = subprocess.run(["make", "-s", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
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


def test_latencies_are_listed_among_what_is_published(tmp_path):
    lines = commands("bench-surrogate", "bench-stream", f"PUBLISHED={tmp_path}")
    for name, option in (("surrogate_latency", ""), ("stream_latency", "--stream ")):
        path = f"{tmp_path}/measurements/{name}.json"
        assert f"-m experiments.cost.bench_surrogate {option}--models {tmp_path}/models --out {path}" in lines
        assert re.search(rf"tools/manifest\.py --root {tmp_path} add {path}$", lines, flags=re.MULTILINE)


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "published/measurements").glob("*.json")))
def test_a_missing_measurement_names_a_target_that_makes_it(name, targets, tmp_path):
    path = tmp_path / "measurements" / f"{name}.json"
    command = ["make", "-s", f"PUBLISHED={tmp_path}", str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    (named,) = re.findall(r"`make ([a-z0-9-]+)`", done.stderr)
    assert named in targets
    assert f"--out {path}" in commands(named, f"PUBLISHED={tmp_path}", "-o", f"{tmp_path}/dataset.h5", "-o", str(path))


STUDIES = (
    "canonical_regimes",
    "persson_brener",
    "error_statistics",
    "fms_transfer",
    "model_comparison",
    "architecture_graphs",
    "adopted_settings",
    "paper_slips",
)


@pytest.mark.parametrize(
    ("touched", "studies"),
    [
        ("published/models/M1-concat/test_errors.csv", {"error_statistics"}),
        ("published/models/M1-concat/split.json", {"error_statistics", "fms_transfer", "model_comparison"}),
        ("published/models/M1-concat/history.csv", {"model_comparison"}),
        ("surrogate/data/metrics.py", {"canonical_regimes", "persson_brener", "fms_transfer", "architecture_graphs"}),
        ("surrogate/cli/app.py", set()),
        ("surrogate/training/torch_lstm.py", set()),
        ("experiments/paper_values/canonical_protocols.csv", {"canonical_regimes", "fms_transfer", "paper_slips"}),
        ("published/measurements/canonical_times.json", {"canonical_regimes"}),
        ("README.md", set()),
    ],
)
def test_touching_an_input_redoes_what_reads_it(touched, studies, tmp_path):
    assert redone(tmp_path, touched) - {"architecture_graphs", "adopted_settings"} == studies - {"architecture_graphs"}


def test_what_the_report_and_the_figures_rest_on_looks_at_no_clock():
    studies = [ROOT / "experiments" / f"{name}.py" for name in (*STUDIES, "dataset_examples", "dataset_statistics")]
    for path in [*studies, *(ROOT / "paper_figures").glob("*.py")]:
        source = path.read_text(encoding="utf-8")
        assert not re.search(r"perf_counter|process_time|\bCLOCK\b|\btimed\(|stats\.seconds", source), path.name


@pytest.mark.parametrize("name", ["measurement", "protocol", "reference_solutions/dmt", "reference_solutions/jkr"])
def test_touching_what_carries_out_a_setting_reads_the_settings_anew(name, tmp_path):
    assert "adopted_settings" in redone(tmp_path, f"bem/{name}.py")


def redone(folder, touched):
    """Studies that are up to date, but for an input that is touched."""
    (folder / "studies").mkdir()
    future = time.time() + 1e6
    for name in STUDIES:
        path = folder / "studies" / f"{name}.json"
        path.touch()
        os.utime(path, (future, future))
    return set(re.findall(r"-m experiments\.(\w+) ", commands("studies", f"OUT={folder}", "-W", touched)))


@pytest.fixture
def tree(tmp_path):
    """Results and figures that are younger than all they are made from: two models and two studies that train."""
    folder = tmp_path / "published" / "models"
    for name in ("M1-concat", "M1-FiLM"):
        (folder / name).mkdir(parents=True)
        for file in ("run.json", "split.json", "recipe.toml", "model.weights.h5", "scaling.json"):
            (folder / name / file).touch()
    for file in ("dataset.h5", "feature_sets.json", "data_efficiency.json"):
        (tmp_path / "published" / file).touch()
    results = [f"studies/{name}.json" for name in STUDIES]
    for path in [*results, "figures/figure-5.pdf", "figures/figure-features.pdf"]:
        (tmp_path / "out" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "out" / path).touch()
    return tmp_path


def made(tree):
    """Modules that the comparison and two figures would run, which then are made."""
    paths = [tree / "out" / path for path in ("studies/model_comparison.json", "figures/figure-5.pdf")]
    paths.append(tree / "out" / "figures/figure-features.pdf")
    lines = commands(*map(str, paths), f"OUT={tree}/out", f"PUBLISHED={tree}/published")
    for path in paths:
        path.touch()
    # File systems count time in steps; what happens next must be later than this.
    time.sleep(0.05)
    return set(re.findall(r"-m (?:experiments|paper_figures)\.(\w+) ", lines))


def test_what_shows_a_model_is_made_once_when_the_model_goes(tree):
    assert made(tree) == set()
    shutil.rmtree(tree / "published" / "models" / "M1-FiLM")
    assert made(tree) == {"model_comparison", "figure_5"}
    assert made(tree) == set()


def test_what_shows_a_study_is_made_once_when_the_study_goes(tree):
    (tree / "published" / "data_efficiency.json").unlink()
    assert made(tree) == {"figure_5", "figure_features"}
    assert made(tree) == set()


def test_learning_curves_are_drawn_where_a_model_with_them_is_published(tmp_path):
    def drawn(name):
        (tmp_path / "models" / name).mkdir(parents=True)
        (tmp_path / "models" / name / "run.json").touch()
        return "-m paper_figures.figures.figure_learning_curves" in commands("figures", f"PUBLISHED={tmp_path}")

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
        command = ["make", "-s", "only-all-is-published", *words]
        return "only all 12450" in subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stderr

    assert not refused()
    assert not refused("COUNT=5", f"PUBLISHED={tmp_path}/published")
    for published in ("published", "./published", ROOT / "published"):
        assert refused("COUNT=5", f"PUBLISHED={published}")


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

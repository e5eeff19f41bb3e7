import importlib.util
import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from surrogate.architectures.naming import names
from surrogate.cli import app as cli
from surrogate.data.dataset import TrajectoryDataset
from surrogate.training.queue import STOPPED, run_queue
from surrogate.training.recipe import Recipe
from tests.surrogate.conftest import trained_as

runner = CliRunner()

FAST = 'name = "fast"\nseed = 0\nbatch_size = 24\nepochs = 2\nlearning_rate = 1e-3\n'


@pytest.fixture
def options(dataset_path, tmp_path):
    (tmp_path / "fast.toml").write_text(FAST)
    pairs = {"recipe": tmp_path / "fast.toml", "dataset": dataset_path, "runs": tmp_path / "runs"}
    flags = [[f"--{name}", str(value)] for name, value in (pairs | {"models": tmp_path / "models"}).items()]
    return [word for flag in flags for word in flag]


@pytest.fixture(autouse=True)
def default_signals(monkeypatch):
    monkeypatch.setattr("surrogate.training.queue.signal.signal", lambda *_: None)


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """Only what a test puts there is published, or packaged."""
    for place in ("PUBLISHED", "PACKAGED"):
        monkeypatch.setattr(f"surrogate.prediction.files.{place}", tmp_path / place)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def publish_metrics(folder, mse, **run):
    folder.mkdir(parents=True)
    test = {"mse": {"mean": mse, "median": 0.0}}
    test |= {
        "pull_off_force_percent": {"median": 2.5, "mean": 9.0},
        "hysteresis_percent": {"median": 1.25, "mean": 9.0},
    }
    (folder / "metrics.json").write_text(json.dumps({"parameters": 489473, "test": test}))
    (folder / "run.json").write_text(json.dumps(run))
    (folder / "model.weights.h5").touch()


def test_list_shows_every_published_model_best_first_then_what_is_not_trained(elsewhere):
    trained = {"features": "D", "epochs": 30, "training_trajectories": 9960}
    publish_metrics(elsewhere / "PACKAGED" / "M1-FiLM", 2e-5, architecture="M1-FiLM", **trained)
    publish_metrics(elsewhere / "PUBLISHED" / "mine", 1e-5, architecture="M1-FiLM", **trained | {"features": "C"})
    publish_metrics(elsewhere / "PUBLISHED" / "M1-concat", 3e-5)
    publish_metrics(elsewhere / "PACKAGED" / "M1-concat", 4e-5)
    (elsewhere / "PUBLISHED" / "M1-concat" / "model.weights.h5").unlink()
    (elsewhere / "model_forces.json").write_text(json.dumps({"others": ["M1-FiLM"]}))
    result = runner.invoke(cli.app, ["list"])
    assert result.exit_code == 0
    lines = result.output.splitlines()
    assert lines[1:6] == [
        "model      parameters  held-out MSE  median pull-off error  median hysteresis error  training",
        "mine          489,473      1.00e-05                 2.50 %                   1.25 %  M1-FiLM, inputs C, "
        "30 epochs of 9,960 trajectories",
        "M1-FiLM       489,473      2.00e-05                 2.50 %                   1.25 %  "
        "30 epochs of 9,960 trajectories, an earlier data set's forces",
        "M1-concat     489,473      3.00e-05                 2.50 %                   1.25 %  errors only, no weights",
        "M1-gated      144,899                                                                not trained",
    ]
    (elsewhere / "PUBLISHED").rename(elsewhere / "other")  # as in an installation from a wheel
    listed = runner.invoke(cli.app, ["list"]).output
    assert "in published/models of the repository, not in this installation" in listed
    assert "not trained" not in listed
    assert [line.split()[0] for line in lines[2:-2]] == ["mine", "M1-FiLM", "M1-concat", *names()[2:]]
    assert lines[-2].startswith("Predicts here: onnxruntime ")
    assert "?" not in result.output


@pytest.mark.parametrize(
    ("missing", "predicts", "trains"),
    [
        ((), r"onnxruntime [\d.]+", r"keras [\d.]+ on tensorflow [\d.]+"),
        (
            ("keras",),
            r"onnxruntime [\d.]+",
            r"nothing, because Keras and .*; install .*\[train\]'` in a clone of the repository",
        ),
        (
            ("tensorflow",),
            r"onnxruntime [\d.]+",
            r"nothing, because tensorflow, the backend of keras [\d.]+, is not installed; .*",
        ),
        (("onnxruntime", "keras"), "nothing, because onnxruntime is not installed", "nothing, because Keras .*"),
    ],
)
def test_list_says_what_is_installed_and_needs_none_of_it(missing, predicts, trains, elsewhere, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name in missing else find(name))
    monkeypatch.setenv("KERAS_BACKEND", "tensorflow")
    lines = runner.invoke(cli.app, ["list"]).output.splitlines()
    assert lines[0] == "No model is published here."
    assert re.fullmatch(f"Predicts here: {predicts}", lines[-2])
    assert re.fullmatch(f"Trains here: {trains}", lines[-1])
    assert len(lines) == 18 + 4


def test_train_stop_resume_evaluate(least, options, tmp_path, monkeypatch):
    monkeypatch.setattr("sys.argv", ["surrogate", "train", "M1-concat", "--threads", "1"])
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "STOP").touch()
    result = runner.invoke(cli.app, ["train", "M1-concat", *options])
    assert result.exit_code == STOPPED
    assert "stopped after epoch 1" in result.output
    (tmp_path / "runs" / "STOP").unlink()
    result = runner.invoke(cli.app, ["train", "M1-concat", *options])
    assert result.exit_code == 0, result.output
    assert "epoch 2/2" in result.output
    run = json.loads((tmp_path / "models" / "M1-concat" / "run.json").read_text())
    assert run["command"] == "surrogate train M1-concat --threads 1"

    again = runner.invoke(cli.app, ["train-all", "--only", "M1-concat", *options])
    assert "0 of 1 models to train" in again.output

    # A model trained otherwise neither takes its place nor is it trained first.
    refused = runner.invoke(cli.app, ["train", "M1-concat", *options, "--epochs", "1"])
    assert "Expected --label with another name, or --replace" in str(refused.exception)
    assert json.loads((tmp_path / "models" / "M1-concat" / "run.json").read_text()) == run

    errors = tmp_path / "errors.csv"
    result = runner.invoke(cli.app, ["evaluate", "M1-concat", *options[2:4], *options[6:], "--errors", str(errors)])
    assert result.exit_code == 0, result.output
    assert "hysteresis_percent" in result.output
    assert result.output.endswith(f"Written: {errors}\n")
    again = runner.invoke(cli.app, ["evaluate", "M1-concat", *options[2:4], *options[6:], "--errors", str(tmp_path)])
    assert "a directory that exists" in str(again.exception)
    (tmp_path / "models" / "M2-FiLM").mkdir()
    (tmp_path / "models" / "M2-FiLM" / "metrics.json").write_bytes(b"\xff")
    listed = runner.invoke(cli.app, ["list", *options[6:]])
    assert "metrics.json that `surrogate train` wrote" in str(listed.exception)
    assert errors.read_bytes() == (tmp_path / "models" / "M1-concat" / "test_errors.csv").read_bytes()


@pytest.mark.parametrize(
    "options", [["--features", "A"], ["--fraction", "0.5"], ["--split-seed", "1"], ["--extra", "x"]]
)
def test_a_training_with_other_options_needs_a_label(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = runner.invoke(cli.app, ["train", "M1-concat", *options])
    assert isinstance(result.exception, ValueError)
    assert str(result.exception).startswith(f"Expected --label with {options[0]}, because published/models/M1-concat ")
    for allowed in (["--label", "mine"], ["--models", "elsewhere"]):
        result = runner.invoke(cli.app, ["train", "M1-concat", *options, *allowed])
        # There is no data set here.
        assert isinstance(result.exception, FileNotFoundError)


def test_queue_runs_what_is_missing_and_reports_failures(options, tmp_path, monkeypatch):
    asked = {}

    def fake_queue(waiting, command, **_):
        asked.update({name: command(name) for name in waiting})
        return dict.fromkeys(waiting, 0)

    monkeypatch.setattr(cli, "run_queue", fake_queue)
    data = TrajectoryDataset.load(tmp_path / options[3])
    recipe = Recipe.load(tmp_path / "fast.toml").with_overrides(epochs=7)
    trained_as(tmp_path / "models" / "M1-FiLM", data, recipe)
    trained_as(tmp_path / "models" / "M2-FiLM", data, recipe, dataset_sha256="0" * 64)
    trained_as(tmp_path / "models" / "M3-FiLM", data, recipe.with_overrides(epochs=8))
    trained_as(tmp_path / "models" / "M4-FiLM", data, recipe)
    (tmp_path / "models" / "M4-FiLM" / "run.json").write_bytes(b"\xff")
    result = runner.invoke(cli.app, ["train-all", *options, "--epochs", "7"])
    assert result.exit_code == 0, result.output
    assert len(asked) == 17
    assert "M1-FiLM" not in asked
    for line in (
        "M2-FiLM: outdated, of another data set; it is trained again",
        "M3-FiLM: outdated, of another recipe; it is trained again",
        "M4-FiLM: outdated, which does not say how it was trained; it is trained again",
    ):
        assert line in result.output.splitlines()
    assert asked["M1-concat"][:2] == ["train", "M1-concat"]
    assert " --epochs 7 --threads 1" in " ".join(asked["M1-concat"])

    asked.clear()
    trained_as(tmp_path / "models" / "M1-gated-paper", data, recipe, architecture="M1-gated")
    result = runner.invoke(cli.app, ["train-all", *options, "--epochs", "7", "--suffix", "-paper"])
    assert result.exit_code == 0, result.output
    assert len(asked) == 17
    assert "M1-gated-paper" not in asked
    assert asked["M1-FiLM-paper"][:2] == ["train", "M1-FiLM"]
    assert " --label M1-FiLM-paper " in " ".join(asked["M1-FiLM-paper"])
    refused = runner.invoke(cli.app, ["train-all", *options, "--suffix", "/../x"])
    assert "a name to publish under" in str(refused.exception)


def test_the_published_models_are_of_the_published_data_set(tmp_path, monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[3])
    monkeypatch.setattr(cli, "run_queue", lambda waiting, *_, **__: dict.fromkeys(waiting, 0))
    published = [name for name in names() if Path("published/models", name, "run.json").exists()]
    chosen = [word for name in published for word in ("--only", name)]
    result = runner.invoke(cli.app, ["train-all", *chosen, "--runs", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "another data set" not in result.output


def test_queue_processes(tmp_path):
    lines = []
    ended = run_queue(
        ["unknown-1", "unknown-2"],
        lambda name: ["train", name],
        folder=tmp_path,
        jobs=2,
        log=lines.append,
        poll_seconds=0.05,
    )
    assert ended == {"unknown-1": 2, "unknown-2": 2}
    assert "M6-gated" in (tmp_path / "unknown-2" / "log.txt").read_text()
    assert sum("failed" in line for line in lines) == 2
    (tmp_path / "STOP").touch()
    assert run_queue(["x"], lambda name: [name], folder=tmp_path, jobs=1, log=lines.append) == {}


def test_a_process_told_to_stop_before_it_listens_is_to_be_resumed(tmp_path):
    lines = []

    def log(line):
        lines.append(line)
        (tmp_path / "STOP").touch()

    ended = run_queue(["M1"], lambda name: ["train", name], folder=tmp_path, jobs=1, log=log, poll_seconds=0.05)
    assert ended == {"M1": STOPPED}
    assert lines[-1] == "M1: stopped, to be resumed"


def test_a_stop_taken_back_and_asked_for_again_reaches_what_started_between(tmp_path):
    stop = tmp_path / "STOP"

    def log(line):
        if line.startswith("first: stopped"):
            stop.unlink()
        elif "started" in line:
            stop.touch()

    ended = run_queue(["first", "second"], lambda _: ["list"], folder=tmp_path, jobs=1, log=log, poll_seconds=0.01)
    assert ended == {"first": STOPPED, "second": STOPPED}

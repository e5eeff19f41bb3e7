import importlib.util
import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from surrogate.architectures.naming import names
from surrogate.cli import app as cli
from surrogate.data.dataset import TrajectoryDataset
from surrogate.training.identity import Run, trained_otherwise
from surrogate.training.recipe import Recipe
from surrogate.training.stopping import STOPPED

runner = CliRunner()
PUBLISHED = Path(__file__).parents[3] / "published"

FAST = 'name = "fast"\nseed = 0\nbatch_size = 24\nepochs = 2\nlearning_rate = 1e-3\n'


@pytest.fixture
def options(dataset_path, tmp_path):
    (tmp_path / "fast.toml").write_text(FAST)
    pairs = {"recipe": tmp_path / "fast.toml", "dataset": dataset_path, "runs": tmp_path / "runs"}
    flags = [[f"--{name}", str(value)] for name, value in (pairs | {"models": tmp_path / "models"}).items()]
    return [word for flag in flags for word in flag]


@pytest.fixture(autouse=True)
def default_signals(monkeypatch):
    monkeypatch.setattr("surrogate.training.stopping.signal.signal", lambda *_: None)


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """Only what a test puts there is published, or packaged."""
    for place in ("PUBLISHED", "PACKAGED"):
        monkeypatch.setattr(f"surrogate.files.{place}", tmp_path / place)
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


def test_list_orders_models_by_error(elsewhere):
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
def test_list_says_what_is_installed(missing, predicts, trains, elsewhere, monkeypatch):
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

    again = runner.invoke(cli.app, ["train", "M1-concat", *options])
    assert "M1-concat: already published" in again.output

    # A model trained otherwise neither takes its place nor is it trained first.
    refused = runner.invoke(cli.app, ["train", "M1-concat", *options, "--epochs", "1"])
    assert "out must be a path without a model (--label NAME), or replace must be true" in str(refused.exception)
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
    assert "metrics.json must be one that `surrogate train` wrote" in str(listed.exception)
    assert errors.read_bytes() == (tmp_path / "models" / "M1-concat" / "test_errors.csv").read_bytes()


@pytest.mark.parametrize(
    "options", [["--features", "A"], ["--fraction", "0.5"], ["--split-seed", "1"], ["--extra", "x"]]
)
def test_other_options_need_a_label(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = runner.invoke(cli.app, ["train", "M1-concat", *options])
    assert isinstance(result.exception, ValueError)
    assert str(result.exception).startswith(
        f"--label must be given with {options[0]}, because published/models/M1-concat "
    )
    for allowed in (["--label", "mine"], ["--models", "elsewhere"]):
        result = runner.invoke(cli.app, ["train", "M1-concat", *options, *allowed])
        # There is no data set here.
        assert isinstance(result.exception, FileNotFoundError)


def test_published_models_fit_the_data_set():
    data, recipe = TrajectoryDataset.load(PUBLISHED / "dataset.h5"), Recipe.load("swift")
    published = [name for name in names() if (PUBLISHED / "models" / name / "run.json").exists()]
    assert published
    for name in published:
        wanted = Run(name, data, data.split(), recipe).identity
        assert "data set" not in trained_otherwise(PUBLISHED / "models" / name, wanted)

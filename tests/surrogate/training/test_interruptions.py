"""A training that is stopped or killed goes on with the same command and ends as an undisturbed one."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from typer.testing import CliRunner

from surrogate.cli.app import app
from surrogate.training.stopping import STOPPED, stop_request
from tests.processes import ROOT
from tests.surrogate.conftest import build_by, build_least
from tests.surrogate.training import short_runs

EPOCHS = 6
RECIPE = f"""
name = "short"
seed = 0
batch_size = 12
epochs = {EPOCHS}
learning_rate = 1e-3
weight_average = 0.1
[cosine]
warmup_epochs = 1
"""


def words(folder, dataset_path, recipe=RECIPE):
    (folder / "recipe.toml").write_text(recipe)
    options = {
        "recipe": folder / "recipe.toml",
        "dataset": dataset_path,
        "runs": folder / "runs",
        "models": folder / "models",
    }
    return ["train", "M1-concat", *(word for name, value in options.items() for word in (f"--{name}", str(value)))]


def start(folder, dataset_path, recipe=RECIPE, **environment):
    return subprocess.Popen(
        [sys.executable, "-m", "tests.surrogate.training.training_process", *words(folder, dataset_path, recipe)],
        cwd=ROOT,
        env=os.environ | environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def train(folder, dataset_path, recipe=RECIPE):
    """The same command in this process, which has started Keras already."""
    with pytest.MonkeyPatch.context() as patch:
        build_by(patch, build_least)
        patch.setattr("surrogate.training.stopping.signal.signal", lambda *_: None)
        result = CliRunner().invoke(app, words(folder, dataset_path, recipe))
    assert result.exit_code == 0, result.output


def epochs_done(folder):
    history = folder / "runs" / "M1-concat" / "history.csv"
    return max(0, len(history.read_text().splitlines()) - 1) if history.is_file() else 0


@pytest.fixture(scope="module")
def undisturbed(dataset_path, tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    train(folder, dataset_path)
    return short_runs.weights(folder / "runs" / "M1-concat")


@pytest.mark.slow  # `test_fitting.py` ends trainings at the same instant without a process
@pytest.mark.parametrize(
    ("number", "status"),
    [(signal.SIGTERM, STOPPED), (signal.SIGKILL, -signal.SIGKILL)],
)
def test_stopped_or_killed_training_resumes(undisturbed, dataset_path, tmp_path, number, status):
    process = start(tmp_path, dataset_path, WAIT_AFTER_EPOCH="2")
    while epochs_done(tmp_path) < 2 and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(number)
    assert process.wait() == status
    assert epochs_done(tmp_path) == 2
    assert not (tmp_path / "models").exists()
    train(tmp_path, dataset_path)
    assert (tmp_path / "models" / "M1-concat" / "run.json").is_file()
    for name, value in short_runs.weights(tmp_path / "runs" / "M1-concat").items():
        np.testing.assert_array_equal(value, undisturbed[name], err_msg=name)


@pytest.fixture
def handler():
    """The handler of SIGTERM, which a test may replace."""
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("how", ["SIGTERM", "STOP"])
@pytest.mark.usefixtures("handler")
def test_signal_or_file_requests_a_stop(how, tmp_path):
    asked = stop_request(tmp_path)
    assert not asked()
    if how == "STOP":
        (tmp_path / "STOP").touch()
    else:
        signal.raise_signal(signal.SIGTERM)
    assert asked()
    assert (signal.getsignal(signal.SIGTERM) is signal.SIG_DFL) == (how == "SIGTERM")

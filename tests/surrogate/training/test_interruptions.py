"""A training that is stopped or killed goes on with the same command and ends as an undisturbed one."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from surrogate.training.queue import STOPPED

ROOT = Path(__file__).resolve().parents[3]
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


def start(folder, dataset_path, **environment):
    (folder / "recipe.toml").write_text(RECIPE)
    options = {
        "recipe": folder / "recipe.toml",
        "dataset": dataset_path,
        "runs": folder / "runs",
        "models": folder / "models",
    }
    flags = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    return subprocess.Popen(
        [sys.executable, "-m", "tests.surrogate.training.training_process", "train", "M1-concat", *flags],
        cwd=ROOT,
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def finish(process):
    output, _ = process.communicate()
    return process.returncode, output


def epochs_done(folder):
    history = folder / "runs" / "M1-concat" / "history.csv"
    return max(0, len(history.read_text().splitlines()) - 1) if history.is_file() else 0


def trained(folder):
    with np.load(folder / "runs" / "M1-concat" / "checkpoint.npz") as stored:
        return {name: stored[name] for name in stored.files if name != "state"}


@pytest.fixture(scope="module")
def undisturbed(dataset_path, tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    status, output = finish(start(folder, dataset_path))
    assert status == 0, output
    return trained(folder)


@pytest.mark.parametrize(
    ("number", "status"),
    [pytest.param(signal.SIGTERM, STOPPED, marks=pytest.mark.slow), (signal.SIGKILL, -signal.SIGKILL)],
)
def test_a_training_that_is_stopped_or_killed_resumes(undisturbed, dataset_path, tmp_path, number, status):
    process = start(tmp_path, dataset_path, WAIT_AFTER_EPOCH="2")
    while epochs_done(tmp_path) < 2 and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(number)
    assert finish(process)[0] == status
    assert epochs_done(tmp_path) == 2
    assert not (tmp_path / "models").exists()
    status, output = finish(start(tmp_path, dataset_path))
    assert status == 0, output
    assert (tmp_path / "models" / "M1-concat" / "run.json").is_file()
    for name, value in trained(tmp_path).items():
        np.testing.assert_array_equal(value, undisturbed[name], err_msg=name)

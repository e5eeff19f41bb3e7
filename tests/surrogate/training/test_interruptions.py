"""A training that is stopped or killed goes on with the same command and ends as an undisturbed one."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from bem.dataset.hdf5_arrays import arrays
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


FIT = f"""
name = "fit"
seed = 0
batch_size = 12
epochs = {EPOCHS}
learning_rate = 1e-3
loop = "fit"
[plateau]
factor = 0.5
patience = 1
minimum_rate = 1e-7
stop_after = 5
"""


def start(folder, dataset_path, recipe=RECIPE, **environment):
    (folder / "recipe.toml").write_text(recipe)
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


def published(folder):
    """The curve of a published model but for its seconds, and its weights."""
    model = folder / "models" / "M1-concat"
    with h5py.File(model / "model.weights.h5") as file:
        weights = {path: item[()] for path, item in arrays(file)}
    rows = (model / "history.csv").read_text().splitlines()
    return [row.split(",")[:5] for row in rows], weights


@pytest.mark.slow
def test_a_training_by_keras_that_is_killed_resumes(dataset_path, tmp_path):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    for folder in (whole, parts):
        folder.mkdir()
    status, output = finish(start(whole, dataset_path, FIT))
    assert status == 0, output
    process = start(parts, dataset_path, FIT, WAIT_AFTER_EPOCH="2")
    while epochs_done(parts) < 2 and process.poll() is None:
        time.sleep(0.01)
    process.kill()
    assert finish(process)[0] == -signal.SIGKILL
    status, output = finish(start(parts, dataset_path, FIT))
    assert status == 0, output
    (rows, weights), (expected_rows, expected) = published(parts), published(whole)
    assert rows == expected_rows
    for name, value in weights.items():
        np.testing.assert_array_equal(value, expected[name], err_msg=name)

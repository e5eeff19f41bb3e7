"""Model directories: their files, and their publication under one plain name.

A publication replaces a model directory only, never another file or folder. The checks run before a training starts
and need no Keras.
"""

from __future__ import annotations

import os
import reprlib
import shutil
import tempfile
from pathlib import Path

from bem._support.interruption import interrupted_afterwards
from bem._support.outputs import plain_name
from surrogate.training.stopping import STOP_FILE

MODEL_FILES = {
    "model.weights.h5": "the weights, readable under every backend",
    "model.onnx": "features, scaling and network in one graph (see `surrogate.onnx`); absent if a registered "
    "architecture has a layer that `surrogate.onnx.keras_layers` cannot express",
    "scaling.json": "statistics and ranges of the training set",
    "split.json": "seed, and trajectory indices of training, validation and test set",
    "history.csv": "one row per epoch; the seconds accumulate",
    "metrics.json": "summary of the errors on validation and test set",
    "test_errors.csv": "errors of each trajectory of the test set",
    "run.json": "recipe, versions, seconds, processor, backend, seed, command, digest of the data set",
}
"""Files of a model directory, and what they hold."""


def model_name(name: str, noun: str = "a name to publish under") -> str:
    """Return the name of a run and of its published model; `noun` says in messages what the name is.

    Raises:
        ValueError: the name is not plain, is that of the file that stops trainings, or ends in `.onnx`.
    """
    if plain_name(name, noun).upper() == STOP_FILE or name.lower().endswith(".onnx"):
        raise ValueError(f"{noun} must be another than {STOP_FILE} and *.onnx; received {reprlib.repr(name)}")
    return name


def require_place(destination: Path) -> None:
    """Check that a path can be written, and does not exist or is a model directory; nothing else is ever replaced.

    Raises:
        ValueError: the path is a file, or a folder that is not a model directory or holds other files, or lies where
            nothing can be written.
    """
    parent = Path(os.path.realpath(destination)).parent
    while not parent.exists():
        parent = parent.parent
    if not os.access(parent, os.W_OK | os.X_OK):
        raise ValueError(
            f"the folder of the model must be one that can be written; received {destination}, in {parent}"
        )
    if not os.path.lexists(destination):
        return
    if not destination.is_dir():
        raise ValueError(f"the model's path must be a new path or a model directory; received {destination}, a file")
    foreign = sorted(path.name for path in destination.iterdir() if path.name not in MODEL_FILES or not path.is_file())
    if foreign or not (destination / "run.json").is_file():
        holds = f"which holds {reprlib.repr(foreign[0])}" if foreign else "which has no run.json"
        raise ValueError(
            f"the model's path must be a new path or a model directory: move the folder away, or choose another name "
            f"with --label; received {destination}, {holds}"
        )


def publish(folder: Path, destination: Path) -> None:
    """Copy the model directory of a finished run to where `surrogate.load` finds it, completely or not at all.

    Args:
        folder: Directory of the run.
        destination: Path of the published model directory, new or that of a model that is replaced. If it is a symbolic
            link, its target is written.

    Raises:
        ValueError: the path holds something else than a model.
    """
    require_place(destination)
    target = Path(os.path.realpath(destination))
    target.parent.mkdir(parents=True, exist_ok=True)
    # A hidden name, which `surrogate list` ignores.
    with tempfile.TemporaryDirectory(prefix=".publishing-", dir=target.parent) as name:
        arriving, former = Path(name) / "arriving", Path(name) / "former"
        shutil.copytree(folder / "model", arriving)
        with interrupted_afterwards():
            if target.exists():
                target.rename(former)
            try:
                arriving.rename(target)
            except OSError:
                if former.exists():
                    former.rename(target)
                raise

"""Where a trained model is published: under one plain name, where only another model is ever replaced.

These checks come before a training starts and need no Keras.
"""

from __future__ import annotations

import os
import reprlib
import shutil
import tempfile
from pathlib import Path

from bem._support.outputs import plain_name
from surrogate.training.queue import STOP_FILE

MODEL_FILES = (
    "model.weights.h5",
    "model.onnx",
    "scaling.json",
    "split.json",
    "history.csv",
    "metrics.json",
    "test_errors.csv",
    "recipe.toml",
    "run.json",
)
"""What a training leaves in a model directory (see `surrogate.training.runs`)."""


def model_name(name: str, what: str = "a name to publish under") -> str:
    """Return a valid name of a run and its published model.

    Raises:
        ValueError: it is no plain name, asks running trainings to stop, or would be taken for an ONNX file.
    """
    if plain_name(name, what).upper() == STOP_FILE or name.lower().endswith(".onnx"):
        raise ValueError(f"Expected {what} other than {STOP_FILE} and *.onnx; received {reprlib.repr(name)}")
    return name


def require_place(destination: Path) -> None:
    """Refuse a path that holds anything but a model directory, which is never replaced.

    Raises:
        ValueError: a file is there, or a folder that holds anything a training does not write.
    """
    if not os.path.lexists(destination):
        return
    if not destination.is_dir():
        raise ValueError(f"Expected a new place for the model, or a model directory. Received: {destination}, a file")
    strange = sorted(path.name for path in destination.iterdir() if path.name not in MODEL_FILES or path.is_dir())
    if strange or not (destination / "run.json").is_file():
        holds = f"which holds {reprlib.repr(strange[0])}" if strange else "which has no run.json"
        raise ValueError(
            f"Expected a new place for the model, or a model directory. Received: {destination}, {holds}; "
            "move it away, or choose another name with --label"
        )


def publish(folder: Path, destination: Path, *, replace: bool = False) -> None:
    """Copy a finished run's model directory to where `surrogate.load` finds it, completely or not at all.

    Args:
        folder: The run's directory.
        destination: The model directory to be; where it is a link, what it leads to.
        replace: Take the place of a model that is there.

    Raises:
        ValueError: a model is there and may not be replaced, or something that is none.
    """
    require_place(destination)
    if destination.exists() and not replace:
        raise ValueError(f"Expected --replace, since {destination} is already published. Received: no --replace")
    target = Path(os.path.realpath(destination))
    target.parent.mkdir(parents=True, exist_ok=True)
    # No model has a hidden name.
    with tempfile.TemporaryDirectory(prefix=".publishing-", dir=target.parent) as name:
        arriving, former = Path(name) / "arriving", Path(name) / "former"
        shutil.copytree(folder / "model", arriving)
        if target.exists():
            target.rename(former)
        try:
            arriving.rename(target)
        except OSError:
            if former.exists():
                former.rename(target)
            raise

"""Where trained models are stored, and what a model directory must contain (`surrogate.training.runs` lists its files).

A name is looked for under `published/models` of the repository first, then under that of the working directory, then
among the models packaged with an installation, of which `M1-concat` is one.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bem._support.wording import shown
from surrogate.architectures.naming import names
from surrogate.data.scaling import Scaling

PUBLISHED = Path(__file__).resolve().parents[2] / "published" / "models"
PACKAGED = Path(__file__).resolve().parents[1] / "models"


def find_model(name: str | Path, root: str | Path | None = None) -> Path:
    """Return the model directory, or the ONNX file, a name or a path means.

    Args:
        name: A published model's name, a model directory, or an ONNX file of `surrogate export`.
        root: Where names are looked for, instead of the usual places.

    Raises:
        FileNotFoundError: nothing is there.
        ValueError: no model has that name.
    """
    path = Path(name)
    named = str(name) == path.name and path.name not in ("", "..")
    try:
        is_directory = (path / "run.json").is_file()
    except OSError as error:
        raise ValueError(f"Expected a model's name or path. Received: {shown(str(name))} ({error.strerror})") from error
    if is_directory:
        return path
    if path.suffix == ".onnx":
        if not path.is_file():
            where = "is a directory without run.json" if path.is_dir() else "does not exist"
            raise FileNotFoundError(f"Expected an ONNX file. Received: {path}, which {where}")
        return path
    roots = model_roots(root)
    for place in roots if named else ():
        if (place / path).is_dir():
            return place / path
    trained = sorted({found.parent.name for place in roots for found in place.glob("*/run.json")})
    if isinstance(name, Path) or not named:
        raise FileNotFoundError(f"Expected a model's name or directory. Received: {str(name)!r}")
    if name not in names():
        known = sorted({*names(), *trained})
        raise ValueError(f"Unknown model name. Expected one of {', '.join(known)}. Received: name={shown(name)}")
    raise FileNotFoundError(
        f"No trained {name} in {' or '.join(map(str, roots))}; train it with `surrogate train {name}`. "
        f"Trained there: {', '.join(trained) or 'none'}"
    )


def model_roots(root: str | Path | None = None) -> list[Path]:
    """Return the directories searched for a model's name, in this order."""
    if root is not None:
        return [Path(root)]
    # An installation's own training leaves its models below the working directory.
    return list(dict.fromkeys([PUBLISHED, Path("published/models").absolute(), PACKAGED]))


def existing(path: Path) -> Path:
    """Return the path of a file a model directory must hold.

    Raises:
        FileNotFoundError: it is missing.
    """
    if not path.is_file():
        raise FileNotFoundError(f"Expected a complete model directory. Missing: {path}")
    return path


def read_run(folder: Path) -> tuple[dict[str, Any], Scaling]:
    """Read what a model directory says of its training, and its scaling.

    Raises:
        FileNotFoundError: a file is missing.
        ValueError: a file is damaged, or the scaling belongs to another data set.
    """
    run_path = existing(folder / "run.json")
    scaling = Scaling.load(existing(folder / "scaling.json"))
    try:
        run = json.loads(run_path.read_text(encoding="utf-8"))
        texts = [run[name] for name in ("dataset_sha256", "features", "name", "architecture")]
        if not all(isinstance(value, str) for value in texts):
            raise TypeError("expected texts")
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"Expected a run.json that `surrogate train` wrote. Received: {run_path}") from error
    dataset, features, *_ = texts
    if scaling.dataset_sha256 != dataset or scaling.features != features:
        raise ValueError(
            f"Expected the scaling of data set {dataset[:12]} with features {shown(features)}. "
            f"Received: {folder / 'scaling.json'} of data set {scaling.dataset_sha256[:12]} "
            f"with features {scaling.features}"
        )
    return run, scaling

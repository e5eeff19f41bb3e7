"""Folders of trained models: where they are found, and what they must hold.

A name is searched for in `published/models` of the repository, then in `published/models` of the working directory,
then among the models packaged with an installation; `fast` and `accurate` in `published/pretrained` instead.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from bem._support.outputs import write_whole
from bem._support.text_files import read_json
from bem._support.wording import listed, shown
from surrogate.architectures.naming import names
from surrogate.data.scaling import Scaling
from surrogate.onnx.file import ONNX_NAME, sha256

WEIGHTS = "model.weights.h5"
STAGES = "stages.npz"
"""File of a model of any linear solid (`surrogate.solids`)."""
SUMMED = (WEIGHTS, ONNX_NAME, "scaling.json", STAGES, "intervals.npz")
"""Files whose SHA-256 sums are in `run.json`, in the entry `sha256`, with that of all else in `run.json`."""
PRETRAINED = ("fast", "accurate")
"""Names of the models that know any linear solid, and their own uncertainty."""

PUBLISHED = Path(__file__).resolve().parents[1] / "published" / "models"
PUBLISHED_PRETRAINED = PUBLISHED.with_name("pretrained")
PACKAGED = Path(__file__).resolve().parent / "models"


def find_model(name: str | Path, root: str | Path | None = None) -> Path:
    """Return the path of the model directory or ONNX file that a name or a path stands for.

    Args:
        name: Name of a published model, or path of a model directory or of an ONNX file of `surrogate export`. Text
            without a separator is a name, whatever lies in the working directory: that folder is `./NAME`.
        root: Directory to search for names, instead of those of `model_roots`.

    Raises:
        FileNotFoundError: there is no such model directory or ONNX file.
        ValueError: the name is not that of a model.
    """
    path = Path(name)
    named = str(name) == path.name and path.name not in ("", "..")
    if (path / "run.json").is_file() and (isinstance(name, Path) or not named):
        return path
    if path.suffix == ".onnx":
        if not path.is_file():
            where = "is a directory without run.json" if path.is_dir() else "does not exist"
            raise FileNotFoundError(f"name must be an ONNX file; received {path}, which {where}")
        return path
    roots = model_roots(root, pretrained=name in PRETRAINED)
    for directory in roots if named else ():
        if (directory / path).is_dir():
            return directory / path
    trained = sorted({run_file.parent.name for directory in roots for run_file in directory.glob("*/run.json")})
    if isinstance(name, Path) or not named:
        raise FileNotFoundError(
            f"name must be a model's, a directory with run.json, or an .onnx file; received {str(name)!r}"
        )
    if name not in (*names(), *PRETRAINED):
        available = listed(sorted({*names(), *trained, *PRETRAINED}), name)
        raise ValueError(f"name must be ./NAME for a folder, or one of {available}; received {shown(name)}")
    elsewhere = "" if PUBLISHED.is_dir() else "a clone of the repository has the published ones (--models FOLDER), and "
    command = "make pretrained" if name in PRETRAINED else f"surrogate train {name}"
    raise FileNotFoundError(
        f"a trained {name} must be in {' or '.join(map(str, roots))}; {elsewhere}`{command}` trains it; received a "
        f"name without a model; trained there: {', '.join(trained) or 'none'}"
    )


def model_roots(root: str | Path | None = None, *, pretrained: bool = False) -> list[Path]:
    """Return the directories that are searched for the name of a model of the paper, or of a pretrained one."""
    if root is not None:
        return [Path(root)]
    published = PUBLISHED_PRETRAINED if pretrained else PUBLISHED
    # An installed package trains models into the working directory.
    return list(dict.fromkeys([published, Path("published", published.name).absolute(), PACKAGED]))


def existing(path: Path) -> Path:
    """Return the path of a file of a model directory after checking that it exists.

    Raises:
        FileNotFoundError: the file is missing.
    """
    if not path.is_file():
        if path.name == WEIGHTS and (path.parent / "run.json").is_file():
            raise FileNotFoundError(
                f"a model must have weights; received {path.parent.name}, of which only the errors are published; "
                f"{path.parent.with_name('README.md')} says how it is trained"
            )
        raise FileNotFoundError(f"a model directory must be complete; received one without {path}")
    return path


def weights_sha256(folder: Path) -> str:
    """Return the SHA-256 sum of the weights in a model directory, which identifies one training."""
    return sha256(folder / WEIGHTS)


def write_run(folder: Path, run: dict[str, Any]) -> None:
    """Write `run.json` of a model directory, with the SHA-256 sums of the files that are read with it."""
    sums = {name: sha256(folder / name) for name in SUMMED if (folder / name).is_file()}
    record = run | {"sha256": sums}
    record["sha256"] = sums | {"run.json": _sum_of(record)}
    write_whole(folder / "run.json", json.dumps(record, indent=1) + "\n")


def read_intact(path: Path, run: dict[str, Any]) -> bytes:
    """Return the content of a file of a model directory, which must have the sum in `run.json`.

    Raises:
        FileNotFoundError: the file is missing.
        ValueError: the file is damaged, or belongs to another model.
    """
    file_bytes = existing(path).read_bytes()
    if hashlib.sha256(file_bytes).hexdigest() != run["sha256"].get(path.name):
        raise _damage(path)
    return file_bytes


def read_run(folder: Path) -> tuple[dict[str, Any], Scaling]:
    """Return the content of `run.json` of a model directory, and its scaling; errors as of `read_record`."""
    run = read_record(folder)
    scaling = folder / "scaling.json"
    return run, Scaling.from_json(read_intact(scaling, run).decode(), scaling)


def read_record(folder: Path) -> dict[str, Any]:
    """Return the content of `run.json` of a model directory.

    Raises:
        FileNotFoundError: a file is missing.
        ValueError: a file is damaged, or `run.json` has no sums.
    """
    path = existing(folder / "run.json")
    try:
        run = read_json(path)
        intact = run["sha256"].pop("run.json") == _sum_of(run)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise _damage(path) from error
    if not intact:
        raise _damage(path)
    return run


def _sum_of(run: dict[str, Any]) -> str:
    """Return the SHA-256 sum of the content of `run.json`, but for this sum itself."""
    return hashlib.sha256(json.dumps(run, sort_keys=True).encode()).hexdigest()


def _damage(path: Path) -> ValueError:
    return ValueError(
        f"files of a model must have the SHA-256 sums in run.json; get {path.parent} again (`git restore`, or another "
        f"installation), or train the model again; received {path}, which is damaged or another file"
    )

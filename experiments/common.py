"""Code shared by the studies: configurations, simulations, predictions and result files.

A study that has settings reads `experiments/configs/NAME.toml`. A study writes one JSON result file: under
`results/studies/`, or under `published/` if its computation takes hours. All quantities are dimensionless, as in
`bem.results.trajectory`.
"""

import contextlib
import json
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import ArrayLike

from bem import Scene, StandardLinearSolid
from bem._support.outputs import write_whole
from bem._support.provenance import provenance
from bem._support.text_files import read_json, read_toml

CONFIGS = Path(__file__).parent / "configs"
DATASET = Path("published/dataset.h5")
MODELS = Path("published/models")
MODULUS_RATIO = 0.1
"""Relaxed over instantaneous modulus, k = E0/Einf, of the paper's solid."""


def read_config(path: Path) -> dict[str, Any]:
    """Read a TOML file of a study. Keys that it lacks have the values of the file of its name in `CONFIGS`.

    Raises:
        FileNotFoundError: A file does not exist.
        ValueError: The file is not TOML, or holds other keys.
    """
    usual = read_toml(CONFIGS / path.name)
    try:
        settings = read_toml(path)
    except ValueError as error:
        raise ValueError(f"configuration must be TOML; received {str(path)!r} ({error})") from error
    if not settings.keys() <= usual.keys():
        raise ValueError(f"configuration must hold {', '.join(usual)} only; received {', '.join(sorted(settings))}")
    return usual | settings


def read_result(path: Path) -> Any:
    """Read the content of a result file.

    Raises:
        FileNotFoundError: The file does not exist. The message names the command that makes it.
        ValueError: The file is no JSON.
    """
    target = path.stem.replace("_", "-")
    made = f"`make {'measure-' if path.parent.name == 'measurements' else ''}{target}` makes it"
    made = "`make studies` makes it" if path.parent.name == "studies" else made
    if not path.is_file():
        raise FileNotFoundError(f"result file {str(path)!r} not found; {made}")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"result file {str(path)!r} must be JSON; {error}") from error


def read_input(path: Path) -> Any:
    """Content of a result file; of any other file, and of a folder, the path."""
    return read_result(path) if path.suffix == ".json" else path


def _parsed(read: Callable[[Path], Any]) -> Callable[[str], Any]:
    """A parser of Typer, whose errors keep their words."""

    def parse(word: str) -> Any:
        try:
            return read(Path(word))
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error

    return parse


Config = Annotated[Any, typer.Argument(parser=_parsed(read_config), metavar="CONFIG.toml")]
Result = Annotated[Any, typer.Argument(parser=_parsed(read_result), metavar="RESULT.json")]
Dataset = Annotated[Path, typer.Argument(help="Data set file.")]
Models = Annotated[Path, typer.Argument(help="Folder of models.")]
"""Inputs of a study on its command line: the content of a file, or a path."""


def write_result(out: Path, study: str, result: dict[str, Any]) -> None:
    """Write a result file atomically, its arrays as lists, with its provenance (command, versions, host, revision)."""
    out.parent.mkdir(parents=True, exist_ok=True)
    complete = {**provenance(f"python -m experiments {study}"), **result}
    write_whole(out, json.dumps(complete, allow_nan=False, default=np.ndarray.tolist) + "\n")


def dataset_digest(path: Path) -> str:
    """Digest of a data set file, as trainings record it.

    Raises:
        FileNotFoundError: The file does not exist.
    """
    from surrogate.data.dataset import TrajectoryDataset

    if not path.is_file():
        raise FileNotFoundError(f"data set {str(path)!r} not found; `make dataset` makes it")
    return TrajectoryDataset.load(path).sha256


def ended_by_recipe(folder: Path) -> bool:
    """Whether a folder holds a model whose training its recipe ended, and not `EPOCHS`."""
    return (folder / "run.json").is_file() and read_json(folder / "run.json").get("ended_by") == "recipe"


def require_dataset(folder: Path, dataset: Path) -> None:
    """Check that a model was trained on a data set file: a trajectory index is valid in one data set only.

    Raises:
        FileNotFoundError: The data set file does not exist.
        ValueError: The model was trained on another data set.
    """
    from surrogate.training.identity import read_identity

    trained_on, received = read_identity(folder).dataset, dataset_digest(dataset)
    if trained_on != received:
        raise ValueError(
            f"model {folder.name!r} must have been trained on {str(dataset)!r}, of digest {received[:12]}; "
            f"received one trained on a data set of digest {trained_on[:12]}: remove {str(folder)!r} and train it again"
        )


def load_surrogate(model: str, models: Path, backend: str | None = None) -> Any:
    """Load a trained model for one thread: by ONNX Runtime if the model was exported, otherwise by Keras.

    Raises:
        ValueError: The name of the model is not a plain name.
    """
    from surrogate.backend import limit_threads
    from surrogate.training.model_directory import model_name

    model_name(model, "a published model's name")
    if "TF_NUM_INTRAOP_THREADS" not in os.environ:
        with contextlib.suppress(RuntimeError):
            limit_threads(1)
    from surrogate.loading import load

    exported = (models / model / "model.onnx").is_file()
    return load(model, models, backend=backend or ("onnx" if exported else "keras"))


def without_extrapolation_warnings() -> warnings.catch_warnings:
    """Silence the extrapolation warning of surrogates, for studies that report the extrapolation themselves."""
    from surrogate.model import ExtrapolationWarning

    return warnings.catch_warnings(action="ignore", category=ExtrapolationWarning)


def predicted(trained: Any, times: np.ndarray, indentations: np.ndarray, tabor: ArrayLike) -> np.ndarray:
    """Forces that a surrogate predicts at measurement steps, of the shape of `times`; it warns of no extrapolation."""
    with without_extrapolation_warnings():
        return trained.predict_history(times, indentations, scenes(tabor))


def scenes(tabor: ArrayLike, modulus_ratio: ArrayLike = MODULUS_RATIO) -> list[Scene]:
    """Scenes of standard linear solids, one for each Tabor parameter; a single number makes one scene."""
    pairs = zip(*(column.tolist() for column in np.broadcast_arrays(np.atleast_1d(tabor), modulus_ratio)), strict=True)
    return [Scene(mu, StandardLinearSolid(ratio)) for mu, ratio in pairs]

"""Tables of `surrogate list`: the published models, the untrained models, and the installed software.

Only the sizes of registered architectures need Keras.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from bem._support.text_files import read_json
from bem._support.wording import markdown_table
from surrogate import files
from surrogate.architectures.naming import (
    CONDITIONINGS,
    FAMILIES,
    PAPER_PARAMETER_COUNTS,
    PARAMETER_COUNTS,
    names,
)

# As in the report.
COLUMNS = ("model", "parameters", "held-out MSE", "median pull-off error", "median hysteresis error", "training")
NOT_INSTALLED = "in published/models of the repository, not in this installation"
ERRORS = ("pull_off_force_percent", "hysteresis_percent")


def model_table(roots: Sequence[Path]) -> str:
    """Return a table of all models in some directories, best first, and of the names that are not trained.

    Of two models with the same name, the first is listed, which is also the one that `surrogate.load` takes.

    Raises:
        ValueError: a model's `metrics.json` is damaged.
    """
    models: dict[str, tuple[str, ...]] = {}
    for root in roots:
        # Trained on other forces than those of the data set.
        outdated = _read(root.parent / "model_forces.json", lambda recorded: list(recorded["others"]), [])
        for path in sorted(root.glob("[!.]*/metrics.json")):
            *row, training = _published(path)
            notes = [training] if training else []
            notes += ["an earlier data set's forces"] if path.parent.name in outdated else []
            usable = any((path.parent / name).is_file() for name in ("model.onnx", "model.weights.h5"))
            notes += [] if usable else ["errors only, no weights"]
            models.setdefault(path.parent.name, (*row, ", ".join(notes)))
    rows = sorted(models.values(), key=lambda row: float(row[2]))
    absent = "not trained" if files.PUBLISHED.is_dir() else NOT_INSTALLED
    rows += [(name, _size(name), "", "", "", absent) for name in names() if name not in models]
    widths = [max(len(row[column]) for row in (COLUMNS, *rows)) for column in range(len(COLUMNS))]
    title = "Errors over each model's own held-out trajectories, without `fast` and `accurate`, which know any solid:"
    lines = [title if models else "No model is published here."]
    for row in (COLUMNS, *rows):
        numbers = zip(row[1:-1], widths[1:-1], strict=True)
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in numbers), row[-1]]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def installed() -> str:
    """Return two lines with the installed software for prediction and for training; nothing is imported."""
    onnx, keras, backend = _version("onnxruntime"), _version("keras"), _keras_backend()
    below = None if backend == "numpy" else _version(backend)
    advice = "install them with `pip install '.[train]'` in a clone of the repository"
    trains = f"keras {keras} on {backend} {below}"
    if below is None or keras is None:
        missing = f"{backend}, the backend of keras {keras}, is" if keras else "Keras and its backend are"
        trains = f"nothing, because {missing} not installed; {advice}"
    predicts = f"onnxruntime {onnx}" if onnx else "nothing, because onnxruntime is not installed"
    return f"Predicts here: {predicts}\nTrains here: {trains}"


def parameter_table() -> str:
    """Return a Markdown table of the numbers of trainable parameters; a star marks those that the paper states."""
    rows = []
    for family, of_family in FAMILIES.items():
        cells = []
        for conditioning in CONDITIONINGS:
            name = f"{family}-{conditioning}"
            star = " *" if name in PAPER_PARAMETER_COUNTS else ""
            cells.append(f"{_size(name)}{star}" if conditioning in of_family.conditionings else "")
        rows.append([f"{family}: {of_family.description}", *cells])
    return markdown_table(["family", *CONDITIONINGS], rows, "l" + "r" * len(CONDITIONINGS))


def _published(path: Path) -> tuple[str, ...]:
    """Return a row of the table, from `metrics.json` and `run.json`."""
    try:
        metrics = read_json(path)
        medians = {name: float(metrics["test"][name]["median"]) for name in ERRORS if name in metrics["test"]}
        numbers = (f"{int(metrics['parameters']):,}", f"{float(metrics['test']['mse']['mean']):.2e}")
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"metrics.json must be one that `surrogate train` wrote; received {path}") from error
    errors = (f"{medians[quantity]:.2f} %" if quantity in medians else "" for quantity in ERRORS)
    return (path.parent.name, *numbers, *errors, _training(path.parent))


def _training(folder: Path) -> str:
    """Return how a model was trained, as text; `""` if its `run.json` does not say."""

    def words(run: dict[str, Any]) -> str:
        settings = [] if run["architecture"] == folder.name else [str(run["architecture"])]
        settings += [f"inputs {run['features']}"] if run["features"] != "D" else []
        return ", ".join([*settings, f"{run['epochs']:,} epochs of {run['training_trajectories']:,} trajectories"])

    return _read(folder / "run.json", words, "")


def _size(name: str) -> str:
    """Return the number of trainable parameters as text."""
    if name in PARAMETER_COUNTS:
        return f"{PARAMETER_COUNTS[name]:,}"
    from surrogate.architectures import build

    return f"{build(name).count_params():,}"


def _version(package: str) -> str | None:
    if importlib.util.find_spec(package) is None:
        return None
    for distribution in (package, f"{package}-cpu"):
        with suppress(PackageNotFoundError):
            return version(distribution)
    return "of unknown version"


def _keras_backend() -> str:
    """Return the backend that Keras would use, from its environment variable or its configuration file."""
    if chosen := os.environ.get("KERAS_BACKEND"):
        return chosen
    home = Path(os.environ.get("KERAS_HOME") or "~/.keras")
    return str(_read(home / "keras.json", lambda config: config["backend"], "tensorflow"))


def _read(path: Path, take: Callable[[Any], Any], default: Any) -> Any:
    """Return what is taken from a JSON file, or a default where the file does not have it."""
    try:
        return take(read_json(path.expanduser()))
    except (OSError, ValueError, KeyError, TypeError, RuntimeError):
        return default

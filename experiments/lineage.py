"""What a trained model comes from, and whether it may stand beside another one or beside a data set.

Trajectory indices mean something in one data set only, and errors compare only on one held-out part: what reads more
than one model directory, or a model and a data set, asks here first.
"""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PARTS = ("train", "validation", "test")


@dataclass(frozen=True)
class Lineage:
    """What decided a training.

    Args:
        dataset: Digest of the data set, as `surrogate.data.dataset` makes it.
        parts: Trajectory indices of training, validation and test, by name.
        recipe: Keys and values of the recipe, tables as dictionaries.
        backend: The Keras backend.
        features: The feature set.
        architecture: One of the eighteen names.
        extra: Digest of a second data set, all for training; `None` without one.
    """

    dataset: str
    parts: dict[str, tuple[int, ...]]
    recipe: dict[str, Any]
    backend: str
    features: str
    architecture: str
    extra: str | None = None


def read_lineage(folder: Path) -> Lineage:
    """Read what a model directory says about where it comes from.

    Raises:
        FileNotFoundError: not a complete model directory.
    """
    for name in ("run.json", "split.json", "recipe.toml"):
        if not (folder / name).is_file():
            raise FileNotFoundError(f"a model directory must hold {name}; received {str(folder)!r} without it")
    run, split = (json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) for name in ("run", "split"))
    return Lineage(
        dataset=run["dataset_sha256"],
        parts={part: tuple(split[part]) for part in PARTS},
        recipe=tomllib.loads((folder / "recipe.toml").read_text(encoding="utf-8")),
        backend=run["backend"],
        features=run["features"],
        architecture=run["architecture"],
        extra=run.get("extra_dataset_sha256"),
    )


def dataset_digest(path: Path) -> str:
    """Digest of a data set file, the one that trainings record.

    Raises:
        FileNotFoundError: no such file.
    """
    from surrogate.data.dataset import TrajectoryDataset

    if not path.is_file():
        raise FileNotFoundError(f"data set {str(path)!r} not found; `make dataset` makes it")
    return TrajectoryDataset.load(path).sha256


def differences(found: Lineage, wanted: Lineage) -> list[str]:
    """Words for what differs, but for the architecture; empty where both may be compared as equally trained."""
    words = {
        "data set": found.dataset != wanted.dataset,
        "split": found.parts != wanted.parts,
        "recipe": found.recipe != wanted.recipe,
        "backend": found.backend != wanted.backend,
        "feature set": found.features != wanted.features,
        "extra data set": found.extra != wanted.extra,
    }
    return [word for word, differs in words.items() if differs]


def held_out_differences(found: Lineage, wanted: Lineage) -> list[str]:
    """The same for what is trained otherwise on purpose: the data set, validation and test must still be the same."""
    words = {"data set": found.dataset != wanted.dataset}
    words |= {f"{part} part": found.parts[part] != wanted.parts[part] for part in ("validation", "test")}
    return [word for word, differs in words.items() if differs]


def require_dataset(folder: Path, dataset: Path) -> str:
    """Digest of the data set a model was trained on, which must be that file's.

    Raises:
        ValueError: the model was trained on another data set.
    """
    trained_on, received = read_lineage(folder).dataset, dataset_digest(dataset)
    if trained_on != received:
        raise ValueError(
            f"model {folder.name!r} must have been trained on {str(dataset)!r}, of digest {received[:12]}; "
            f"received one trained on a data set of digest {trained_on[:12]}: remove {str(folder)!r} and train it anew"
        )
    return received

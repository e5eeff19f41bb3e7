"""Which training a model comes from, and whether two trainings are the same.

Whatever compares trainings asks `differences`: the commands that publish or resume one, checkpoints, and the studies
that set several models side by side. Reading an identity needs no Keras.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from surrogate.architectures.registry import source_of
from surrogate.data.dataset import PARTS, Split, TrajectoryDataset
from surrogate.training.recipe import Recipe

PUBLISHED_SEED = "published_seed"
"""Key of `run.json` that says which of several seeds a published model is, where it stands for all of them."""

WORDS = {
    "dataset": "data set",
    "split": "split",
    "validation": "validation part",
    "test": "test part",
    "recipe": "recipe",
    "backend": "backend",
    "features": "feature set",
    "extra": "extra data set",
    "architecture": "architecture",
    "architecture_sha256": "architecture file",
}
"""What can differ, by the name of the quantity."""

EVERYTHING = tuple(name for name in WORDS if name not in ("validation", "test"))
"""All quantities; the split contains validation and test part."""

ALIKE = tuple(name for name in EVERYTHING if not name.startswith("architecture") and name != "backend")
"""What architectures need in common to be compared as equally trained.

Backends compute the same up to rounding. They draw other initial weights from the same seed, as another seed would.
"""

HELD_OUT = ("dataset", "validation", "test")
"""What two models need in common for their errors to be comparable."""


@dataclass(frozen=True)
class TrainingIdentity:
    """Everything that decides the result of a training.

    Args:
        dataset: Digest of the data set, as `surrogate.data.dataset` computes it.
        parts: Trajectory indices of training, validation and test, by name.
        recipe: Keys and values of the recipe, tables as dictionaries.
        backend: The Keras backend; `""` where it is not chosen yet.
        features: The feature set.
        architecture: The architecture's name.
        extra: Digest of the second data set, all for training; `None` without one.
        architecture_sha256: SHA-256 sum of the file that registered the architecture; `None` for the package's own.
    """

    dataset: str
    parts: dict[str, tuple[int, ...]]
    recipe: dict[str, Any]
    backend: str
    features: str
    architecture: str
    extra: str | None = None
    architecture_sha256: str | None = None

    @classmethod
    def of(
        cls,
        architecture: str,
        dataset: TrajectoryDataset,
        split: Split,
        recipe: Recipe,
        *,
        features: str = "D",
        extra: TrajectoryDataset | None = None,
        backend: str = "",
    ) -> TrainingIdentity:
        """Identify the training of an architecture on data sets that are loaded."""
        source = source_of(architecture)
        return cls(
            dataset=dataset.sha256,
            parts={part: tuple(getattr(split, part).tolist()) for part in PARTS},
            recipe=recipe.as_dict(),
            backend=backend,
            features=features,
            architecture=architecture,
            extra=extra.sha256 if extra else None,
            architecture_sha256=source.sha256 if source else None,
        )

    def of_any_seed(self) -> TrainingIdentity:
        """Return the identity without the seed of weights and batches."""
        return replace(self, recipe={name: value for name, value in self.recipe.items() if name != "seed"})

    def facts(self) -> dict[str, Any]:
        """Return the quantities that `differences` compares, by name; a checkpoint holds the same but the parts."""
        split = Split(**{part: np.array(self.parts[part], dtype=np.int64) for part in PARTS}, seed=0)
        return asdict(self) | {"split": split.sha256} | {part: self.parts[part] for part in ("validation", "test")}

    @property
    def fingerprint(self) -> str:
        """One line of JSON for a checkpoint: what decides the result of an epoch.

        Without its number of epochs where the recipe only ends by them, so that a training can be continued.
        """
        facts = self.facts()
        content = {name: facts[name] for name in EVERYTHING if name != "architecture_sha256" or facts[name]}
        if not _paced_by_epochs(self.recipe):
            content["recipe"] = {name: value for name, value in self.recipe.items() if name != "epochs"}
        return json.dumps(content, sort_keys=True)

    @property
    def digest(self) -> str:
        """SHA-256 sum of what decides the training except the backend, which differs by rounding alone."""
        content = asdict(self) | {"backend": ""}
        if content["architecture_sha256"] is None:
            del content["architecture_sha256"]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def read_identity(folder: Path) -> TrainingIdentity:
    """Read which training a model directory comes from.

    Raises:
        FileNotFoundError: not a complete model directory.
        ValueError: a file is damaged, or does not say how the model was trained.
    """
    for name in ("run.json", "split.json", "recipe.toml"):
        if not (folder / name).is_file():
            raise FileNotFoundError(f"Expected a model directory with {name}. Received: {folder} without it")
    try:
        run, split = (json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) for name in ("run", "split"))
        return TrainingIdentity(
            dataset=run["dataset_sha256"],
            parts={part: tuple(split[part]) for part in PARTS},
            recipe=tomllib.loads((folder / "recipe.toml").read_text(encoding="utf-8")),
            backend=run["backend"],
            features=run["features"],
            architecture=run["architecture"],
            extra=run.get("extra_dataset_sha256"),
            architecture_sha256=(run.get("architecture_file") or {}).get("sha256"),
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(f"Expected a model directory that says how it was trained. Received: {folder}") from error


def differences(
    found: TrainingIdentity, wanted: TrainingIdentity, of: Iterable[str] = EVERYTHING, but: Iterable[str] = ()
) -> list[str]:
    """Return in words what differs between two trainings, such as `["data set", "recipe"]`; empty where nothing does.

    Args:
        found: One training.
        wanted: The other.
        of: Which quantities of `WORDS` to compare.
        but: Which of these not to compare.
    """
    return _compared(found.facts(), wanted.facts(), [name for name in of if name not in but])


def fingerprint_differences(found: str, wanted: str, but: Iterable[str] = ()) -> list[str]:
    """Return in words what differs between two fingerprints; `["run"]` where one of them cannot be read."""
    if found == wanted:
        return []
    try:
        one, other = json.loads(found), json.loads(wanted)
        return _compared(one, other, [name for name in EVERYTHING if name not in but])
    except (ValueError, AttributeError, TypeError):
        return ["run"]


def trained_otherwise(folder: Path, wanted: TrainingIdentity) -> str:
    """Say in a few words why a model directory is not what would be trained now; empty where it is.

    The backend is no reason: under another one the same training differs by rounding. The seed is none where the model
    was chosen among several.
    """
    try:
        found = read_identity(folder)
        if PUBLISHED_SEED in json.loads((folder / "run.json").read_text(encoding="utf-8")):
            found, wanted = found.of_any_seed(), wanted.of_any_seed()
        other = differences(found, wanted, but=("backend",))
    except (FileNotFoundError, ValueError):
        return "which does not say how it was trained"
    return f"of another {', '.join(other)}" if other else ""


def _compared(found: dict[str, Any], wanted: dict[str, Any], names: Iterable[str]) -> list[str]:
    return [WORDS[name] for name in names if found.get(name) != wanted.get(name)]


def _paced_by_epochs(recipe: dict[str, Any]) -> bool:
    """Whether the number of epochs decides how an epoch goes; elsewhere it only says when training ends."""
    return any(name in recipe for name in ("cosine", "weight_average", "dropout_until"))

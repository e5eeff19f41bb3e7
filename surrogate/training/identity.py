"""Identity of a training: all that decides its result.

All comparisons of trainings use `differences` or `facts_that_differ`: the commands that publish or resume a training,
the folders of runs, and the studies that compare models. Reading an identity needs no Keras.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.text_files import read_json, read_toml
from surrogate.architectures.registry import source_of
from surrogate.data.dataset import PARTS, Split, TrajectoryDataset
from surrogate.training.recipe import Recipe

PUBLISHED_SEED = "published_seed"
"""Key of `run.json` with the seed of a published model that was chosen among models of several seeds."""

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
"""Words for messages, by the name of the quantity that can differ."""

EVERYTHING = tuple(name for name in WORDS if name not in ("validation", "test"))
"""All quantities; the split contains the validation and the test set."""

ALIKE = tuple(name for name in EVERYTHING if not name.startswith("architecture") and name != "backend")
"""Quantities that must be equal for two architectures to count as equally trained.

The backend is not one of them. Backends compute the same up to rounding; from one seed they draw different initial
weights, which has the effect of another seed.
"""

HELD_OUT = ("dataset", "validation", "test")
"""Quantities that must be equal for the errors of two models to be comparable."""


@dataclass(frozen=True)
class TrainingIdentity:
    """All that decides the result of a training.

    Args:
        dataset: Digest of the data set, `TrajectoryDataset.sha256`.
        parts: Trajectory indices of the training, validation and test sets, by the names in `PARTS`.
        recipe: Keys and values of the recipe, tables as dictionaries.
        backend: Name of the Keras backend; `""` if it is not chosen yet.
        features: The feature set.
        architecture: Name of the architecture.
        extra: Digest of the second data set, which is for training only; `None` without one.
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
        """Return the identity of a training that would start now, of the arguments of `surrogate.training.runs.Run`.

        Raises:
            ValueError: the architecture is unknown.
        """
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
        """Return the identity without the seed of the recipe."""
        return replace(self, recipe={name: value for name, value in self.recipe.items() if name != "seed"})

    def facts(self) -> dict[str, Any]:
        """Return the quantities that `differences` compares, by name, ready for JSON."""
        split = Split(**{part: np.array(self.parts[part], dtype=np.int64) for part in PARTS}, seed=0)
        return asdict(self) | self.parts | {"split": split.sha256}

    @property
    def fingerprint(self) -> dict[str, Any]:
        """All that decides the result of an epoch, by name, ready for JSON.

        The number of epochs is left out if it only ends the training, so that more epochs can be added later.
        """
        facts = {name: value for name, value in self.facts().items() if name in EVERYTHING}
        if not any(name in self.recipe for name in ("cosine", "weight_average", "dropout_until")):
            facts["recipe"] = {name: value for name, value in self.recipe.items() if name != "epochs"}
        return facts

    @property
    def digest(self) -> str:
        """SHA-256 digest of the identity without the backend, because backends differ by rounding only."""
        content = asdict(replace(self, backend=""))
        if self.architecture_sha256 is None:
            del content["architecture_sha256"]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def read_identity(folder: Path) -> TrainingIdentity:
    """Return the identity of the training of a model directory.

    Raises:
        FileNotFoundError: the model directory is not complete.
        ValueError: a file is damaged, or does not say how the model was trained.
    """
    for name in ("run.json", "split.json", "recipe.toml"):
        if not (folder / name).is_file():
            raise FileNotFoundError(f"Expected a model directory with {name}. Received: {folder} without it")
    try:
        run, split = (read_json(folder / f"{name}.json") for name in ("run", "split"))
        return TrainingIdentity(
            dataset=run["dataset_sha256"],
            parts={part: tuple(split[part]) for part in PARTS},
            recipe=read_toml(folder / "recipe.toml"),
            backend=run["backend"],
            features=run["features"],
            architecture=run["architecture"],
            extra=run.get("extra_dataset_sha256"),
            architecture_sha256=(run.get("architecture_file") or {}).get("sha256"),
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"Expected a model directory that says how it was trained. Received: {folder}") from error


def differences(
    found: TrainingIdentity, wanted: TrainingIdentity, of: Iterable[str] = EVERYTHING, but: Iterable[str] = ()
) -> list[str]:
    """Return in which quantities `of` two trainings differ, `but` some, by the words of `WORDS`."""
    facts = wanted.facts()
    return facts_that_differ(found.facts(), {name: facts[name] for name in of}, but)


def facts_that_differ(found: Mapping[str, Any], wanted: Mapping[str, Any], but: Iterable[str] = ()) -> list[str]:
    """Return the words of `WORDS` for the wanted facts, `but` some, that other facts, such as stored ones, lack."""
    return [WORDS.get(name, name) for name, value in wanted.items() if name not in but and found.get(name) != value]


def trained_otherwise(folder: Path, wanted: TrainingIdentity) -> str:
    """Return why a model directory is not the result of a training, as words for a message; `""` if it is.

    The backend is not compared, because backends differ by rounding only. The seed is not compared if the model was
    chosen among models of several seeds.
    """
    try:
        found = read_identity(folder)
        if PUBLISHED_SEED in read_json(folder / "run.json"):
            found, wanted = found.of_any_seed(), wanted.of_any_seed()
        other = differences(found, wanted, but=("backend",))
    except (FileNotFoundError, ValueError):
        return "which does not say how it was trained"
    return f"of another {', '.join(other)}" if other else ""

"""A training, and its identity: all that decides its result.

All comparisons of trainings use `differences` or `facts_that_differ`: the commands that publish or resume a training,
the folders of runs, and the studies that compare models. Nothing here needs Keras.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.text_files import read_json
from surrogate.architectures.registry import source_of
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.examples import Part
from surrogate.training.model_directory import model_name
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
        recipe: Keys and values of the recipe, tables as dictionaries.
        backend: Name of the Keras backend; `""` if it is not chosen yet.
        features: The feature set.
        architecture: Name of the architecture.
        extra: Digest of the second data set, which is for training only; `None` without one.
        architecture_sha256: SHA-256 sum of the file that registered the architecture; `None` for the package's own.
        split: The training, validation and test sets; their seed does not count.
    """

    dataset: str
    recipe: dict[str, Any]
    backend: str
    features: str
    architecture: str
    extra: str | None
    architecture_sha256: str | None
    split: Split

    def of_any_seed(self) -> TrainingIdentity:
        """Return the identity without the seed of the recipe."""
        return replace(self, recipe={name: value for name, value in self.recipe.items() if name != "seed"})

    def facts(self) -> dict[str, Any]:
        """Return the quantities that `differences` compares, by name, ready for JSON."""
        return vars(self) | self.split.parts | {"split": self.split.sha256}

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
        facts = vars(self) | {"backend": "", "parts": self.split.parts}
        del facts["split"]
        if self.architecture_sha256 is None:
            del facts["architecture_sha256"]
        return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Run:
    """An architecture, the data it is trained on, and how.

    Args:
        architecture: Name of an architecture, one of `surrogate.names()`.
        dataset: The data set with the training, validation and test sets.
        split: The split of `dataset`.
        recipe: How to train.
        features: The feature set, `"A"` to `"D"`.
        extra: A second data set, of the same material and measurement steps. Its completed trajectories join the
            training set, except those whose protocols are in the validation or test set.
        label: Name to publish the model under; the name of the architecture by default.
        epochs_given: Whether the number of epochs was given instead of taken from the recipe.

    Raises:
        ValueError: the name is not plain, or the second data set has another material or other measurement steps.
    """

    architecture: str
    dataset: TrajectoryDataset
    split: Split
    recipe: Recipe
    features: str = "D"
    extra: TrajectoryDataset | None = None
    label: str = ""
    epochs_given: bool = False

    def __post_init__(self) -> None:
        model_name(self.name)
        if self.extra is None:
            return
        for name, label in (("modulus_ratio", "modulus ratio"), ("points_per_phase", "measurement steps")):
            expected, received = getattr(self.dataset, name), getattr(self.extra, name)
            if received != expected:
                raise ValueError(f"the extra data set must have the {label} {expected}; received {received}")

    @property
    def name(self) -> str:
        """The name to publish under."""
        return self.label or self.architecture

    @property
    def training(self) -> list[Part]:
        """The data sets to train on, and the trajectories of each."""
        own = (self.dataset, self.split.train)
        if self.extra is None:
            return [own]
        offered = self.extra.completed
        held_out = set(self.dataset.rounded_protocols(np.concatenate([self.split.validation, self.split.test])))
        new = [row not in held_out for row in self.extra.rounded_protocols(offered)]
        return [own, (self.extra, offered[np.array(new, dtype=bool)])]

    @property
    def identity(self) -> TrainingIdentity:
        """The identity of the training, the backend excepted.

        Raises:
            ValueError: the architecture is unknown.
        """
        source = source_of(self.architecture)
        return TrainingIdentity(
            dataset=self.dataset.sha256,
            recipe=self.recipe.as_dict(),
            backend="",
            features=self.features,
            architecture=self.architecture,
            extra=self.extra.sha256 if self.extra else None,
            architecture_sha256=source.sha256 if source else None,
            split=self.split,
        )


def read_identity(folder: Path) -> TrainingIdentity:
    """Return the identity of the training of a model directory.

    Raises:
        FileNotFoundError: the model directory is not complete.
        ValueError: a file is damaged, or does not say how the model was trained.
    """
    if not (folder / "run.json").is_file():
        raise FileNotFoundError(f"a model directory must have run.json; received {folder} without it")
    try:
        run = read_json(folder / "run.json")
        return TrainingIdentity(
            dataset=run["dataset_sha256"],
            recipe=run["recipe"],
            backend=run["backend"],
            features=run["features"],
            architecture=run["architecture"],
            extra=run.get("extra_dataset_sha256"),
            architecture_sha256=(run.get("architecture_file") or {}).get("sha256"),
            split=Split.of(folder),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"a model directory must say how it was trained; received {folder}") from error


def differences(
    stored: TrainingIdentity, expected: TrainingIdentity, of: Iterable[str] = EVERYTHING, but: Iterable[str] = ()
) -> list[str]:
    """Return in which quantities `of` two trainings differ, `but` some, by the words of `WORDS`."""
    facts = expected.facts()
    return facts_that_differ(stored.facts(), {name: facts[name] for name in of}, but)


def facts_that_differ(stored: Mapping[str, Any], expected: Mapping[str, Any], but: Iterable[str] = ()) -> list[str]:
    """Return the words of `WORDS` for the wanted facts, `but` some, that other facts, such as stored ones, lack."""
    return [WORDS.get(name, name) for name, value in expected.items() if name not in but and stored.get(name) != value]


def trained_otherwise(folder: Path, expected: TrainingIdentity) -> str:
    """Return why a model directory is not the result of a training, as words for a message; `""` if it is.

    The backend is not compared, because backends differ by rounding only. The seed is not compared if the model was
    chosen among models of several seeds.
    """
    try:
        stored = read_identity(folder)
        if PUBLISHED_SEED in read_json(folder / "run.json"):
            stored, expected = stored.of_any_seed(), expected.of_any_seed()
        differing = differences(stored, expected, but=("backend",))
    except (FileNotFoundError, ValueError):
        return "which does not say how it was trained"
    return f"of another {', '.join(differing)}" if differing else ""

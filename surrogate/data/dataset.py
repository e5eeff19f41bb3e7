"""Trajectories of a data set file, and their split into training, validation and test sets.

`bem.dataset.file` reads and checks the file. The file does not store times and indentations; they follow from the
protocol (`bem.dataset.measurement_steps`). The scalars are those of the solver's native history, not of the fixed
measurement steps (FMS). All quantities are dimensionless as in the paper; forces are positive in tension.

Source: the paper's sections "Data mapping" and "Surrogate-model inputs and targets".
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bem._support.text_files import read_json
from bem.dataset.designs import QUANTITIES
from bem.dataset.file import Dataset, load_dataset
from bem.dataset.measurement_steps import measurement_grid
from bem.dataset.records import COMPLETED, RESULTS

PARTS = ("train", "validation", "test")
"""Names of the three parts of a split."""


@dataclass(frozen=True)
class Split:
    """Trajectory indices of the training, validation and test sets, sorted; no protocol appears in two of them.

    Args:
        train: Indices of the training set, shape `(n_train,)`.
        validation: Indices of the validation set, shape `(n_validation,)`; they choose the epoch whose weights are kept
            and drive the learning-rate schedule on a plateau.
        test: Indices of the test set, shape `(n_test,)`, for the reported errors only.
        seed: Seed of the random split.
    """

    train: np.ndarray
    validation: np.ndarray
    test: np.ndarray
    seed: int

    def with_fraction(self, fraction: float, fold: int = 0) -> Split:
        """Return a split with a random subset of the training set; validation and test sets stay the same.

        Source: the paper's appendix "Effects of Training-Set Size and Physics-Guided Input Representation".

        Args:
            fraction: Share of the training set to keep, in (0, 1]. At least one trajectory is kept.
            fold: Number of the random order. Within one fold, a smaller subset is contained in every larger one.

        Returns:
            The new split.

        Raises:
            ValueError: the fraction is outside (0, 1].
        """
        if not 0.0 < fraction <= 1.0:
            raise ValueError(f"fraction must be above 0 and at most 1; received {fraction}")
        order = np.random.default_rng([self.seed, fold]).permutation(self.train)
        kept = np.sort(order[: max(1, round(fraction * self.train.size))])
        return replace(self, train=kept)

    @property
    def parts(self) -> dict[str, list[int]]:
        """The indices by the names in `PARTS`, ready for JSON."""
        return {name: getattr(self, name).tolist() for name in PARTS}

    @property
    def sha256(self) -> str:
        """SHA-256 digest of the indices; the seed does not enter."""
        indices = np.concatenate([self.train, self.validation, self.test])
        return hashlib.sha256(indices.astype(np.int64).tobytes()).hexdigest()

    def save(self, path: str | Path) -> None:
        """Write seed and indices as JSON."""
        Path(path).write_text(json.dumps({"seed": self.seed} | self.parts) + "\n", encoding="utf-8")

    @classmethod
    def of(cls, folder: Path) -> Split:
        """Read the split of a model directory: its `split.json`, or that beside it, which several models share.

        Raises:
            FileNotFoundError: there is neither.
            ValueError: the file is not a split.
        """
        own = folder / "split.json"
        return cls.load(own if own.is_file() else folder.parent / own.name)

    @classmethod
    def load(cls, path: str | Path) -> Split:
        """Read what `save` wrote.

        Raises:
            FileNotFoundError: the file does not exist.
            ValueError: the file is not a split.
        """
        try:
            stored = read_json(path)
            parts = {name: np.array(stored[name], dtype=np.int64) for name in PARTS}
            return cls(**parts, seed=int(stored["seed"]))
        except (ValueError, KeyError, TypeError, OverflowError) as error:
            raise ValueError(f"a split must have seed, train, validation and test; received {path}") from error


@dataclass(frozen=True)
class TrajectoryDataset:
    """The contents of a data set file.

    Args:
        protocols: Protocol quantities (`bem.dataset.designs.QUANTITIES`) by name, each of shape `(n,)`.
        force: Force on the fixed measurement steps, shape `(n, steps)`.
        points_per_phase: Number of points in loading, dwell and unloading.
        scalars: Results of the native history, such as `pull_off_force`, by name, each of shape `(n,)`.
        status: Status code of each simulation, shape `(n,)`; zero means completed.
        sha256: SHA-256 digest of the request: the protocols in their order, material, accuracy, measurement steps, and
            which simulations completed. A campaign that is computed again has the same digest, even on a processor that
            rounds differently, so a model can be matched with its data set. The SHA-256 sum of the file itself is in
            `published/SHA256SUMS`.
        forces_sha256: SHA-256 digest of the request and of all bits of the stored forces and scalars. Where it differs,
            the errors of two models refer to different reference forces.
        modulus_ratio: Relaxed over instantaneous modulus of the standard linear solid; `None` if the file states none.
    """

    protocols: dict[str, np.ndarray]
    force: np.ndarray
    points_per_phase: tuple[int, int, int]
    scalars: dict[str, np.ndarray]
    status: np.ndarray
    sha256: str
    forces_sha256: str
    modulus_ratio: float | None

    @classmethod
    def load(cls, path: str | Path) -> TrajectoryDataset:
        """Read a data set file.

        Raises:
            FileNotFoundError: the file does not exist.
            ValueError: the file is not a data set, is damaged or inconsistent, or has other steps or several solids,
                which models of the paper's kind cannot learn.
        """
        dataset = load_dataset(path)
        ratio = dataset.attributes.get("modulus_ratio")
        if dataset.steps != "uniform" or isinstance(ratio, list) or "solids" in dataset.attributes["campaign"]:
            raise ValueError(f"the data set must have uniform steps and one standard linear solid; received {path}")
        request, results = _digests(dataset)
        return cls(
            protocols=dataset.protocols,
            force=dataset.force.astype(np.float64),
            points_per_phase=dataset.counts,
            scalars={name: dataset.scalars[name] for name in RESULTS},
            status=dataset.columns["status"],
            sha256=request,
            forces_sha256=results,
            modulus_ratio=ratio,
        )

    def __len__(self) -> int:
        return len(self.force)

    @property
    def completed(self) -> np.ndarray:
        """Indices of the trajectories whose simulation completed, shape `(n_completed,)`, sorted."""
        return np.flatnonzero(self.status == COMPLETED)

    def protocols_of(self, indices: np.ndarray) -> dict[str, np.ndarray]:
        """Return the protocol quantities of the trajectories `indices`, by name, each of the shape of `indices`."""
        return {name: values[indices] for name, values in self.protocols.items()}

    def rounded_protocols(self, indices: np.ndarray) -> list[tuple[float, ...]]:
        """Return protocols in single precision, in which they compare equal although processors round differently."""
        columns = self.protocols_of(indices).values()
        return list(zip(*(values.astype(np.float32).tolist() for values in columns), strict=True))

    def grid(self, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return times and indentations of the trajectories `indices` on the FMS, each of shape `(batch, steps)`."""
        return measurement_grid(**self.protocols_of(indices), counts=self.points_per_phase)

    def split(self, seed: int = 0, fractions: tuple[float, float] = (0.1, 0.1)) -> Split:
        """Split the completed trajectories at random.

        Trajectories with the same protocol stay in the same set, so that no held-out protocol is seen in training.

        Args:
            seed: Seed of the random split.
            fractions: Shares of the validation and the test set; the rest is the training set. The default is the
                80/10/10 split of the paper's section "Surrogate-model inputs and targets".

        Returns:
            The indices of the training, validation and test sets.

        Raises:
            ValueError: there are too few trajectories for one in each of the three sets.
        """
        indices = self.completed
        validation_count, test_count = (round(fraction * indices.size) for fraction in fractions)
        if min(validation_count, test_count, indices.size - validation_count - test_count) < 1:
            raise ValueError(
                f"the completed trajectories must be enough for training, validation ({fractions[0]:g} of them) "
                f"and test ({fractions[1]:g}); received {indices.size}"
            )
        protocols = np.stack([self.protocols[name][indices] for name in QUANTITIES], axis=1)
        _, group = np.unique(protocols, axis=0, return_inverse=True)
        group = group.reshape(-1)
        rank = np.random.default_rng(seed).permutation(group.max() + 1)[group]
        order = np.argsort(rank, kind="stable")
        rank = rank[order]
        # A cut inside a group of equal protocols moves to the start of the group.
        cuts = np.searchsorted(rank, rank[[indices.size - validation_count - test_count, indices.size - test_count]])
        train, validation, test = (np.sort(indices[rows]) for rows in np.split(order, cuts))
        return Split(train=train, validation=validation, test=test, seed=seed)


def _digests(dataset: Dataset) -> tuple[str, str]:
    """Return the digests of the request, and of request and results; see `TrajectoryDataset`."""
    requested: dict[str, object] = {name: str(dataset.attributes.get(name)) for name in ("modulus_ratio", "accuracy")}
    requested["counts"] = list(dataset.counts)
    digest = hashlib.sha256(json.dumps(requested, sort_keys=True).encode())
    columns = list(dataset.protocols.values())
    for values in columns:
        # Single precision, because the last digit of a power differs between processors.
        digest.update(values.astype("<f4").tobytes())
    digest.update((dataset.columns["status"] == COMPLETED).tobytes())
    request = digest.hexdigest()
    results = [dataset.force.astype("<f4"), *(dataset.scalars[name].astype("<f8") for name in RESULTS)]
    return request, hashlib.sha256(request.encode() + b"".join(array.tobytes() for array in results)).hexdigest()

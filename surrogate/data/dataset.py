"""The trajectories a campaign of simulations wrote, and their split into training, validation and test.

`bem.dataset.file` reads and checks the file. Times and indentations are not stored, they follow from the protocol
(`bem.dataset.measurement_steps`). The scalars come from the solver's native history, not from the fixed measurement
steps (FMS). Everything is dimensionless, tension positive.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bem.dataset.designs import QUANTITIES
from bem.dataset.file import Dataset, load_dataset
from bem.dataset.records import COMPLETED, RESULTS


@dataclass(frozen=True)
class Split:
    """Trajectory indices of the three parts, sorted; no protocol appears in two parts.

    Args:
        train: Indices to train on.
        validation: Indices that steer the training.
        test: Indices held out for the reported errors.
        seed: Seed of the random division.
    """

    train: np.ndarray
    validation: np.ndarray
    test: np.ndarray
    seed: int

    def with_fraction(self, fraction: float, fold: int = 0) -> Split:
        """Keep a fraction of the training part; smaller fractions of the same fold are nested in larger ones.

        Raises:
            ValueError: the fraction is outside (0, 1].
        """
        if not 0.0 < fraction <= 1.0:
            raise ValueError(f"Expected a fraction in (0, 1]. Received: fraction={fraction}")
        order = np.random.default_rng([self.seed, fold]).permutation(self.train)
        kept = np.sort(order[: max(1, round(fraction * self.train.size))])
        return Split(train=kept, validation=self.validation, test=self.test, seed=self.seed)

    @property
    def sha256(self) -> str:
        """Digest of the indices."""
        parts = [self.train, self.validation, self.test]
        return hashlib.sha256(b"".join(part.astype(np.int64).tobytes() for part in parts)).hexdigest()

    def save(self, path: str | Path) -> None:
        """Write the indices as JSON."""
        content = {"seed": self.seed}
        content |= {part: getattr(self, part).tolist() for part in ("train", "validation", "test")}
        Path(path).write_text(json.dumps(content) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | Path) -> Split:
        """Read what `save` wrote.

        Raises:
            FileNotFoundError: no such file.
            ValueError: the file is not a split.
        """
        try:
            content = json.loads(Path(path).read_text(encoding="utf-8"))
            parts = {part: np.array(content[part], dtype=np.int64) for part in ("train", "validation", "test")}
            return cls(**parts, seed=int(content["seed"]))
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            raise ValueError(
                f"Expected a split with seed, train, validation and test. Received: path={path}"
            ) from error


@dataclass(frozen=True)
class TrajectoryDataset:
    """The contents of a data set file.

    Args:
        protocols: Protocol quantities by name, each of shape `(n,)`.
        force: Force on the fixed measurement steps, shape `(n, steps)`.
        points_per_phase: Points of loading, dwell and unloading.
        scalars: Native pull-off force and so on, by name, each of shape `(n,)`.
        status: Zero where the simulation completed, shape `(n,)`.
        sha256: Digest of what was asked for: protocols in their order, material, accuracy, measurement steps, and which
            of them completed. Computing a campaign again, even where another processor rounds otherwise, gives the same
            digest, so models and data sets find each other; `published/MANIFEST.json` has the sum of the very file.
        forces_sha256: Digest of what came out: the same, and the stored forces and results of the solver to the last
            bit. Errors of models trained on other forces are not measured against the same truth.
        modulus_ratio: Relaxed over instantaneous modulus of the standard linear solid; `None` where the file has none,
            or one for each trajectory, which `protocols` then hold under this name.
        steps: How the measurement steps are placed: `"uniform"` or `"physical"`.
    """

    protocols: dict[str, np.ndarray]
    force: np.ndarray
    points_per_phase: tuple[int, int, int]
    scalars: dict[str, np.ndarray]
    status: np.ndarray
    sha256: str
    forces_sha256: str
    modulus_ratio: float | None
    steps: str = "uniform"

    @classmethod
    def load(cls, path: str | Path) -> TrajectoryDataset:
        """Read a data set file.

        Raises:
            FileNotFoundError: no such file.
            ValueError: not a data set, damaged, or what is in it does not fit together.
        """
        content = load_dataset(path)
        asked = _digest(content)
        ratio = content.attributes.get("modulus_ratio")
        several = {"modulus_ratio": content.modulus_ratios} if isinstance(ratio, list) else {}
        return cls(
            protocols=content.protocols | several,
            force=content.force.astype(np.float64),
            points_per_phase=content.counts,
            scalars={name: content.scalars[name] for name in RESULTS},
            status=content.columns["status"],
            sha256=asked,
            forces_sha256=_forces_digest(content, asked),
            modulus_ratio=None if several else ratio,
            steps=content.steps,
        )

    def __len__(self) -> int:
        return len(self.force)

    @property
    def completed(self) -> np.ndarray:
        """Indices of the trajectories whose simulation completed."""
        return np.flatnonzero(self.status == COMPLETED)

    def protocols_of(self, indices: np.ndarray) -> dict[str, np.ndarray]:
        """Return the protocol quantities of some trajectories, by name."""
        return {name: values[indices] for name, values in self.protocols.items()}

    def grid(self, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return times and indentations of some trajectories on the fixed measurement steps, each `(batch, steps)`."""
        from bem.dataset.measurement_steps import measurement_grid

        protocols = {name: self.protocols[name][indices] for name in QUANTITIES}
        if self.steps == "physical":
            from bem.dataset.physical_steps import physical_grid

            ratios = self.modulus_ratios(indices)
            return physical_grid(**protocols, modulus_ratio=ratios, counts=self.points_per_phase)
        return measurement_grid(**protocols, counts=self.points_per_phase)

    def modulus_ratios(self, indices: np.ndarray) -> np.ndarray | None:
        """Return the modulus ratios of some trajectories, shape `(batch,)`; `None` where the file has none."""
        if "modulus_ratio" in self.protocols:
            return self.protocols["modulus_ratio"][indices]
        return None if self.modulus_ratio is None else np.full(len(indices), self.modulus_ratio)

    def split(self, seed: int = 0, fractions: tuple[float, float] = (0.1, 0.1)) -> Split:
        """Divide the completed trajectories at random.

        Trajectories of one and the same protocol stay together, so that nothing held out was seen in training.

        Args:
            seed: Seed of the division.
            fractions: Shares of validation and test; the rest is for training.
        """
        indices = self.completed
        protocols = np.stack([self.protocols[name][indices] for name in QUANTITIES], axis=1)
        _, group = np.unique(protocols, axis=0, return_inverse=True)
        group = group.reshape(-1)
        place = np.random.default_rng(seed).permutation(group.max() + 1)[group]
        order = np.argsort(place, kind="stable")
        place = place[order]
        validation_count, test_count = (round(fraction * indices.size) for fraction in fractions)
        # A cut inside a group moves to the group's start.
        cuts = np.searchsorted(place, place[[indices.size - validation_count - test_count, indices.size - test_count]])
        train, validation, test = (np.sort(indices[part]) for part in np.split(order, cuts))
        return Split(train=train, validation=validation, test=test, seed=seed)


def _digest(content: Dataset) -> str:
    asked: dict[str, object] = {name: str(content.attributes.get(name)) for name in ("modulus_ratio", "accuracy")}
    asked["counts"] = list(content.counts)
    digest = hashlib.sha256(json.dumps(asked, sort_keys=True).encode())
    columns = list(content.protocols.values())
    if content.steps != "uniform":
        digest.update(content.steps.encode())
    if isinstance(content.attributes.get("modulus_ratio"), list):
        columns.append(content.modulus_ratios)
    for values in columns:
        # In single precision, because the last digit of a power differs from one processor to another.
        digest.update(values.astype("<f4").tobytes())
    digest.update((content.columns["status"] == COMPLETED).tobytes())
    return digest.hexdigest()


def _forces_digest(content: Dataset, asked: str) -> str:
    digest = hashlib.sha256(asked.encode())
    digest.update(content.force.astype("<f4").tobytes())
    for name in RESULTS:
        digest.update(content.scalars[name].astype("<f8").tobytes())
    return digest.hexdigest()

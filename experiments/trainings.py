"""What the studies that train share: many variants of one model in a queue that resumes, and their collection.

A variant is trained by `surrogate train` in a process of its own under a label, and is done when its model directory
exists and comes from the data set, split and recipe that are asked for; the queue logs how each stands and is continued
by starting it again. Its result file keeps the learning curves and held-out errors, not the weights.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any

from experiments.lineage import Lineage, differences, read_lineage
from experiments.model_comparison import read_model
from surrogate.dataset import TrajectoryDataset
from surrogate.queue import STOPPED, run_queue
from surrogate.recipe import Recipe

WORK = Path("results/training_studies")


@dataclass(frozen=True)
class Variant:
    """One training.

    Args:
        label: Name of its directory.
        architecture: One of the eighteen names.
        recipe: Name or file of the recipe.
        epochs: Number of epochs; the recipe's where 0.
        features: Feature set.
        fraction: Share of the training part.
        fold: Which nested family of shares.
    """

    label: str
    architecture: str
    recipe: str
    epochs: int = 0
    features: str = "D"
    fraction: float = 1.0
    fold: int = 0

    def command(self, *, dataset: Path, work: Path) -> list[str]:
        """Arguments of `python -m surrogate` that train it."""
        options = {
            "label": self.label,
            "recipe": self.recipe,
            "features": self.features,
            "fraction": self.fraction,
            "fold": self.fold,
            "dataset": dataset,
            "threads": 1,
            "runs": work / "runs",
            "models": work / "models",
        }
        if self.epochs:
            options["epochs"] = self.epochs
        flags = [word for name, value in options.items() for word in (f"--{name}", str(value))]
        return ["train", self.architecture, *flags]

    def lineage(self, data: TrajectoryDataset, backend: str) -> Lineage:
        """What its model directory has to say about where it comes from."""
        recipe = Recipe.load(self.recipe).with_overrides(epochs=self.epochs or None)
        split = data.split().with_fraction(self.fraction, self.fold)
        return Lineage(
            dataset=data.sha256,
            parts={part: tuple(getattr(split, part).tolist()) for part in ("train", "validation", "test")},
            recipe=recipe.as_dict(),
            backend=backend,
            features=self.features,
            architecture=self.architecture,
        )


def is_trained(variant: Variant, data: TrajectoryDataset, folder: Path) -> bool:
    """Whether a model directory is there; the backend it was trained under is its own affair.

    Raises:
        ValueError: it is there, and comes from something else than the variant asks for.
    """
    if not (folder / "run.json").is_file():
        return False
    found = read_lineage(folder)
    wanted = variant.lineage(data, found.backend)
    other = differences(found, wanted) + (["architecture"] if found.architecture != wanted.architecture else [])
    if other:
        raise ValueError(
            f"training {variant.label!r} must come from {variant.architecture}, recipe {variant.recipe!r} and the data "
            f"set of digest {data.sha256[:12]}; received one of another {', '.join(other)}: remove {str(folder)!r} to "
            "train it anew"
        )
    return True


def train_variants(variants: Sequence[Variant], *, dataset: Path, work: Path, jobs: int) -> bool:
    """Train what is not trained yet.

    Returns:
        whether all are trained now; where not, the same call resumes.

    Raises:
        FileNotFoundError: no such data set.
        ValueError: a training that is there comes from another data set, split or recipe.
        RuntimeError: a training failed.
    """
    if not dataset.is_file():
        raise FileNotFoundError(f"data set {str(dataset)!r} not found; `make dataset` makes it")
    data = TrajectoryDataset.load(dataset)
    by_label = {variant.label: variant for variant in variants}
    waiting = [label for label, one in by_label.items() if not is_trained(one, data, work / "models" / label)]
    started, done = time.monotonic(), []

    def log(line: str) -> None:
        print(line, flush=True)
        if line.endswith(": done"):
            done.append(line)
            elapsed = time.monotonic() - started
            left = elapsed / len(done) * (len(waiting) - len(done))
            print(f"{len(done)} of {len(waiting)} trained, about {timedelta(seconds=round(left))} left", flush=True)

    print(f"{len(waiting)} of {len(variants)} trainings to do, {jobs} at a time", flush=True)
    ended = run_queue(
        waiting,
        lambda label: by_label[label].command(dataset=dataset, work=work),
        folder=work / "runs",
        jobs=jobs,
        log=log,
    )
    if any(status not in (0, STOPPED) for status in ended.values()):
        raise RuntimeError(f"a training failed; its log is in {str(work / 'runs')!r}")
    return len(done) == len(waiting)


def collect(variant: Variant, work: Path) -> dict[str, Any]:
    """Learning curve, held-out errors and cost of a trained variant."""
    folder = work / "models" / variant.label
    found = read_model(folder)
    kept = ("mse", "mae", "dtw_rmse", "validation_mse", "epochs", "best_epoch", "hours", "training_trajectories")
    curve = {name: found["history"][name] for name in ("epoch", "validation_mse")}
    return {**{name: found[name] for name in kept}, "dataset_sha256": read_lineage(folder).dataset, "history": curve}

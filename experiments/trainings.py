"""What the studies that train share: many variants of one model in a queue that resumes, and their collection.

A variant is trained by `surrogate train` in a process of its own under a label, and is done when its model directory
exists; the queue logs how each stands and is continued by starting it again. Its result file keeps the learning curves
and held-out errors, not the weights.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any

from experiments.model_comparison import read_model
from surrogate.queue import STOPPED, run_queue

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


def train_variants(variants: Sequence[Variant], *, dataset: Path, work: Path, jobs: int) -> bool:
    """Train what is not trained yet.

    Returns:
        whether all are trained now; where not, the same call resumes.
    """
    if not dataset.is_file():
        raise FileNotFoundError(f"data set {str(dataset)!r} not found; `make dataset` makes it")
    by_label = {variant.label: variant for variant in variants}
    waiting = [label for label in by_label if not (work / "models" / label / "run.json").is_file()]
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
    found = read_model(work / "models" / variant.label)
    dataset = json.loads((work / "models" / variant.label / "run.json").read_text(encoding="utf-8"))["dataset_sha256"]
    kept = ("mse", "mae", "dtw_rmse", "validation_mse", "epochs", "best_epoch", "hours", "training_trajectories")
    curve = {name: found["history"][name] for name in ("epoch", "validation_mse")}
    return {**{name: found[name] for name in kept}, "dataset_sha256": dataset, "history": curve}

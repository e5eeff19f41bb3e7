"""Code shared by the studies that train: variants of one model, trained some at a time, and their results.

A variant is trained by `surrogate train` in a separate process, under a label. It is done if a training of the same
data set, split, recipe, features and architecture is in the published result file of the study, in its own model
directory, or in that of a published model. A study therefore continues where it was interrupted, also in another clone
of the published files. Result files keep learning curves and held-out errors, not the weights.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from multiprocessing.pool import ThreadPool
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from experiments.published_models import read_model
from surrogate.data.dataset import TrajectoryDataset
from surrogate.training.identity import Run, TrainingIdentity, differences, read_identity
from surrogate.training.model_directory import model_name
from surrogate.training.recipe import Recipe
from surrogate.training.stopping import STOP_FILE, STOPPED

WORK = Path("results/training_studies")
Key = TypeVar("Key")
Work = Annotated[Path, typer.Option(help="Folder in which the trainings are kept.")]
"""Option of the studies that train."""


@dataclass(frozen=True)
class Variant:
    """One training.

    Args:
        label: Name of its directory, one plain name.
        architecture: One of the 18 paper models' names.
        recipe: Name or file of the recipe.
        epochs: Number of epochs; 0 for that of the recipe.
        features: Feature set.
        fraction: Share of the training part.
        fold: Index of the nested family of shares.

    Raises:
        ValueError: The label is not a plain name.
    """

    label: str
    architecture: str
    recipe: str
    epochs: int = 0
    features: str = "D"
    fraction: float = 1.0
    fold: int = 0

    def __post_init__(self) -> None:
        model_name(self.label, "a training's label")

    def command(self, *, dataset: Path, work: Path) -> list[str]:
        """Arguments of `python -m surrogate` that train the variant."""
        options = {name: getattr(self, name) for name in ("label", "recipe", "features", "fraction", "fold")}
        options |= {"dataset": dataset, "threads": 1, "runs": work / "runs", "models": work / "models"}
        options |= {"epochs": self.epochs} if self.epochs else {}
        flags = [word for name, value in options.items() for word in (f"--{name}", str(value))]
        return ["train", self.architecture, *flags]

    def identity(self, data: TrajectoryDataset) -> TrainingIdentity:
        """Identity of the training, the backend excepted."""
        recipe = Recipe.load(self.recipe).with_overrides(epochs=self.epochs or None)
        split = data.split().with_fraction(self.fraction, self.fold)
        return Run(self.architecture, data, split, recipe, self.features).identity


def train_variants(
    variants: Mapping[Key, Variant],
    *,
    dataset: Path,
    work: Path,
    models: Path,
    out: Path,
    jobs: int,
    publish: Callable[[dict[Key, dict[str, Any]]], None],
) -> dict[Key, dict[str, Any]]:
    """Train the variants that are not trained yet, in their order; return the results of `collect` by place.

    Args:
        variants: The variants by their places in the result.
        dataset: Data set file.
        work: Folder in which the trainings of this study are kept.
        models: Folder of published models; one that was trained in the same way stands for a variant.
        out: Result file of the study, whose trainings are kept.
        jobs: Trainings at a time.
        publish: Called with the results by place, once at the start and after each training.

    Raises:
        typer.Exit: A training was stopped; the same call resumes.
        FileNotFoundError: The data set file does not exist.
        ValueError: A training in `work` has another data set, split or recipe.
        RuntimeError: A training failed.
    """
    if not dataset.is_file():
        raise FileNotFoundError(f"data set {str(dataset)!r} not found; `make dataset` makes it")
    data = TrajectoryDataset.load(dataset)
    earlier = {training["training"]: training for training in earlier_trainings(out)}
    done: dict[Key, dict[str, Any]] = {}
    for key, variant in variants.items():
        if (identity := variant.identity(data).digest) in earlier:
            done[key] = earlier[identity]
        elif folder := kept_folder(variant, data, work=work, models=models):
            taken = {"taken_from": folder.name} if folder.parent == models else {}
            done[key] = collect(variant, data, folder) | taken
    waiting = {variant.label: key for key, variant in variants.items() if key not in done}
    publish(done)
    print(f"{len(waiting)} of {len(variants)} trainings to do, {jobs} at a time", flush=True)

    failed = []
    with ThreadPool(jobs) as pool:
        commands = {label: variants[key].command(dataset=dataset, work=work) for label, key in waiting.items()}
        for label, status in pool.imap_unordered(lambda item: run_training(*item, work / "runs"), commands.items()):
            if status:
                failed.append(status)
                continue
            key = waiting[label]
            done[key] = collect(variants[key], data, work / "models" / label)
            publish(done)
            print(f"{len(done)} of {len(variants)} trainings done", flush=True)
    if any(status != STOPPED for status in failed):
        raise RuntimeError(f"a training failed; its log is in {str(work / 'runs')!r}")
    if failed:
        print("stopped; the same command resumes")
        raise typer.Exit(STOPPED)
    return done


def run_training(label: str, command: list[str], runs: Path) -> tuple[str, int]:
    """Label and status of a training in a process of its own, whose output is appended to `RUNS/LABEL/log.txt`."""
    if (runs / STOP_FILE).exists():
        return label, STOPPED
    print(f"{label}: started", flush=True)
    (runs / label).mkdir(parents=True, exist_ok=True)
    with (runs / label / "log.txt").open("a", encoding="utf-8") as log:
        command = [sys.executable, "-m", "surrogate", *command]
        status = subprocess.run(command, stdout=log, stderr=log, check=False).returncode
    print(f"{label}: {f'ended with status {status}, see {log.name}' if status else 'done'}", flush=True)
    return label, status


def collect(variant: Variant, data: TrajectoryDataset, folder: Path) -> dict[str, Any]:
    """Learning curve, held-out errors, cost and identity of a trained variant.

    If a published model stands for the variant, `train_variants` adds its name as `taken_from`.
    """
    model = read_model(folder)
    kept = ("mse", "mae", "dtw_rmse", "validation_mse", "epochs", "best_epoch", "hours", "training_trajectories")
    curve = {name: model["history"][name] for name in ("epoch", "validation_mse")}
    return {**{name: model[name] for name in kept}, "training": variant.identity(data).digest, "history": curve}


def kept_folder(variant: Variant, data: TrajectoryDataset, *, work: Path, models: Path) -> Path | None:
    """Model directory with the weights of a variant, on any backend: its own, or a published one that is trained alike.

    Raises:
        ValueError: Its own directory holds another training.
    """
    identity, own = variant.identity(data), work / "models" / variant.label
    if not (own / "run.json").is_file():
        published = sorted(path.parent for path in models.glob(f"{variant.architecture}*/run.json"))
        alike = (folder for folder in published if not differences(read_identity(folder), identity, but=("backend",)))
        return next(alike, None)
    if differing := differences(read_identity(own), identity, but=("backend",)):
        raise ValueError(
            f"training {variant.label!r} must come from {variant.architecture}, recipe {variant.recipe!r} and the data "
            f"set of digest {data.sha256[:12]}; received one of another {', '.join(differing)}: remove {str(own)!r} to "
            "train it again"
        )
    return own


def earlier_trainings(out: Path) -> list[dict[str, Any]]:
    """Earlier results of `collect`, anywhere in the result file of a study; empty if there is no such file."""
    trainings: list[dict[str, Any]] = []

    def see(record: dict[str, Any]) -> dict[str, Any]:
        trainings.extend([record] if "training" in record else [])
        return record

    if out.is_file():
        json.loads(out.read_text(encoding="utf-8"), object_hook=see)
    return trainings

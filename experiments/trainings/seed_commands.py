"""Print the commands that train and publish the missing seeds, each on one core, in the order of their models.

The 18 paper models are trained by the recipe `swift`. The input representations A to D are trained by the recipe and
the number of epochs of `experiments/configs/feature_sets.toml`, which are the same for all four. Each line trains one
seed in the working folder, resumes it if it was interrupted, and copies what `make ranking` reads to its folder.
"""

from __future__ import annotations

import shlex
from pathlib import Path

from experiments import common
from experiments.paper.model_comparison import REFERENCE
from experiments.trainings.feature_sets import KEYS
from experiments.trainings.ranking import EXPECTED, INPUTS, found_seeds
from surrogate.architectures.naming import paper_names
from surrogate.data.dataset import TrajectoryDataset

KEPT = ("run.json", "recipe.toml", "history.csv", "metrics.json", "test_errors.csv")
"""Files of a training that are stored for each seed: what the ranking reads, without weights."""
WORK = Path("results/seeds")


def trainings(configs: Path) -> dict[str, list[str]]:
    """Arguments of `surrogate train` by the name of each model and input representation, without its seed."""
    settings = common.read_config(configs / "feature_sets.toml", *KEYS)
    found = {name: [name, "--recipe", "swift"] for name in paper_names()}
    for features, (label,) in INPUTS.items():
        given = ["--recipe", settings["recipe"], "--features", features]
        given += ["--epochs", str(settings["epochs"])] if settings["epochs"] else []
        found[label] = [REFERENCE, *given]
    return found


def command(name: str, seed: int, arguments: list[str], dataset: Path, seeds: Path) -> str:
    """One shell command that trains a seed, copies it to its place and adds it to the sums."""
    label, place = f"{name}-seed-{seed}", seeds / name / f"seed-{seed}"
    flags = ["--seed", str(seed), "--label", label, "--dataset", str(dataset), "--threads", "1"]
    train = ["surrogate", "train", *arguments, *flags, "--runs", str(WORK / "runs"), "--models", str(WORK / "models")]
    steps = [
        train,
        ["mkdir", "-p", str(place)],
        ["cp", *(str(WORK / "models" / label / file) for file in KEPT), str(place)],
        ["python", "tools/sums.py", str(seeds.parent), str(place)],
    ]
    return " && ".join(map(shlex.join, steps))


def study(dataset: Path, seeds: Path, configs: Path) -> None:
    """Print one command for each missing seed."""
    data = TrajectoryDataset.load(dataset)
    found, _ = found_seeds(seeds, data.sha256)
    for name, arguments in trainings(configs).items():
        present = {one["seed"] for one in found.get(name, ())}
        for seed in range(EXPECTED):
            if seed not in present:
                print(command(name, seed, arguments, dataset, seeds))

"""What training achieves: error against core minutes of training.

The record of a training holds validation errors only; the held-out error is measured once, at its end. The learning
curve of a training therefore shows its validation error. The test error over core minutes is one point for each
training of the reference architecture: the published model, and those trained for shorter and longer, by the paper's
recipe, or on more data. The study reads `history.csv`, `metrics.json` and `run.json` of these models.

The models were trained on processors of different speed. Where `experiments.trainings.training_speed` measured the cost
of a batch for a recipe and an architecture, the minutes are those of the batches on that one machine, without
validation. Otherwise they are those that the training took.
"""

from pathlib import Path
from typing import Any

import numpy as np

from experiments.common import dataset_digest
from experiments.paper.model_comparison import REFERENCE, minutes_to, outdated, paper_mse, published, read_model
from experiments.trainings.training_speed import batch_seconds, epoch_seconds
from surrogate.architectures.naming import names

BUDGETS = (
    *(f"M1-concat-{epochs}-epochs" for epochs in (8, 15, 60)),
    *("M1-concat-paper", "M1-concat-inputs-C", "M1-concat-large"),
)
"""Further trainings of the reference architecture, which `make more-models` publishes."""


def trained(folder: Path, batch: float | None = None) -> dict[str, Any]:
    """One published model: its learning curve, and its held-out error at the end; `batch` is the seconds of one."""
    found = read_model(folder)
    history = found["history"]
    if batch is not None:
        each = epoch_seconds(found["training_trajectories"], found["recipe"], batch)
        history["cpu_seconds"] = [epoch * each for epoch in history["epoch"]]
        found["core_seconds"] = history["cpu_seconds"][-1]
    return {
        "name": folder.name,
        "recipe": found["recipe"]["name"],
        "epochs": found["epochs"],
        "training_trajectories": found["training_trajectories"],
        "core_minutes": found["core_seconds"] / 60.0,
        "test_mse": found["mse"],
        "minutes_to_paper_mse": minutes_to(history, paper_mse()),
        "history": {
            "core_minutes": [seconds / 60.0 for seconds in history["cpu_seconds"]],
            "best_mse": np.minimum.accumulate(history["validation_mse"]).tolist(),
        },
    }


def study(dataset: Path, models: Path, training_speed: Any = None) -> dict[str, Any]:
    """Collect the published trainings, and list the missing ones."""
    lineages = published(models)
    old = outdated(lineages, dataset_digest(dataset), models)
    batch = batch_seconds(training_speed)
    runs = {
        name: trained(models / name, batch.get((one.recipe["name"], one.architecture)))
        for name, one in lineages.items()
        if name in (*names(), *BUDGETS) and name not in old
    }
    absent = [name for name in (*names(), *BUDGETS) if name not in runs]
    return {
        "paper_mse": paper_mse(),
        "core_minutes": {name: run["core_minutes"] for name, run in runs.items()},
        "minutes_to_paper_mse": runs[REFERENCE]["minutes_to_paper_mse"] if REFERENCE in runs else None,
        "models": [run for name, run in runs.items() if name in names()],
        "beside": [runs[name] for name in BUDGETS if name in runs],
        "missing": absent,
        "outdated": old,
    }

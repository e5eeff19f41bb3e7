"""What training achieves: error against core minutes of training.

The record of a training holds validation errors only; the held-out error is measured once, at its end. The learning
curve of a training therefore shows its validation error. The test error over core minutes is one point for each
training of the reference architecture: the published model, and those trained for shorter and longer, by the paper's
recipe, or on more data. The study reads `history.csv`, `metrics.json` and `run.json` of these models.

The models were trained on processors of different speed. Their minutes are those of their batches on one machine,
without validation, where `experiments.trainings.training_speed` measured them.
"""

from pathlib import Path
from typing import Any

import numpy as np

from experiments.common import dataset_digest
from experiments.paper.model_comparison import REFERENCE, outdated, paper_mse, published, read_model
from surrogate.architectures.naming import names

BUDGETS = (
    *(f"M1-concat-{epochs}-epochs" for epochs in (8, 15, 60)),
    *("M1-concat-paper", "M1-concat-inputs-C", "M1-concat-large"),
)
"""Further trainings of the reference architecture, which `make more-models` publishes."""


def trained(folder: Path, speed: Any) -> dict[str, Any]:
    """One published model: its learning curve, and its held-out error at the end."""
    found = read_model(folder, speed)
    history = found["history"]
    return {
        "name": folder.name,
        "recipe": found["recipe"]["name"],
        "epochs": found["epochs"],
        "training_trajectories": found["training_trajectories"],
        "core_minutes": found["core_seconds"] / 60.0,
        "test_mse": found["mse"],
        "minutes_to_paper_mse": found["minutes_to_paper_mse"],
        "history": {
            "core_minutes": [seconds / 60.0 for seconds in history["cpu_seconds"]],
            "best_mse": np.minimum.accumulate(history["validation_mse"]).tolist(),
        },
    }


def study(dataset: Path, models: Path, training_speed: Any = None) -> dict[str, Any]:
    """Collect the published trainings, and list the missing ones."""
    lineages = published(models)
    old = outdated(lineages, dataset_digest(dataset), models)
    shown = [name for name in lineages if name in (*names(), *BUDGETS) and name not in old]
    runs = {name: trained(models / name, training_speed) for name in shown}
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

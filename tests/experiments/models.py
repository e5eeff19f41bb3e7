"""Model directories of trainings that never ran, and hidden protocols that the solver computes quickly."""

import json

import numpy as np

from experiments.cases import hidden_protocols

RECIPE = {"name": "swift", "batch_size": 20}
SPLIT = {"seed": 0, "train": [0, 1], "validation": [2], "test": [3, 4]}
COLUMNS = (
    "mse",
    "mae",
    "dtw_rmse",
    "nmae_percent",
    "pull_off_force_percent",
    "pull_off_time_percent",
    "hysteresis_percent",
    "native_pull_off_force_percent",
    "resolution_floor_percent",
)


def write_model(folder, mse=1.0, *, recipe=RECIPE, split=SPLIT, **run):
    """A model directory with everything but weights; all its errors have the same mean."""
    folder.mkdir(parents=True)
    test = {name: {"mean": mse, "median": 0.9 * mse, "p90": 2 * mse, "max": 3 * mse} for name in COLUMNS}
    metrics = {"parameters": 10, "test": test, "epochs": 2, "best_epoch": 2}
    metrics["cpu_seconds"] = None if "device" in run else 120.0
    settings = {"architecture": "-".join(folder.name.split("-")[:2]), "features": "D", "backend": "tensorflow"}
    settings |= {"recipe": recipe, "versions": {}, "training_trajectories": 48, "cpu_seconds": 120.0}
    contents = {"split.json": split, "metrics.json": metrics, "run.json": settings | run}
    for name, document in contents.items():
        (folder / name).write_text(json.dumps(document), encoding="utf-8")
    rows = "epoch,learning_rate,train_mse,validation_mse,cpu_seconds\n1,1e-4,0.2,0.3,60\n2,1e-4,0.1,4e-4,120\n"
    (folder / "history.csv").write_text(rows, encoding="utf-8")
    return folder


def write_training(folder, variant, data, mse=1.0):
    """The model directory of a variant, trained on a data set."""
    from surrogate.training.recipe import Recipe

    recipe = Recipe.load(variant.recipe).with_overrides(epochs=variant.epochs or None).as_dict()
    run = {"dataset_sha256": data.sha256, "features": variant.features, "architecture": variant.architecture}
    write_model(folder, mse, recipe=recipe, **run)
    data.split().with_fraction(variant.fraction, variant.fold).save(folder / "split.json")


def shallow(count, ratio):
    """In place of `hidden_protocols`: the shallowest of forty times as many."""
    columns = hidden_protocols(40 * count, ratio)
    rows = np.argsort(columns["peak_indentation"])[:count]
    return {name: values[rows] for name, values in columns.items()}

"""What training buys: error against core minutes of training, and against the solver seconds of the trajectories.

Only reads: `history.csv`, `metrics.json` and `run.json` of every published model; for the number of trajectories, the
published study of data efficiency (models trained on shares of the data set), where there is one.

Usage: `python -m experiments.training_cost [--models DIR] [--shares FILE] [--out FILE]`.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem.dataset_file import load_dataset
from experiments.measuring import MEASUREMENTS, plain
from experiments.studies import DATASET, MODELS, write_result
from experiments.surrogate_cost import missing, published

OUT = MEASUREMENTS / "training_cost.json"
SHARES = Path("published/data_efficiency.json")


def learning(path: Path) -> dict[str, list[float]]:
    """Core minutes and validation errors after each epoch, and the best so far."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {name: [float(row[name]) for row in rows] for name in ("cpu_seconds", "validation_mse", "validation_mae")}
    return {
        "core_minutes": [seconds / 60.0 for seconds in columns["cpu_seconds"]],
        "validation_mse": columns["validation_mse"],
        "validation_mae": columns["validation_mae"],
        "best_mse": np.minimum.accumulate(columns["validation_mse"]).tolist(),
    }


def trained(folder: Path) -> dict[str, Any]:
    """One published model."""
    run, metrics = (json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) for name in ("run", "metrics"))
    return {
        "name": folder.name,
        "training_trajectories": run["training_trajectories"],
        "core_minutes": run["cpu_seconds"] / 60.0,
        "test": metrics["test"],
        "history": learning(folder / "history.csv"),
    }


def shares(path: Path, seconds_each: float) -> list[dict[str, Any]]:
    """Test error against trajectories and the solver seconds they took; empty where not published."""
    if not path.is_file():
        return []
    content = json.loads(path.read_text(encoding="utf-8"))
    points = [(content["full"]["training_trajectories"], content["full"]["mse"], 0.0)]
    points += [(one["trajectories"], one["mse_mean"], one["mse_sd"]) for one in content["shares"]]
    return [
        {"trajectories": count, "solver_seconds": count * seconds_each, "mse": mse, "mse_sd": deviation}
        for count, mse, deviation in sorted(points)
    ]


def main(
    models: Annotated[Path, typer.Option(help="Where trained models are.")] = MODELS,
    dataset: Annotated[Path, typer.Option(help="Data set file.")] = DATASET,
    share_file: Annotated[Path, typer.Option("--shares", help="Published study of data efficiency.")] = SHARES,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Collect what is published; name what is missing."""
    data = load_dataset(dataset)
    seconds_each = float(data.scalars["solver_seconds"].mean())
    absent = missing(models)
    found = shares(share_file, seconds_each)
    if not found:
        absent.append(str(share_file))
    content = {
        "seconds_per_trajectory": seconds_each,
        "models": [trained(models / name) for name in published(models)],
        "shares": found,
        "missing": absent,
    }
    write_result(out, "training_cost", plain(content))
    print(f"missing: {', '.join(absent) or 'nothing'}")


if __name__ == "__main__":
    typer.run(main)

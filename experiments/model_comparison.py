"""The trained models side by side: errors, sizes, learning curves, costs, and which of the eighteen are missing.

Reads the published model directories; trains and evaluates nothing. Source: the paper's section "Model-family
selection" and its appendices on conditioning and learning curves.

Usage: `python -m experiments.model_comparison [--models DIR] [--out FILE]`.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Annotated, Any

import typer

from experiments import studies
from surrogate.architectures.naming import CONDITIONINGS, FAMILIES, names

OUT = studies.RESULTS / "model_comparison.json"
METRICS = ("mse", "mae", "dtw_rmse")


def read_history(path: Path) -> dict[str, list[float]]:
    """Epochs and errors of a `history.csv`."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) for row in rows] for name in ("epoch", "train_mse", "validation_mse")}


def read_model(folder: Path) -> dict[str, Any]:
    """What a model directory says about its training and its held-out errors."""
    metrics = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    history = read_history(folder / "history.csv")
    return {
        "parameters": metrics["parameters"],
        "test": metrics["test"],
        **{name: metrics["test"][name]["mean"] for name in METRICS},
        "validation_mse": min(history["validation_mse"]),
        "epochs": metrics["epochs"],
        "best_epoch": metrics["best_epoch"],
        "hours": metrics["cpu_seconds"] / 3600.0,
        "backend": run["backend"],
        "training_trajectories": run["training_trajectories"],
        "history": history,
    }


def comparison(found: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Ranks by held-out MSE; a comparison that needs a missing model is null."""
    ranking = sorted(found, key=lambda name: found[name]["mse"])
    best = {}
    for family in FAMILIES:
        members = {conditioning: f"{family}-{conditioning}" for conditioning in CONDITIONINGS}
        complete = all(name in found for name in members.values())
        best[family] = min(members, key=lambda c: found[members[c]]["mse"]) if complete else None
    complete = len(found) == len(names())
    families = list(dict.fromkeys(name.split("-")[0] for name in ranking))
    longest = max(found, key=lambda name: found[name]["hours"])
    return {
        "ranking": ranking,
        "best": ranking[0] if complete else None,
        "second_family": families[1] if complete else None,
        "best_conditioning": best,
        "longest_training": longest if complete else None,
        "longest_training_hours": found[longest]["hours"] if complete else None,
        "training_hours": sum(one["hours"] for one in found.values()),
        "most_epochs": max(one["epochs"] for one in found.values()),
    }


def main(
    models: Annotated[Path, typer.Option(help="Where trained models are.")] = studies.MODELS,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Collect what is published."""
    found = {name: read_model(models / name) for name in names() if (models / name / "metrics.json").is_file()}
    if not found:
        raise FileNotFoundError(f"no trained model in {str(models)!r}; `make models` trains the eighteen")
    missing = [name for name in names() if name not in found]
    content = {"models": found, "missing": missing, "expected": len(names()), "comparison": comparison(found)}
    studies.write_result(out, "model_comparison", content)
    print(f"{len(found)} of {len(names())} models published" + (f"; missing: {', '.join(missing)}" if missing else ""))


if __name__ == "__main__":
    typer.run(main)

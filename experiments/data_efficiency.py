"""How the held-out error grows as training trajectories are taken away, in five nested families of subsets.

Scaling statistics come from each subset alone; validation and test stay what they are for the published model, which is
the point at 100 %. Trains up to 35 models, hours; continues where it was interrupted. The result file is published.
Source: the paper's section "Model-family selection" and its appendix on training-set size.

Usage: `python -m experiments.data_efficiency [--config FILE] [--dataset FILE] [--models DIR] [--out FILE]`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from experiments import studies
from experiments.model_comparison import read_model
from experiments.trainings import WORK, Variant, collect, is_trained, train_variants
from surrogate.dataset import TrajectoryDataset
from surrogate.queue import STOPPED

CONFIG = studies.CONFIGS / "data_efficiency.toml"
OUT = Path("published/data_efficiency.json")


def variants(config: dict[str, Any]) -> dict[tuple[float, int], Variant]:
    """One training for each percentage and fold, all percentages of a fold before the next fold."""
    if len(config["percents"]) != len(config["epochs"]):
        raise ValueError(f"epochs must be as many as percents; received {config['epochs']!r}")
    return {
        (percent, fold): Variant(
            label=f"share-{percent:g}-fold-{fold}",
            architecture=config["architecture"],
            recipe=config["recipe"],
            epochs=epochs,
            fraction=percent / 100.0,
            fold=fold,
        )
        for fold in range(config["folds"])
        for percent, epochs in zip(config["percents"], config["epochs"], strict=True)
    }


def whole_part(config: dict[str, Any], data: TrajectoryDataset, models: Path) -> dict[str, Any]:
    """The published model of the whole training part, which must have been trained as the shares are.

    Its number of epochs is its own, as theirs are.

    Raises:
        FileNotFoundError: it is not published.
        ValueError: it comes from another data set, split or recipe.
    """
    folder = models / config["architecture"]
    if not (folder / "run.json").is_file():
        raise FileNotFoundError(
            f"no trained model at {str(folder)!r}; `make models ONLY={config['architecture']}` trains it"
        )
    found = read_model(folder)
    published = Variant(
        label=config["architecture"],
        architecture=config["architecture"],
        recipe=config["recipe"],
        epochs=found["recipe"]["epochs"],
    )
    is_trained(published, data, folder)
    return {name: found[name] for name in ("mse", "training_trajectories", "history")}


def share(percent: float, folds: list[dict[str, Any]]) -> dict[str, Any]:
    """Mean and sample standard deviation of the held-out MSE over the folds of one percentage."""
    mse = np.array([fold["mse"] for fold in folds])
    return {
        "percent": percent,
        "trajectories": folds[0]["training_trajectories"],
        "mse_mean": float(mse.mean()),
        "mse_sd": float(mse.std(ddof=1)) if mse.size > 1 else 0.0,
        "folds": folds,
    }


def main(
    config: Annotated[Path, typer.Option(help="TOML file.")] = CONFIG,
    dataset: Annotated[Path, typer.Option(help="Data set file.")] = studies.DATASET,
    models: Annotated[Path, typer.Option(help="Where the model of the whole training part is.")] = studies.MODELS,
    work: Annotated[Path, typer.Option(help="Where the trainings are kept.")] = WORK / "data_efficiency",
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Train the subsets, or go on, and write the result when all are trained."""
    settings = studies.read_config(config, "architecture", "recipe", "percents", "epochs", "folds", "jobs")
    wanted = variants(settings)
    full = whole_part(settings, TrajectoryDataset.load(dataset), models)
    if not train_variants(list(wanted.values()), dataset=dataset, work=work, jobs=settings["jobs"]):
        print("stopped; the same command resumes")
        raise typer.Exit(STOPPED)
    shares = [
        share(percent, [collect(wanted[percent, fold], work) for fold in range(settings["folds"])])
        for percent in settings["percents"]
    ]
    means = [full["mse"], *(one["mse_mean"] for one in shares)]
    summary = {"grows_as_data_shrink": bool(np.all(np.diff(means) > 0.0)), "smallest_over_full": means[-1] / means[0]}
    content = {"config": settings, "summary": summary, "full": full, "shares": shares}
    studies.write_result(out, "data_efficiency", content)


if __name__ == "__main__":
    typer.run(main)

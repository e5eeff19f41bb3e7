"""How the held-out error grows with fewer training trajectories, in five nested families of subsets.

The scaling statistics come from each subset alone. Validation and test parts are those of the whole training part, the
point at 100 %. The study trains up to 36 models in hours, continues after an interruption, and keeps the trainings that
the result file already holds. That file is published; without it, all models are trained again. Source: the paper's
section "Model-family selection" and its appendix on training-set size.
"""

from pathlib import Path
from typing import Any

import numpy as np

from experiments import common
from experiments.common import Config, Dataset, Models
from experiments.trainings.variants import WORK, Variant, Work, train_variants

WHOLE = (100, 0)
"""Percentage and fold of the whole training part."""


def variants(config: dict[str, Any]) -> dict[tuple[float, int], Variant]:
    """One training for each percentage and fold: the whole training part first, then fold by fold.

    Raises:
        ValueError: The configuration does not give one number of epochs for each percentage.
    """
    if len(config["percents"]) != len(config["epochs"]):
        raise ValueError(f"epochs must be as many as percents; received {config['epochs']!r}")
    plans = [(*WHOLE, config["whole_epochs"])]
    for fold in range(config["folds"]):
        plans += [(percent, fold, epochs) for percent, epochs in zip(config["percents"], config["epochs"], strict=True)]
    return {
        (percent, fold): Variant(
            label="whole" if (percent, fold) == WHOLE else f"share-{percent:g}-fold-{fold}",
            architecture=config["architecture"],
            recipe=config["recipe"],
            epochs=epochs,
            fraction=percent / 100.0,
            fold=fold,
        )
        for percent, fold, epochs in plans
    }


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


def study(
    config: Config, dataset: Dataset, models: Models, out: Path, *, work: Work = WORK / "data_efficiency"
) -> None:
    """Train on the subsets, or continue; the result file is written after each training.

    The values of its summary are `None` while a training is missing.
    """
    planned, every = variants(config), range(config["folds"])

    def publish(trained: dict[tuple[float, int], dict[str, Any]]) -> None:
        if WHOLE not in trained or len(trained) == 1:
            return
        present = {pct: [trained[pct, fold] for fold in every if (pct, fold) in trained] for pct in config["percents"]}
        shares = [share(percent, folds) for percent, folds in present.items() if folds]
        means = [trained[WHOLE]["mse"], *(row["mse_mean"] for row in shares)]
        summary = {"folds": config["folds"], "grows_as_data_shrink": bool(np.all(np.diff(means) > 0.0))}
        complete = len(trained) == len(planned)
        result = {"config": config, "complete": complete, "summary": summary if complete else dict.fromkeys(summary)}
        common.write_result(out, "data_efficiency", result | {"full": trained[WHOLE], "shares": shares})

    train_variants(planned, dataset=dataset, models=models, work=work, out=out, jobs=config["jobs"], publish=publish)

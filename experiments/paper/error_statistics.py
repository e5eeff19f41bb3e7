"""Error statistics of a model on the held-out trajectories: quartiles by force MSE, distributions, correlations.

The study reads the errors of a model directory and predicts nothing. Source: the paper's section "Physically
interpretable error statistics".
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from experiments.common import Config, Dataset, Models, require_dataset
from experiments.published_models import by_recipe
from experiments.run_folders import read_table
from surrogate.training.identity import read_identity

QUARTILES = ("Q1", "Q2", "Q3", "Q4")
PERCENTS = ("pull_off_force_percent", "hysteresis_percent", "pull_off_time_percent", "nmae_percent")


def quartile_of(mse: np.ndarray) -> np.ndarray:
    """Quartile, 0 to 3, of each trajectory by the rank of its force MSE, (n,); the sizes differ by one at most."""
    quartile = np.empty(mse.size, dtype=np.int64)
    for index, rows in enumerate(np.array_split(np.argsort(mse, kind="stable"), 4)):
        quartile[rows] = index
    return quartile


def moments(values: np.ndarray) -> dict[str, float]:
    """Mean and sample standard deviation."""
    return {"mean": float(values.mean()), "sd": float(values.std(ddof=1)) if values.size > 1 else 0.0}


def statistics(errors: dict[str, np.ndarray]) -> dict[str, Any]:
    """Quartiles, overall statistics and rank correlations of the errors, each column of shape (trajectories,)."""
    quartile = quartile_of(errors["mse"])
    table = {
        name: {"count": int(np.sum(quartile == q))}
        | {column: moments(errors[column][quartile == q]) for column in ("mse", *PERCENTS)}
        for q, name in enumerate(QUARTILES)
    }
    overall = {
        column: {
            **moments(errors[column]),
            "median": float(np.median(errors[column])),
            "p90": float(np.percentile(errors[column], 90)),
            "largest": float(errors[column].max()),
        }
        for column in errors
        if column != "trajectory"
    }
    pairs = {
        "pull_off_and_hysteresis": ("pull_off_force_percent", "hysteresis_percent"),
        "pull_off_and_nmae": ("pull_off_force_percent", "nmae_percent"),
        "mse_and_nmae": ("mse", "nmae_percent"),
        "mse_and_pull_off": ("mse", "pull_off_force_percent"),
    }
    correlations = {
        name: float(spearmanr(*(errors[column] for column in pair)).statistic) for name, pair in pairs.items()
    }
    means = {column: [table[name][column]["mean"] for name in QUARTILES] for column in PERCENTS}
    worst = np.sort(errors["mse"])[::-1][: -(-quartile.size // 10)]
    return {
        "trajectories": int(quartile.size),
        "quartiles": table,
        "overall": overall,
        "spearman": correlations,
        "grows_with_quartile": {column: values == sorted(values) for column, values in means.items()},
        "waveform_orders_more": correlations["mse_and_nmae"] > correlations["mse_and_pull_off"],
        "squared_error_of_worst_tenth_percent": float(100.0 * worst.sum() / errors["mse"].sum()),
        "per_trajectory": {name: errors[name].tolist() for name in ("mse", *PERCENTS)}
        | {"quartile": quartile.tolist()},
    }


def held_out_errors(folder: Path, dataset: Path) -> dict[str, np.ndarray]:
    """Errors in a model directory. They must be those of the held-out part of the given data set.

    Raises:
        FileNotFoundError: A file does not exist.
        ValueError: The model was trained on another data set, or the errors are of other trajectories.
    """
    errors = read_table(folder, "test_errors")
    require_dataset(folder, dataset)
    held_out = read_identity(folder).split.test
    if not np.array_equal(errors["trajectory"], held_out):
        raise ValueError(
            f"the errors of {str(folder)!r} must be of the {len(held_out)} trajectories that its split holds "
            f"out, in its order; received {len(errors['trajectory'])} others: `surrogate evaluate` writes them again"
        )
    return errors


def study(config: Config, models: Models, dataset: Dataset) -> dict[str, Any]:
    """Error statistics of one model by each recipe with which it is published, `None` for the other."""
    labels = by_recipe(config["model"], models)
    trained = {recipe: statistics(held_out_errors(models / label, dataset)) for recipe, label in labels.items()}
    return {"config": config, **dict.fromkeys(("paper", "swift")), **trained}

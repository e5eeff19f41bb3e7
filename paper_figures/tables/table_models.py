"""Table: the trained models with their parameters, held-out errors, epochs and cost; missing models are named.

Models that were trained differently (another recipe, more data, fewer epochs) follow the 18 paper models; their names
state the difference.
"""

from typing import Any

from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number

HEADER = [
    "Model",
    "Parameters",
    "MSE",
    "MAE",
    "DTW-RMSE",
    "NMAE, median (%)",
    "Pull-off, median (%)",
    "Hysteresis, median (%)",
    "Recipe",
    "Trajectories",
    "Epochs",
    "Core seconds",
    "Batch (ms)",
]
MEDIANS = ("nmae", "pull_off_force", "hysteresis")


def row(name: str, found: dict[str, Any], batch: str = "-") -> list[str]:
    """One row for a model."""
    return [
        name,
        f"{found['parameters']:,}",
        *(number(found[metric], 3) for metric in ("mse", "mae", "dtw_rmse")),
        *(number(found["test"][f"{name}_percent"]["median"], 2) for name in MEDIANS),
        found["recipe"]["name"],
        f"{found['training_trajectories']:,}",
        str(found["epochs"]),
        f"{found['core_seconds']:.0f}",
        batch,
    ]


def paper_row(paper: dict[str, Any]) -> list[str]:
    """Row of the paper's best model, with the numbers that the paper states."""
    return [
        f"{paper['name']}, paper",
        f"{paper['parameters']:,}",
        *(number(paper[name], 3) for name in ("mse", "mae", "dtw_rmse")),
        *(number(paper[key], 2) if (key := f"{name}_percent") in paper else "-" for name in MEDIANS),
        *["-"] * 5,
    ]


def compose(model_comparison: Any, training_speed: Any = None, model_forces: Any = None) -> Table:
    """Write the table, best model first."""
    ranking = model_comparison["comparison"]["ranking"]
    note = models_style.missing_note(model_comparison["missing"])
    words = " ".join(
        [
            caption("models"),
            *([f"{note[0].upper()}{note[1:]}."] if note else []),
            *model_comparison["outdated"].values(),
            models_style.forces_note(model_forces),
        ]
    )
    measured = training_speed["models"].items() if training_speed else ()
    batches = {name: number(1e3 * one["seconds_per_batch"]["median"], 2) for name, one in measured}
    cells = [
        paper_row(drawing.paper_values("reference_model")),
        *(row(name, model_comparison["models"][name], batches.get(name, "-")) for name in ranking),
        *(row(name, found) for name, found in model_comparison["beside"].items()),
    ]
    return Table(HEADER, cells, words.strip())

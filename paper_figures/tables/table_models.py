"""Table: the trained models with their parameters, held-out errors, epochs and cost; missing models are named.

A model that was also trained by the paper's recipe has two rows, of which this comes first. Models that were trained
differently (more data, fewer epochs, other inputs) follow; their names state the difference.
"""

from collections.abc import Callable
from typing import Any

from experiments.paper.model_comparison import PAPER_TRAINED
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number

SIZES = drawing.paper_values("structure")["sizes"]
MEDIANS = ("nmae", "pull_off_force", "hysteresis")
COLUMNS: dict[str, Callable[[str, dict[str, Any]], str]] = {
    "Model": lambda name, _: name,
    "Parameters": lambda _, found: f"{found['parameters']:,}",
    "Sizes": lambda name, _: SIZES.get(name.split("-")[0], {"how": "-"})["how"],
    "MSE": lambda _, found: number(found["mse"]),
    "MAE": lambda _, found: number(found["mae"]),
    "DTW-RMSE": lambda _, found: number(found["dtw_rmse"]),
    "NMAE, median (%)": lambda _, found: number(found["test"]["nmae_percent"]["median"], 2),
    "Pull-off, median (%)": lambda _, found: number(found["test"]["pull_off_force_percent"]["median"], 2),
    "Hysteresis, median (%)": lambda _, found: number(found["test"]["hysteresis_percent"]["median"], 2),
    "Recipe": lambda _, found: found["recipe"]["name"],
    "Trajectories": lambda _, found: f"{found['training_trajectories']:,}",
    "Epochs": lambda _, found: str(found["epochs"]),
    "Core seconds": lambda _, found: "on a GPU" if found["core_seconds"] is None else f"{found['core_seconds']:.0f}",
}
"""Column heads, and functions that write the cell of a model from the name under which it is published."""


def row(name: str, found: dict[str, Any], batch: str = "-") -> list[str]:
    """One row for a model."""
    return [*(cell(name, found) for cell in COLUMNS.values()), batch]


def compose(model_comparison: Any, training_speed: Any = None, model_forces: Any = None) -> Table:
    """Write the table, the best model by the paper's recipe first."""
    note = models_style.missing_note(model_comparison["missing"])
    words = " ".join(
        [
            caption("models", sizes="; ".join(f"{name} ({one['how']}), {one['what']}" for name, one in SIZES.items())),
            *([f"{note[0].upper()}{note[1:]}."] if note else []),
            *model_comparison["outdated"].values(),
            models_style.forces_note(model_forces),
        ]
    )
    measured = training_speed["models"].items() if training_speed else ()
    batches = {name: number(1e3 * one["seconds_per_batch"]["median"], 2) for name, one in measured}
    theirs = (training_speed or {}).get("by_paper_recipe", {}).items()
    batches |= {PAPER_TRAINED[name]: number(1e3 * one["median"], 2) for name, one in theirs}
    by_recipe = models_style.trained_by_paper_recipe(model_comparison)
    paper = drawing.paper_values("reference_model")
    errors = [number(paper[name], 3) for name in ("mse", "mae", "dtw_rmse")]
    errors += [number(paper[key], 2) if (key := f"{name}_percent") in paper else "-" for name in MEDIANS]
    cells = [[f"{paper['name']}, paper", f"{paper['parameters']:,}", "-", *errors, *["-"] * 5]]
    models = {name: model_comparison["models"][name] for name in model_comparison["comparison"]["ranking"]}
    for name in sorted(models, key=lambda name: by_recipe.get(name, models[name])["mse"]):
        both = {PAPER_TRAINED[name]: by_recipe.get(name), name: models[name]}
        cells += [row(label, one, batches.get(label, "-")) for label, one in both.items() if one]
    shown = {one[0] for one in cells}
    cells += [row(name, found) for name, found in model_comparison["beside"].items() if name not in shown]
    return Table([*COLUMNS, "Batch (ms)"], cells, words.strip())

"""Table: the trained models with their parameters, held-out errors, epochs and cost; missing models are named.

A model that was also trained by the paper's recipe has two rows, of which this comes first. Models that were trained
differently (more data, fewer epochs, other inputs) follow; their names state the difference.
"""

from collections.abc import Callable
from typing import Any

from experiments.published_models import PAPER_TRAINED
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number

SIZES = drawing.paper_values("structure")["sizes"]
MEDIANS = ("nmae", "pull_off_force", "hysteresis")
COLUMNS: dict[str, Callable[[str, dict[str, Any]], str]] = {
    "Model": lambda name, _: name,
    "Parameters": lambda _, model: f"{model['parameters']:,}",
    "Sizes": lambda name, _: SIZES.get(name.split("-")[0], {"how": "-"})["how"],
    "MSE": lambda _, model: number(model["mse"]),
    "MAE": lambda _, model: number(model["mae"]),
    "DTW-RMSE": lambda _, model: number(model["dtw_rmse"]),
    "NMAE, median (%)": lambda _, model: number(model["test"]["nmae_percent"]["median"], 2),
    "Pull-off, median (%)": lambda _, model: number(model["test"]["pull_off_force_percent"]["median"], 2),
    "Hysteresis, median (%)": lambda _, model: number(model["test"]["hysteresis_percent"]["median"], 2),
    "Recipe": lambda _, model: model["recipe"]["name"],
    "Trajectories": lambda _, model: f"{model['training_trajectories']:,}",
    "Epochs": lambda _, model: str(model["epochs"]),
    "Trained by": lambda _, model: f"{model['backend']}, {model['device']}" + " †" * bool(model["removed"]),
    "Core seconds": lambda _, model: "-" if model["core_seconds"] is None else f"{model['core_seconds']:.0f}",
}
"""Column heads, and functions that write the cell of a model from the name under which it is published."""


def row(name: str, model: dict[str, Any], batch: str = "-") -> list[str]:
    """One row for a model."""
    return [*(cell(name, model) for cell in COLUMNS.values()), batch]


def compose(model_comparison: Any, training_speed: Any = None, model_forces: Any = None) -> Table:
    """Write the table, the best model by the paper's recipe first."""
    note = models_style.missing_note(model_comparison["missing"])
    text = " ".join(
        [
            caption("models", sizes="; ".join(f"{name} ({net['how']}), {net['what']}" for name, net in SIZES.items())),
            *([f"{note[0].upper()}{note[1:]}."] if note else []),
            *model_comparison["outdated"].values(),
            models_style.forces_note(model_forces),
        ]
    )
    measured = training_speed["models"].items() if training_speed else ()
    batches = {name: number(1e3 * speed["seconds_per_batch"]["median"], 2) for name, speed in measured}
    theirs = (training_speed or {}).get("by_paper_recipe", {}).items()
    batches |= {PAPER_TRAINED[name]: number(1e3 * speed["median"], 2) for name, speed in theirs}
    by_recipe = models_style.trained_by_paper_recipe(model_comparison)
    paper = drawing.paper_values("reference_model")
    errors = [number(paper[name], 3) for name in ("mse", "mae", "dtw_rmse")]
    errors += [number(paper[key], 2) if (key := f"{name}_percent") in paper else "-" for name in MEDIANS]
    cells = [[f"{paper['name']}, paper", f"{paper['parameters']:,}", "-", *errors, *["-"] * 6]]
    models = {name: model_comparison["models"][name] for name in model_comparison["comparison"]["ranking"]}
    for name in sorted(models, key=lambda name: by_recipe.get(name, models[name])["mse"]):
        both = {PAPER_TRAINED[name]: by_recipe.get(name), name: models[name]}
        cells += [row(label, model, batches.get(label, "-")) for label, model in both.items() if model]
    shown = {line[0] for line in cells}
    cells += [row(name, model) for name, model in model_comparison["beside"].items() if name not in shown]
    return Table([*COLUMNS, "Batch (ms)"], cells, text.strip())

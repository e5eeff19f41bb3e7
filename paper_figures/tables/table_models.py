"""Table: the trained models with their parameters, held-out errors, epochs and cost; missing models are named.

A model that was also trained by the paper's recipe has two rows, of which this comes first. Models that were trained
differently (more data, fewer epochs, other inputs) follow; their names state the difference.
"""

from typing import Any

from experiments.paper.model_comparison import PAPER_TRAINED
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number

HEADER = [
    "Model",
    "Parameters",
    "Sizes",
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
    """One row for a model, named as it is published."""
    sizes = drawing.paper_values("structure")["sizes"].get(name.split("-")[0])
    return [
        name,
        f"{found['parameters']:,}",
        sizes["how"] if sizes else "-",
        *(number(found[metric], 3) for metric in ("mse", "mae", "dtw_rmse")),
        *(number(found["test"][f"{name}_percent"]["median"], 2) for name in MEDIANS),
        found["recipe"]["name"],
        f"{found['training_trajectories']:,}",
        str(found["epochs"]),
        "on a GPU" if found["core_seconds"] is None else f"{found['core_seconds']:.0f}",
        batch,
    ]


def compose(model_comparison: Any, training_speed: Any = None, model_forces: Any = None) -> Table:
    """Write the table, the best model by the paper's recipe first."""
    sizes = drawing.paper_values("structure")["sizes"]
    note = models_style.missing_note(model_comparison["missing"])
    words = " ".join(
        [
            caption("models", sizes="; ".join(f"{name} ({one['how']}), {one['what']}" for name, one in sizes.items())),
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
    return Table(HEADER, cells, words.strip())

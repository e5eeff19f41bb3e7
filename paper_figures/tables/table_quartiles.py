"""Table: held-out errors by quartile of the force MSE, in the paper and here; the caption gives overall statistics."""

from typing import Any

from experiments.paper_numbers import paper_rows
from paper_figures.figures.figure_7 import QUARTILES
from paper_figures.style import models_style
from paper_figures.style.writing import Table, caption, number

COLUMNS = {
    "mse": (r"Force MSE ($\times10^{-3}$)", 1e3, 3),
    "pull_off_force_percent": ("Pull-off force error (%)", 1.0, 2),
    "hysteresis_percent": ("Hysteresis error (%)", 1.0, 2),
    "pull_off_time_percent": ("Pull-off time error (%)", 1.0, 2),
}


def compose(error_statistics: Any) -> Table:
    """Write the table: for each quartile the paper's errors, those of a training by its recipe, and by `swift`."""
    paper, rows = {row["quartile"]: row for row in paper_rows("quartiles")}, []
    words = {"paper": "its recipe", "swift": "swift"}
    by_recipe = {words[name]: errors for name, errors in models_style.recipes(error_statistics).items()}
    for name in QUARTILES:
        sources = {"paper": {c: {stat: paper[name][f"{c}_{stat}"] for stat in ("mean", "sd")} for c in COLUMNS}}
        sources |= {source: errors["quartiles"][name] for source, errors in by_recipe.items()}
        for source, errors in sources.items():
            pairs = ([number(f * errors[c][stat], d) for stat in ("mean", "sd")] for c, (_, f, d) in COLUMNS.items())
            rows.append([name if source == "paper" else "", source, *map(r" $\pm$ ".join, pairs)])
    medians = (
        f"{errors['overall']['pull_off_force_percent']['median']:.2g} and "
        f"{errors['overall']['hysteresis_percent']['median']:.2g} % by {recipe}"
        for recipe, errors in by_recipe.items()
    )
    leading = next(iter(by_recipe.values()))
    note = caption(
        "quartiles",
        model=error_statistics["config"]["model"],
        trajectories=leading["trajectories"],
        medians=", ".join(medians),
        floor=leading["overall"]["resolution_floor_percent"],
    )
    header = ["Quartile", "Source", *(heading for heading, _, _ in COLUMNS.values())]
    return Table(header, rows, note)

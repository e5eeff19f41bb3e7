"""Table: held-out errors by quartile of the force MSE, in the paper and here; the caption gives overall statistics."""

from typing import Any

from experiments.paper_numbers import paper_rows
from paper_figures.figures.figure_7 import QUARTILES
from paper_figures.style.writing import Table, caption, number

COLUMNS = {
    "mse": (r"Force MSE ($\times10^{-3}$)", 1e3, 3),
    "pull_off_force_percent": ("Pull-off force error (%)", 1.0, 2),
    "hysteresis_percent": ("Hysteresis error (%)", 1.0, 2),
    "pull_off_time_percent": ("Pull-off time error (%)", 1.0, 2),
}


def cell(mean: float, sd: float, digits: int) -> str:
    """Mean and standard deviation, as text."""
    return rf"{number(mean, digits)} $\pm$ {number(sd, digits)}"


def rows(content: dict[str, Any]) -> list[list[str]]:
    """Rows for each quartile: the paper's, those of a training by its recipe, and those by ours."""
    paper, found = {row["quartile"]: row for row in paper_rows("quartiles")}, []
    by_recipe = {"its recipe": content["by_paper_recipe"], "our recipe": content}
    for name in QUARTILES:
        theirs = paper[name]
        sources = {"paper": {c: {part: theirs[f"{c}_{part}"] for part in ("mean", "sd")} for c in COLUMNS}}
        sources |= {source: one["quartiles"][name] for source, one in by_recipe.items() if one}
        for source, one in sources.items():
            cells = [cell(f * one[c]["mean"], f * one[c]["sd"], d) for c, (_, f, d) in COLUMNS.items()]
            found.append([name if source == "paper" else "", source, *cells])
    return found


def compose(error_statistics: Any) -> Table:
    """Write the table."""
    by_recipe = {"its recipe": error_statistics["by_paper_recipe"], "our recipe": error_statistics}
    medians = (
        f"{one['overall']['pull_off_force_percent']['median']:.2g} and "
        f"{one['overall']['hysteresis_percent']['median']:.2g} % by {recipe}"
        for recipe, one in by_recipe.items()
        if one
    )
    words = caption(
        "quartiles",
        model=error_statistics["config"]["model"],
        trajectories=error_statistics["trajectories"],
        medians=", ".join(medians),
        floor=error_statistics["overall"]["resolution_floor_percent"],
    )
    header = ["Quartile", "Source", *(heading for heading, _, _ in COLUMNS.values())]
    return Table(header, rows(error_statistics), words)

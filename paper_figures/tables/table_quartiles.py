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
    """Two rows for each quartile: the paper's and ours."""
    paper, found = {row["quartile"]: row for row in paper_rows("quartiles")}, []
    for name in QUARTILES:
        theirs, ours = paper[name], content["quartiles"][name]
        found.append(
            [name, "paper"]
            + [cell(f * theirs[f"{c}_mean"], f * theirs[f"{c}_sd"], d) for c, (_, f, d) in COLUMNS.items()]
        )
        found.append(
            ["", "here"] + [cell(f * ours[c]["mean"], f * ours[c]["sd"], d) for c, (_, f, d) in COLUMNS.items()]
        )
    return found


def compose(error_statistics: Any) -> Table:
    """Write the table."""
    overall = error_statistics["overall"]
    force, loop = (overall[f"{name}_percent"]["median"] for name in ("pull_off_force", "hysteresis"))
    floor = overall["resolution_floor_percent"]
    model, count = error_statistics["config"]["model"], error_statistics["trajectories"]
    words = caption("quartiles", model=model, trajectories=count, force=force, loop=loop, floor=floor)
    header = ["Quartile", "Source", *(heading for heading, _, _ in COLUMNS.values())]
    return Table(header, rows(error_statistics), words)

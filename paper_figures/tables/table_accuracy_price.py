"""Table: what draft, standard and reference cost over the paper's design."""

from typing import Any

from paper_figures.style.writing import Table, caption

ERRORS = {"pull_off_force": "Pull-off force", "hysteresis": "Hysteresis", "force": "Force history"}


def rows_of(levels: list[dict[str, Any]]) -> list[list[str]]:
    """One row for each accuracy; errors in percent as median / 90th / 99th percentile.

    Core-minutes are the solver's, scaled to the largest number of trajectories among the campaigns.
    """
    rows, whole = [], max(level["trajectories"] for level in levels)
    for level in levels:
        seconds = level["seconds"]
        row = [level["accuracy"], str(level["trajectories"]), str(level["failed"])]
        row += [f"{1e3 * seconds[name]:.1f}" for name in ("mean", "median", "p99")]
        row.append(f"{seconds['mean'] / 60.0 * whole:.1f}")
        for quantity in ERRORS:
            found = level.get("errors", {}).get(quantity)
            row.append(" / ".join(f"{100 * found[name]:.2g}" for name in ("median", "p90", "p99")) if found else "-")
        rows.append(row)
    return rows


def compose(accuracy_price: Any) -> Table:
    """Write the table."""
    compared = accuracy_price["levels"][0]["compared"]
    whole = max(level["trajectories"] for level in accuracy_price["levels"])
    sample = "all of them" if compared == whole else f"{compared} protocols that are a random sample of all"
    minutes = f"Core-minutes for {whole:,}"
    header = ["Accuracy", "Trajectories", "Failed", "Mean (ms)", "Median (ms)", "99th (ms)", minutes]
    return Table(
        [*header, *(f"{name} error (%)" for name in ERRORS.values())],
        rows_of(accuracy_price["levels"]),
        caption("accuracy-price", seed=accuracy_price["seed"], host=accuracy_price["host"], sample=sample),
    )

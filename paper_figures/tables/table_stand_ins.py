"""Table: where a simpler scene suffices, from the study `experiments.measurements.effects`."""

from typing import Any

from paper_figures.style.writing import Table, caption, number

OVER = {"tabor": r"$\mu$", "decades": "decades of retardation times"}


def compose(effects: Any) -> Table:
    """Write the table."""
    rows = [
        [row["stand_in"], row["instead_of"], OVER[row["over"]], *(number(row[name]) for name in ("low", "high"))]
        for row in effects["safe"]
    ]
    note = caption("stand-ins", tolerance=number(100.0 * effects["tolerance"]))
    return Table(["Stand-in", "Instead of", "Over", "Safe from", "Safe to"], rows, note)

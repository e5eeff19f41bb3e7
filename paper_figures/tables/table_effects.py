"""Tables: what each effect costs, from plain Hertz to a ten-term adhesive solid, and where a simpler scene suffices.

The tables read the measurement of `experiments.measurements.effects`.
"""

from collections.abc import Callable
from typing import Any

from paper_figures.style.writing import Table, caption, milliseconds, number, percent

SAFE = ["Stand-in", "Instead of", "Over", "Safe from", "Safe to"]
OVER = {"tabor": r"$\mu$", "decades": "decades of retardation times"}
COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Scene": lambda row: row["name"],
    r"$\mu$": lambda row: number(row["tabor"]),
    "Unknowns": lambda row: f"{row['unknowns']:.0f}",
    "Memory vectors": lambda row: str(row["memory_vectors"]),
    "Steps": lambda row: str(row["steps"]),
    "Time (ms), median (quartiles)": lambda row: milliseconds(row["seconds"]),
    "Time a step (µs)": lambda row: f"{1e6 * row['seconds_per_step']:.0f}",
    "Closed form": lambda row: row["closed_form"],
    "Difference (%)": lambda row: percent(row["error"]),
}
"""Column heads, and functions that write the cell of one scene."""


def compose(effects: Any) -> dict[str, Table]:
    """Write the tables."""
    first = Table(
        list(COLUMNS),
        [[cell(row) for cell in COLUMNS.values()] for row in effects["rows"]],
        caption("effects", path=effects["path"], host=effects["host"]),
    )
    second = Table(
        SAFE,
        [
            [row["stand_in"], row["instead_of"], OVER[row["over"]], *(number(row[name]) for name in ("low", "high"))]
            for row in effects["safe"]
        ],
        caption("stand-ins", tolerance=number(100.0 * effects["tolerance"])),
    )
    return {"effects": first, "stand-ins": second}

"""Tables: what each effect costs, from plain Hertz to a ten-term adhesive solid, and where a simpler scene suffices.

The tables read the measurement of `experiments.measurements.effects`.
"""

from collections.abc import Callable
from typing import Any

from paper_figures.style.writing import Table, milliseconds, number, percent

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
    path = effects["path"]
    first = Table(
        list(COLUMNS),
        [[cell(row) for cell in COLUMNS.values()] for row in effects["rows"]],
        f"One path of the sphere (depth {path['depth']:g}, from {path['start']:g}, in units of $\\mu h_0$; "
        f"{path['rate']:g} a retardation time; dwell {path['dwell']:g}) under scenes that add one effect at a time, at "
        f"standard accuracy, on {effects['host']}. The difference is the root mean square over the range of the force; "
        "for the limits, of long and of short range, it is a difference between laws of adhesion and not an error.",
    )
    second = Table(
        SAFE,
        [
            [row["stand_in"], row["instead_of"], OVER[row["over"]], *(number(row[name]) for name in ("low", "high"))]
            for row in effects["safe"]
        ],
        f"Where a simpler scene stands in for the full one with an error of the force of at most "
        f"{number(100.0 * effects['tolerance'])} % (root mean square over the range): adhesion of another range on the "
        "same path in units of $\\mu h_0$, over the Tabor parameter of the full scene; one relaxation process instead "
        "of ten around it, over the decades that those span. Limits are the outermost values computed that are safe.",
    )
    return {"effects": first, "stand-ins": second}

"""Table: how often `recommend` meets its tolerance, how often it simplifies a scene, and what that saves.

The table reads the measurement of `experiments.measurements.recommendations`.
"""

from collections.abc import Callable
from typing import Any

from paper_figures.style.writing import Table, caption, number, percent

COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Sample": lambda row: row["sample"],
    "Quantity": lambda row: row["quantity"].replace("pull_off_", "pull-off "),
    "Tolerance (%)": lambda row: percent(row["tolerance"], 3),
    "Simplified": lambda row: f"{row['simplified']} of {row['cases']}",
    "Kept of those simplified": lambda row: f"{row['kept']} of {row['simplified']}",
    "Worst error (%)": lambda row: percent(row["worst_error"]),
    "Without comparison": lambda row: f"{row['by_estimate']} of {row['cases']}",
    "Full (ms)": lambda row: milliseconds(row["full_seconds"]),
    "Recommended over full, median (largest)": lambda row: ratio_text(row["ratio"]),
    "Slower": lambda row: f"{row['slower']} of {row['simplified']}",
    "To recommend (ms)": lambda row: milliseconds(row["seconds"]),
}
"""Column heads, and functions that write the cell of one sample; '-' if nothing was simplified."""


def milliseconds(seconds: dict[str, float | None]) -> str:
    """Median seconds in milliseconds; '-' if there are none."""
    return "-" if seconds["median"] is None else number(1e3 * seconds["median"])


def ratio_text(ratio: dict[str, float | None]) -> str:
    """Median and largest ratio; '-' if there are none."""
    return "-" if ratio["median"] is None else f"{number(ratio['median'], 2)} ({number(ratio['largest'], 2)})"


def compose(recommendations: Any) -> Table:
    """Write the table."""
    return Table(
        list(COLUMNS),
        [[cell(row) for cell in COLUMNS.values()] for row in recommendations["results"]],
        caption("recommendations", accuracy=number(recommendations["accuracy"]), host=recommendations["host"]),
    )

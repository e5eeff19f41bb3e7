"""Table: how often `recommend` keeps its promise, how often it leaves something out, and what that saves.

Reads the measurement of `experiments.effects.recommendations`.
"""

from typing import Any

from paper_figures.style.writing import Table, number

HEADER = [
    "Sample",
    "Quantity",
    "Tolerance (%)",
    "Simplified",
    "Kept of those simplified",
    "Worst error (%)",
    "Without comparison",
    "Full (ms)",
    "Recommended over full, median (largest)",
    "Slower",
    "To recommend (ms)",
]


def row_of(row: dict[str, Any]) -> list[str]:
    """One sample, quantity and tolerance; seconds are medians, '-' where nothing was simplified."""
    ratio = row["ratio"]
    return [
        row["sample"],
        row["quantity"].replace("_", " "),
        number(100.0 * row["tolerance"]),
        f"{row['simplified']} of {row['cases']}",
        f"{row['kept']} of {row['simplified']}",
        "-" if row["worst_error"] is None else number(100.0 * row["worst_error"], 2),
        f"{row['by_estimate']} of {row['cases']}",
        "-" if row["full_seconds"]["median"] is None else number(1e3 * row["full_seconds"]["median"]),
        "-" if ratio["median"] is None else f"{number(ratio['median'], 2)} ({number(ratio['largest'], 2)})",
        f"{row['slower']} of {row['simplified']}",
        number(1e3 * row["seconds"]["median"]),
    ]


def compose(recommendations: Any) -> Table:
    """Write the table."""
    return Table(
        HEADER,
        [row_of(row) for row in recommendations["results"]],
        "The recommended scene against the full one on random samples: the paper's box, one ten times wider with "
        "random modulus ratios, ten-term solids, contacts without adhesion, and two loads with a partial unloading "
        f"between; both simulated to {number(recommendations['accuracy'])}. Kept: the error stayed "
        f"inside the tolerance. Seconds at standard accuracy. Measured on {recommendations['host']}.",
    )

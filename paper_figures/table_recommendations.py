"""Table: how often `recommend` keeps its promise, how often it leaves something out, and what that saves.

Reads the measurement of `experiments.recommendations`.
"""

from pathlib import Path
from typing import Annotated, Any

import typer

from paper_figures import drawing
from paper_figures.tables import TABLES, number, write_table

RESULT = Path("published/measurements/recommendations.json")
HEADER = [
    "Sample",
    "Quantity",
    "Tolerance (%)",
    "Kept",
    "Worst error (%)",
    "Simplified",
    "Without simulation",
    "Full (ms)",
    "Recommended (ms)",
    "To recommend (ms)",
]


def row_of(row: dict[str, Any]) -> list[str]:
    """One sample, quantity and tolerance; seconds are medians."""
    return [
        row["sample"],
        row["quantity"].replace("_", " "),
        number(100.0 * row["tolerance"]),
        f"{row['kept']} of {row['cases']}",
        number(100.0 * row["worst_error"], 2),
        f"{row['simplified']} of {row['cases']}",
        f"{row['by_estimate']} of {row['cases']}",
        *(number(1e3 * row[name]["median"]) for name in ("full_seconds", "simple_seconds", "seconds")),
    ]


def main(
    result: Annotated[Path, typer.Option(help="Measurement of the recommendations.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the table goes.")] = TABLES,
) -> None:
    """Write the table."""
    content = drawing.read_result(result, "make measure-recommendations")
    write_table(
        "recommendations",
        HEADER,
        [row_of(row) for row in content["results"]],
        "The recommended scene against the full one on random samples: the paper's box, one ten times wider with "
        f"random modulus ratios, and ten-term solids; both simulated to {number(content['accuracy'])}. Kept: the error "
        f"stayed inside the tolerance. Measured on {content['host']}.",
        folder,
    )


if __name__ == "__main__":
    typer.run(main)

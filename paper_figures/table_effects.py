"""Table: what each effect costs, from plain Hertz to a ten-term solid with adhesion.

Reads the measurement of `experiments.effects`.
"""

from pathlib import Path
from typing import Annotated, Any

import typer

from paper_figures import drawing
from paper_figures.tables import TABLES, number, write_table

RESULT = Path("published/measurements/effects.json")
HEADER = [
    "Scene",
    r"$\mu$",
    "Unknowns",
    "Memory vectors",
    "Steps",
    "Time (ms), median (quartiles)",
    "Time a step (µs)",
    "Closed form",
    "Difference (%)",
    "Files of its own",
]


def row_of(row: dict[str, Any]) -> list[str]:
    """One scene."""
    seconds = {name: number(1e3 * row["seconds"][name]) for name in ("median", "low", "high")}
    return [
        row["name"],
        number(row["tabor"]),
        f"{row['unknowns']:.0f}",
        str(row["memory_vectors"]),
        str(row["steps"]),
        f"{seconds['median']} ({seconds['low']}-{seconds['high']})",
        f"{1e6 * row['seconds_per_step']:.0f}",
        row["closed_form"],
        "-" if row["error"] is None else number(100.0 * row["error"], 2),
        ", ".join(f"{name}.py" for name in row["files"]),
    ]


def main(
    result: Annotated[Path, typer.Option(help="Measurement of the effects.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the table goes.")] = TABLES,
) -> None:
    """Write the table."""
    content = drawing.read_result(result, "make measure-effects")
    path = content["path"]
    write_table(
        "effects",
        HEADER,
        [row_of(row) for row in content["rows"]],
        f"One path of the sphere (depth {path['depth']:g}, from {path['start']:g}, in units of $\\mu h_0$; "
        f"{path['rate']:g} a retardation time; dwell {path['dwell']:g}) under scenes that add one effect at a time, at "
        f"standard accuracy, on {content['host']}. All scenes also run "
        + ", ".join(f"{name}.py" for name in content["shared_files"])
        + " of bem/. The difference is the root mean square over the range of the force; for the limits, of long and "
        "of short range, it is a difference between laws of adhesion and not an error.",
        folder,
    )


if __name__ == "__main__":
    typer.run(main)

"""Table: seconds and errors of every tool on the same held-out protocols.

Reads the measurement of `experiments.accuracy_cost`.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from paper_figures import drawing
from paper_figures.cost_style import paper_seconds
from paper_figures.tables import TABLES, number, write_table

RESULT = Path("published/measurements/accuracy_cost.json")
HEADER = ["Tool", "Setting", "Protocols", "Failed", "Time (ms), median (quartiles)", "Run to run (%)"]
ERRORS = {"pull_off_force": "Pull-off error (%)", "force": "Force error (%)", "hysteresis": "Hysteresis error (%)"}


def row_of(tool: dict[str, Any]) -> list[str]:
    """One tool; errors as median / 95th percentile, '-' where it does not answer."""
    seconds = tool["seconds"]
    cells = [tool["kind"], tool["setting"], str(tool["protocols"]), str(tool["failures"])]
    if seconds["median"] is None:
        cells += ["-", "-"]
    else:
        milliseconds = [number(1e3 * seconds[name]) for name in ("median", "low", "high")]
        cells.append(f"{milliseconds[0]} ({milliseconds[1]}-{milliseconds[2]})")
        totals = tool["run_totals"]
        cells.append(number(100.0 * np.ptp(totals) / np.median(totals), 2) if len(totals) > 1 else "-")
    for quantity in ERRORS:
        error = tool["errors"][quantity]
        answered = error["median"] is not None and error["median"] < 0.99
        cells.append(f"{number(100 * error['median'], 2)} / {number(100 * error['p95'], 2)}" if answered else "-")
    return cells


def main(
    result: Annotated[Path, typer.Option(help="Measurement of accuracy and cost.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the table goes.")] = TABLES,
) -> None:
    """Write the table."""
    content = drawing.read_result(result, "make measure-accuracy-cost")
    paper = ", ".join(f"{name} {number(seconds)} s" for name, seconds in paper_seconds().items())
    missing = f" Not published yet: {', '.join(content['missing'])}." if content["missing"] else ""
    write_table(
        "accuracy-cost",
        [*HEADER, *ERRORS.values()],
        [row_of(tool) for tool in content["tools"]],
        f"Every tool on {content['protocols']} held-out protocols (the paper's discretisation on the first "
        f"{content['baseline_protocols']}), one core of {content['host']}, median of {content['repeats']} runs; run to "
        "run is the range of the totals over their median. Errors are median / 95th percentile against a solution "
        f"refined to {number(content['truth_target'])}. The paper's own seconds: {paper}.{missing}",
        folder,
    )


if __name__ == "__main__":
    typer.run(main)

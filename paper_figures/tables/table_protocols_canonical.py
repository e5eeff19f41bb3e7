"""Table of the twelve canonical protocols: parameters, seconds of solver and surrogate, the paper's beside ours."""

from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from paper_figures.figures.figure_6 import RESULT
from paper_figures.style import drawing
from paper_figures.style.writing import TABLES, number, write_table
from paper_figures.tables.table_protocols_dataset import QUANTITIES

HEADER = [
    "Sample",
    *QUANTITIES.values(),
    "BEM, paper (s)",
    "BEM, here (s)",
    "M1-concat, paper (s)",
    "Keras call (s)",
    "predictor (s)",
    "predictor in a batch (s)",
    "pull-off error (%)",
    "hysteresis error (%)",
]


def row(regime: dict[str, Any]) -> list[str]:
    """One protocol."""
    seconds, paper, errors = regime["seconds"], regime["paper_seconds"], regime["errors_percent"]
    return [
        f"({regime['sample']})",
        *(number(regime["protocol"][name]) for name in QUANTITIES),
        number(paper["solver"], 4),
        number(seconds["solver"], 2),
        number(paper["surrogate"], 2),
        *(number(seconds[name], 2) for name in ("keras_call", "predictor", "predictor_batch")),
        *(number(errors[name], 2) for name in ("pull_off_force", "hysteresis")),
    ]


def main(
    result: Annotated[Path, typer.Option(help="Result file of the canonical regimes.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the table goes.")] = TABLES,
) -> None:
    """Write the table."""
    content = drawing.read_result(result, "make table-protocols-canonical")
    config, times = content["config"], content["times"]
    caption = (
        f"Protocols of figure 6 and what they cost: processor seconds of one thread, {times['host']}. Solver at "
        f"accuracy {config['accuracy']}; surrogate by the plain Keras call, by our predictor, and by our predictor per "
        f"trajectory of a batch of {times['config']['batch']}. Errors of {config['model']} on the measurement steps."
    )
    write_table("protocols-canonical", HEADER, [row(regime) for regime in content["regimes"]], caption, folder)


if __name__ == "__main__":
    run_main(main)

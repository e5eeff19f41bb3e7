"""Table of the trained models: parameters, held-out errors, epochs and cost; those missing are named."""

from pathlib import Path
from typing import Annotated, Any

import typer

from paper_figures import drawing, models_style
from paper_figures.figure_mse_mae import RESULT
from paper_figures.tables import TABLES, number, write_table

HEADER = [
    "Model",
    "Parameters",
    "MSE",
    "MAE",
    "DTW-RMSE",
    "Pull-off, median (%)",
    "Hysteresis, median (%)",
    "Epochs",
    "Hours",
]


def row(name: str, found: dict[str, Any]) -> list[str]:
    """One model."""
    return [
        name,
        f"{found['parameters']:,}",
        *(number(found[metric], 3) for metric in ("mse", "mae", "dtw_rmse")),
        *(number(found["test"][f"{c}_percent"]["median"], 2) for c in ("pull_off_force", "hysteresis")),
        str(found["epochs"]),
        number(found["hours"], 2),
    ]


def main(
    result: Annotated[Path, typer.Option(help="Result file of the model comparison.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the table goes.")] = TABLES,
) -> None:
    """Write the table, best model first."""
    content = drawing.read_result(result, "make table-models")
    paper = drawing.paper_values("reference_model")
    theirs = [
        f"{paper['name']}, paper",
        f"{paper['parameters']:,}",
        *(number(paper[m], 3) for m in ("mse", "mae", "dtw_rmse")),
    ]
    ranking = content["comparison"]["ranking"]
    note = models_style.missing_note(content["missing"])
    caption = "Held-out errors of the scaled force, best first; hours of one core." + (
        f" {note[0].upper()}{note[1:]}." if note else ""
    )
    cells = [theirs + ["-"] * 4, *(row(name, content["models"][name]) for name in ranking)]
    write_table("models", HEADER, cells, caption, folder)


if __name__ == "__main__":
    typer.run(main)

"""Table of the trained models: parameters, held-out errors, epochs and cost; those missing are named.

Models trained otherwise (another recipe, more data, fewer epochs) follow the eighteen and say how.
"""

from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from paper_figures.figures.figure_mse_mae import RESULT
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import TABLES, number, write_table

HEADER = [
    "Model",
    "Parameters",
    "MSE",
    "MAE",
    "DTW-RMSE",
    "NMAE, median (%)",
    "Pull-off, median (%)",
    "Hysteresis, median (%)",
    "Recipe",
    "Trajectories",
    "Epochs",
    "Core seconds",
    "Batch (ms)",
]
MEDIANS = ("nmae", "pull_off_force", "hysteresis")
SPEED = Path("published/measurements/training_speed.json")


def batch_milliseconds(speed: Path) -> dict[str, str]:
    """Milliseconds that a batch of training takes each architecture, all on one machine; none where not measured."""
    if not speed.is_file():
        return {}
    measured = drawing.read_result(speed, "make bench-training")["models"]
    return {name: number(1e3 * found["seconds_per_batch"]["median"], 2) for name, found in measured.items()}


def row(name: str, found: dict[str, Any], batch: str = "-") -> list[str]:
    """One model."""
    return [
        name,
        f"{found['parameters']:,}",
        *(number(found[metric], 3) for metric in ("mse", "mae", "dtw_rmse")),
        *(number(found["test"][f"{name}_percent"]["median"], 2) for name in MEDIANS),
        found["recipe"]["name"],
        f"{found['training_trajectories']:,}",
        str(found["epochs"]),
        f"{found['core_seconds']:.0f}",
        batch,
    ]


def paper_row(paper: dict[str, Any]) -> list[str]:
    """The paper's best model, as far as it tells."""
    return [
        f"{paper['name']}, paper",
        f"{paper['parameters']:,}",
        *(number(paper[name], 3) for name in ("mse", "mae", "dtw_rmse")),
        *(number(paper[key], 2) if (key := f"{name}_percent") in paper else "-" for name in MEDIANS),
        *["-"] * 5,
    ]


def main(
    result: Annotated[Path, typer.Option(help="Result file of the model comparison.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the table goes.")] = TABLES,
    speed: Annotated[Path, typer.Option(help="Result file of `make bench-training`, where there is one.")] = SPEED,
) -> None:
    """Write the table, best model first."""
    content = drawing.read_result(result, "make table-models")
    ranking = content["comparison"]["ranking"]
    note = models_style.missing_note(content["missing"])
    caption = " ".join(
        [
            "Held-out errors of the scaled force, best first; the errors of pull-off and hysteresis are on the "
            "measurement steps. Models with a suffix are trained otherwise and not among the eighteen. Core seconds "
            "are those of the processor that trained the model, the milliseconds of a batch all of one machine's core.",
            *([f"{note[0].upper()}{note[1:]}."] if note else []),
            *content["outdated"].values(),
        ]
    )
    batches = batch_milliseconds(speed)
    cells = [
        paper_row(drawing.paper_values("reference_model")),
        *(row(name, content["models"][name], batches.get(name, "-")) for name in ranking),
        *(row(name, found) for name, found in content["beside"].items()),
    ]
    write_table("models", HEADER, cells, caption, folder)


if __name__ == "__main__":
    run_main(main)

"""Cards: README.md of the data set and in each published model directory, and metadata in the Croissant format.

Every number comes from the published files: `run.json`, `recipe.toml`, `metrics.json` and `test_errors.csv` of a model
of the paper's kind, `run.json` and `measurements/pretrained_errors.json` of a pretrained one, and the attributes of the
data set. `make cards` writes the cards.

Usage: `python -m paper_figures.report.cards [--published DIR]`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("paper_figures.report.cards")

import json
import tomllib
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from bem.dataset.file import Dataset, load_dataset
from experiments.measurements.cases import regions
from experiments.paper.error_statistics import read_errors
from paper_figures.report.croissant import LICENCE, METADATA, croissant
from paper_figures.report.data_card import data_card
from paper_figures.report.pretrained_card import pretrained_card
from paper_figures.style.writing import number
from surrogate.export.onnx_file import seal_folder

CARD = "README.md"
ERRORS = {"pull_off_force_percent": "Pull-off force (%)", "hysteresis_percent": "Hysteresis (%)"}


def spread(values: np.ndarray) -> str:
    """Median and 90th percentile, as text."""
    return f"{number(float(np.median(values)), 2)} / {number(float(np.quantile(values, 0.9)), 2)}"


def region_rows(errors: dict[str, np.ndarray], protocols: dict[str, np.ndarray]) -> list[str]:
    """Rows of the table of errors by region, as Markdown.

    Args:
        errors: Columns of `test_errors.csv`, each of shape (tests,).
        protocols: Quantities of the same trajectories, each of shape (tests,).
    """
    return [
        f"| {words} | {np.count_nonzero(rows)} | {number(float(errors['mse'][rows].mean()), 2)} | "
        + " | ".join(spread(errors[name][rows]) for name in ERRORS)
        + " |"
        for words, rows in regions(protocols).items()
    ]


def model_card(folder: Path, dataset: Dataset) -> str:
    """The card of one published model, in Markdown."""
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    recipe = tomllib.loads((folder / "recipe.toml").read_text(encoding="utf-8"))
    parameters = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))["parameters"]
    errors = read_errors(folder / "test_errors.csv")
    rows = np.searchsorted(dataset.columns["index"], errors["trajectory"])
    protocols = {name: values[rows] for name, values in dataset.protocols.items()}
    low_high = {name: (low, high) for name, (low, high) in dataset.attributes["ranges"].items()}
    ratio = dataset.attributes["modulus_ratio"]
    ranges = "\n".join(f"| {name} | {low:g} to {high:g} |" for name, (low, high) in low_high.items())
    source = f"the training part of the {len(dataset):,} of `published/dataset.h5`"
    if run["extra_dataset_sha256"]:
        source += " and those of another data set, see the command"
    floor = spread(errors["resolution_floor_percent"])
    return f"""\
# {folder.name}

A network that predicts the force history of a rigid sphere on a soft adhesive viscoelastic half-space, from the
protocol and the Tabor parameter. It imitates the contact solver `bem`. `make cards` writes this file.

- **Architecture**: {run["architecture"]}, {parameters:,} parameters, inputs {run["features"]}.
- **Trained on**: {run["training_trajectories"]:,} trajectories, {source}.
- **Recipe**: `{recipe["name"]}`, seed {run["seed"]}, {run["epochs"]} epochs; weights of epoch {run["best_epoch"]}.
- **Command**: `{run["command"]}`
- **Use**: `surrogate predict {folder.name}`, or `surrogate.load("{folder.name}")` from Python.
- **Licence**: {LICENCE}, as the software.

## Errors on the test set

{len(errors["mse"]):,} trajectories that the training did not see. The mean squared error is of the scaled force, as in
training; percentages are median / 90th percentile, against the same trajectories on the measurement steps. The steps
themselves miss the solver's peak by {floor} %, which no model can repair.

| Region | Trajectories | Mean squared error | {" | ".join(ERRORS.values())} |
| --- | --- | --- | --- | --- |
{chr(10).join(region_rows(errors, protocols))}

## Range

| Quantity | Trained for |
| --- | --- |
{ranges}
| modulus_ratio | {ratio:g} |

Units: h0, retardation times, and h0 per retardation time. A prediction outside says so.

## Not for

- Another material: the modulus ratio {ratio:g} is built into the weights.
- Histories that are not a ramp, a dwell and a ramp back to the start, or with other than 100 to 140 measurement steps.
- Peaks narrower than a measurement step, and decisions that the 90th percentiles above would change: use `bem`.
"""


def main(
    published: Annotated[Path, typer.Option(help="Folder of the published files.")] = Path("published"),
) -> None:
    """Write the cards of the data set and of each published model, and the metadata."""
    path = published / "dataset.h5"
    dataset = load_dataset(path)
    written = [published / METADATA, published / CARD]
    write_whole(written[0], json.dumps(croissant(path, dataset), indent=1) + "\n")
    write_whole(written[1], data_card(path, dataset))
    for run in sorted((published / "models").glob("*/run.json")):
        written.append(run.parent / CARD)
        write_whole(written[-1], model_card(run.parent, dataset))
    for run in sorted((published / "pretrained").glob("*/run.json")):
        measured = json.loads((published / "measurements" / "errors_by_place.json").read_text(encoding="utf-8"))
        written.append(run.parent / CARD)
        write_whole(written[-1], pretrained_card(run.parent, measured))
        seal_folder(run.parent)
    typer.echo(f"{len(written)} files written: {METADATA}, and {CARD} of the data set and of each model")


if __name__ == "__main__":
    run_main(main)

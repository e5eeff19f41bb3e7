"""Cards: README.md of the data set and in each published model directory, and metadata in the Croissant format.

Every number comes from the published files: `run.json`, `recipe.toml`, `metrics.json` and `test_errors.csv` of the
model, and the attributes of the data set. `make cards` writes the cards.

Usage: `python -m paper_figures.report.cards [--published DIR]`.
"""

import json
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from bem.dataset.file import Dataset, load_dataset
from paper_figures.report.croissant import LICENCE, METADATA, croissant
from paper_figures.style.writing import number

CARD = "README.md"
REGIONS = {
    "tabor": ("Tabor parameter", (0.2, 1.0, 2.0, 3.2)),
    "unloading_rate": ("Unloading rate", (0.1, 10.0, 100.0, 1000.0)),
    "peak_indentation": ("Peak indentation", (2.0, 20.0, 50.0, 100.0)),
}
"""Quantities by which errors are listed: their names, and the bounds of their regions."""
SHARES = (0.0, 0.1, 0.5, 0.9, 1.0)
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
    everything = np.ones(len(errors["mse"]), dtype=bool)
    regions = {"all": everything}
    for name, (words, edges) in REGIONS.items():
        # Corners of the design lie a little outside its stated range.
        place = np.digitize(protocols[name], edges[1:-1])
        regions |= {f"{words} {low:g} to {high:g}": place == i for i, (low, high) in enumerate(pairwise(edges))}
    return [
        f"| {words} | {np.count_nonzero(rows)} | {number(float(errors['mse'][rows].mean()), 2)} | "
        + " | ".join(spread(errors[name][rows]) for name in ERRORS)
        + " |"
        for words, rows in regions.items()
        if rows.any()
    ]


def model_card(folder: Path, dataset: Dataset) -> str:
    """The card of one published model, in Markdown."""
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    recipe = tomllib.loads((folder / "recipe.toml").read_text(encoding="utf-8"))
    parameters = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))["parameters"]
    table = np.genfromtxt(folder / "test_errors.csv", delimiter=",", names=True)
    errors = {name: table[name] for name in table.dtype.names}
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


def data_card(path: Path, dataset: Dataset) -> str:
    """The card of the data set, in Markdown."""
    about, scalars = dataset.attributes, dataset.scalars
    lines = [f"| {name} | {low:g} to {high:g} |" for name, (low, high) in about["ranges"].items()]
    kinds = {name: scalars[name] for name in ("pull_off_force", "hysteresis", "max_compression", "end_force")}
    quantiles = [
        f"| {name} | "
        + " | ".join(number(float(np.quantile(values, share)), 3) for share in (0.0, 0.1, 0.5, 0.9, 1.0))
        + " |"
        for name, values in kinds.items()
    ]
    attached = np.mean(scalars["end_force"] > 0.5 * scalars["pull_off_force"])
    jumping = np.mean(scalars["jump_count"] > 0)
    minutes = scalars["solver_seconds"].sum() / 60.0
    newline = chr(10)
    return f"""\
# Force histories of soft, adhesive, viscoelastic contacts

`{path.name}`, with metadata in `{METADATA}`. `make cards` writes this file.

## About

{len(dataset):,} force histories of a rigid sphere that is pressed into, held on and pulled off a soft adhesive
viscoelastic half-space; the training data of the models beside it, and those of the paper computed again.

## Physics

Lennard-Jones attraction; a standard linear solid of modulus ratio {about["modulus_ratio"]:g}; a boundary
element method on a half-space (`docs/theory.md`). Each history is a ramp, a dwell and a ramp back to
the start, drawn from the design `{about["design"]}`:

| Quantity | Range |
| --- | --- |
{newline.join(lines)}

Units: h0, retardation times, and h0 per retardation time; forces in pi R dgamma, tension positive.

## Format and size

HDF5, {path.stat().st_size / 1e6:.0f} MB: the force at {dataset.force.shape[1]} measurement steps of each history,
its protocol, scalars and jumps, each array with its unit.
`docs/dataset.md` lists the arrays and reads them with h5py, pandas and xarray.

| Scalar | least | 10 % | median | 90 % | largest |
| --- | --- | --- | --- | --- | --- |
{newline.join(quantiles)}

## Limits

- {100 * jumping:.0f} % of the histories hold a jump. {100 * attached:.0f} % end above half of their pull-off
  force: the sphere is still attached, and the pull-off force is the largest so far.
- The measurement steps can miss a narrow peak; the scalars are those of the solver's own, finer history.
- One material, one shape, no noise: not for a solid of another modulus ratio.

## Generation

`{about["command"]}`,
in {minutes:.2g} core-minutes of the solver on {about["host"]}. Accuracy `{about["accuracy"]}`, seed {about["seed"]},
revision {about["git_revision"]}.

## Licence and citation

{LICENCE}, as the software; the weights of the models have the same licence. Cite as in `CITATION.cff`.
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
    typer.echo(f"{len(written)} files written: {METADATA}, and {CARD} of the data set and of each model")


if __name__ == "__main__":
    run_main(main)

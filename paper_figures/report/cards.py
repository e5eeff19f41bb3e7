"""Cards: README.md in each published model directory, and the metadata of the data set in the Croissant format.

Every number comes from the published files: `run.json`, `recipe.toml`, `metrics.json` and `test_errors.csv` of the
model, and the attributes of the data set. `make cards` writes the cards. The format of the metadata is Croissant 1.0 of
ML Commons.

Usage: `python -m paper_figures.report.cards [--published DIR]`.
"""

import hashlib
import json
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from bem.dataset.file import Dataset, load_dataset
from paper_figures.style.writing import number

CARD = "README.md"
METADATA = "dataset.croissant.json"
LICENCE = "BSD-3-Clause"
REGIONS = {
    "tabor": ("Tabor parameter", (0.2, 1.0, 2.0, 3.2)),
    "unloading_rate": ("Unloading rate", (0.1, 10.0, 100.0, 1000.0)),
    "peak_indentation": ("Peak indentation", (2.0, 20.0, 50.0, 100.0)),
}
"""Quantities by which errors are listed: their names, and the bounds of their regions."""
ERRORS = {"pull_off_force_percent": "Pull-off force (%)", "hysteresis_percent": "Hysteresis (%)"}
ARRAYS = {
    "fms/force": "force at the measurement steps, in pi R dgamma, tension positive",
    "protocols/tabor": "Tabor parameter",
    "protocols/peak_indentation": "largest indentation, in h0",
    "protocols/loading_rate": "speed of loading, in h0 per retardation time",
    "protocols/dwell_time": "time held at the peak, in retardation times",
    "protocols/unloading_rate": "speed of unloading, in h0 per retardation time",
    "scalars/pull_off_force": "largest force while unloading, in pi R dgamma",
    "scalars/hysteresis": "loop area, in h0 pi R dgamma",
}

CROISSANT_TERMS = (
    "citeAs",
    "column",
    "equivalentProperty",
    "extract",
    "field",
    "fileProperty",
    "fileObject",
    "fileSet",
    "format",
    "includes",
    "isLiveDataset",
    "jsonPath",
    "key",
    "md5",
    "parentField",
    "path",
    "recordSet",
    "references",
    "regex",
    "repeated",
    "replace",
    "samplingRate",
    "separator",
    "source",
    "subField",
    "transform",
)
CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "sc": "https://schema.org/",
    "dct": "http://purl.org/dc/terms/",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    **{name: f"cr:{name}" for name in CROISSANT_TERMS},
}
"""The standard context of Croissant 1.0."""


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


def croissant(path: Path, dataset: Dataset) -> dict[str, Any]:
    """Metadata of the data set in the Croissant format."""
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": "adhesive-viscoelastic-contact-trajectories",
        "description": (
            f"{len(dataset):,} force histories of a rigid sphere pressed into, held on and pulled off an adhesive "
            f"viscoelastic half-space of modulus ratio {dataset.attributes['modulus_ratio']:g}, computed by a boundary "
            "element method. One HDF5 file; docs/dataset.md describes it."
        ),
        "license": f"https://spdx.org/licenses/{LICENCE}.html",
        "version": "1.0.0",
        "datePublished": "2026-11-20",
        "creator": {"@type": "sc:Organization", "name": "the contact-trajectories contributors"},
        "citeAs": "See CITATION.cff.",
        "variableMeasured": [
            {
                "@type": "sc:PropertyValue",
                "name": name,
                "description": f"{words}; shape {dataset.columns[name].shape}",
            }
            for name, words in ARRAYS.items()
        ],
        "distribution": [
            {
                "@type": "cr:FileObject",
                "@id": path.name,
                "name": path.name,
                "contentUrl": path.name,
                "contentSize": f"{path.stat().st_size} B",
                "encodingFormat": "application/x-hdf5",
                "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            }
        ],
    }


def main(
    published: Annotated[Path, typer.Option(help="Folder of the published files.")] = Path("published"),
) -> None:
    """Write the card of each published model and the metadata of the data set."""
    path = published / "dataset.h5"
    dataset = load_dataset(path)
    written = [published / METADATA]
    write_whole(written[0], json.dumps(croissant(path, dataset), indent=1) + "\n")
    for run in sorted((published / "models").glob("*/run.json")):
        written.append(run.parent / CARD)
        write_whole(written[-1], model_card(run.parent, dataset))
    typer.echo(f"{len(written)} files written: {METADATA} and {CARD} of each model")


if __name__ == "__main__":
    run_main(main)

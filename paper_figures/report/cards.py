"""Cards: README.md of the data set, of the models and of each pretrained one, and metadata in the Croissant format.

Every number comes from the published files: `run.json`, `metrics.json` and the errors of a model of the paper's kind,
`run.json` and `errors.json` of a pretrained one, and the attributes of the data set.
The texts are the templates beside this module. `make cards` writes the cards.

Usage: `python -m paper_figures.report.cards [--published DIR]`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("paper_figures.report.cards")

import json
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from bem._support.text_files import read_json
from bem._support.wording import markdown_table
from bem.dataset.file import Dataset, load_dataset
from experiments.cases import regions
from experiments.run_folders import read_table
from paper_figures.report.data_card import METADATA, croissant, data_card, filled, range_rows
from paper_figures.style.writing import number, table_rows
from paper_figures.tables.table_surrogates import PLACE_HEADS, ends_text, place_rows
from surrogate.files import STAGES

CARD = "README.md"
USES = {
    "model.onnx": '`surrogate predict {name}`, or `surrogate.load("{name}")` from Python.',
    "model.weights.h5": '`surrogate.load("{name}", backend="keras")` from Python; `surrogate export` writes ONNX.',
    "run.json": "for comparison; the weights are not published. `surrogate train {architecture} --features {features} "
    "--recipe {recipe}{budget} --seed {seed} --label {name} --threads 1` trains such a model.",
}
"""How a model is used, by the first of these files that is published."""
ERRORS = ("pull_off_force_percent", "hysteresis_percent")


def spread(values: np.ndarray) -> str:
    """Median and 90th percentile, as text."""
    return f"{number(float(np.median(values)), 2)} / {number(float(np.quantile(values, 0.9)), 2)}"


def model_card(folder: Path, dataset: Dataset) -> str:
    """The card of one published model, in Markdown, with a table of its errors by region."""
    run, metrics = (json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) for name in ("run", "metrics"))
    errors = read_table(folder, "test_errors")
    rows = np.searchsorted(dataset.columns["index"], errors["trajectory"])
    source = f"the training part of the {len(dataset):,} of `published/dataset.h5`"
    if run["extra_dataset_sha256"]:
        source += " and those of another data set, see the command"
    parts = regions({name: values[rows] for name, values in dataset.protocols.items()})
    cells = [
        (
            region,
            np.count_nonzero(at),
            number(float(errors["mse"][at].mean()), 2),
            *(spread(errors[n][at]) for n in ERRORS),
        )
        for region, at in parts.items()
    ]
    recipe = run["recipe"]
    facts = {name: run[name] for name in ("architecture", "features", "seed")} | {"recipe": recipe["name"]}
    facts["budget"] = "" if "plateau" in recipe else f" --epochs {run['epochs']}"  # a plateau ends the training itself
    return filled(
        "model_card",
        name=folder.name,
        use=next(text for file, text in USES.items() if (folder / file).is_file()).format(name=folder.name, **facts),
        run=run,
        device=f", on a GPU ({run['device']})" if "device" in run else "",
        recipe=recipe,
        parameters=metrics["parameters"],
        source=source,
        count=len(rows),
        floor=spread(errors["resolution_floor_percent"]),
        regions=table_rows(cells),
    )


def pretrained_card(folder: Path) -> str:
    """The card of a pretrained model, from what `surrogate.training` wrote into its folder."""
    run, measured = (read_json(folder / name) for name in ("run.json", "errors.json"))
    sources = "\n".join(
        f"  - {source['trajectories']:,} of `--solids {source['solids']}`, seed {source['seed']}, modulus ratios "
        f"{source['modulus_ratio'][0]:g} to {source['modulus_ratio'][1]:g}"
        for source in run["sources"]
    )
    with np.load(folder / STAGES) as arrays:
        units = arrays["scalars/bias_0"].size
    return filled(
        "pretrained_card",
        name=folder.name,
        run=run,
        units=units,
        measured=measured,
        sources=sources,
        errors=markdown_table(PLACE_HEADS, place_rows(measured), "l" + "r" * (len(PLACE_HEADS) - 1)),
        ends=ends_text(measured),
    )


def main(
    published: Annotated[Path, typer.Option(help="Folder of the published files.")] = Path("published"),
) -> None:
    """Write the cards of the data set and of each published model, and the metadata."""
    path = published / "dataset.h5"
    dataset = load_dataset(path)
    cards = {published: data_card(path, dataset)}
    models = [model_card(run.parent, dataset) for run in sorted((published / "models").glob("*/run.json"))]
    box = {"ranges": range_rows(dataset.attributes["ranges"]), "ratio": dataset.attributes["modulus_ratio"]}
    cards[published / "models"] = filled("models_head", **box) + "\n".join(models)
    for folder in (run.parent for run in sorted((published / "pretrained").glob("*/run.json"))):
        cards[folder] = pretrained_card(folder)
    write_whole(published / METADATA, json.dumps(croissant(path, dataset), indent=1) + "\n")
    for folder, text in cards.items():
        write_whole(folder / CARD, text)
    typer.echo(
        f"{len(cards) + 1} files written: {METADATA}, and {CARD} of the data set, the models and each pretrained one"
    )


if __name__ == "__main__":
    run_main(main)

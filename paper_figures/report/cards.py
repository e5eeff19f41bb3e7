"""Cards: README.md of the data set, of the models and of each pretrained one, and metadata in the Croissant format.

Every number comes from the published files: `run.json`, `metrics.json` and the errors of a model of the paper's kind,
`run.json` and `measurements/errors_by_place.json` of a pretrained one, and the attributes of the data set.
The texts are the templates beside this module. `make cards` writes the cards.

Usage: `python -m paper_figures.report.cards [--published DIR]`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("paper_figures.report.cards")

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from bem._support.text_files import read_json
from bem.dataset.file import Dataset, load_dataset
from experiments.cases import regions
from experiments.run_folders import read_table
from paper_figures.report.data_card import METADATA, croissant, data_card, filled, range_rows
from paper_figures.style.writing import number, table_rows
from surrogate.files import STAGES

CARD = "README.md"
TRAINED = """- **Network**: {layers} layers of {units} units, by {recipe[optimizer]}, seed {recipe[seed]},
  {recipe[epochs]} epochs, weights of epoch {best_epoch}: `{command}`"""
USES = {
    "model.onnx": '`surrogate predict {name}`, or `surrogate.load("{name}")` from Python.',
    "model.weights.h5": '`surrogate.load("{name}", backend="keras")` from Python; `surrogate export` writes ONNX.',
    "run.json": "for comparison; the weights are not published. `surrogate train {architecture} --features {features} "
    "--recipe {recipe}{budget} --seed {seed} --label {name} --threads 1` trains such a model.",
}
"""How a model is used, by the first of these files that is published."""
ERRORS = ("pull_off_force_percent", "hysteresis_percent")
INSIDE = ("pull_off", "pull_off_time", "hysteresis", "force", "curve")


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


def pretrained_card(folder: Path, measured: dict[str, Any]) -> str:
    """The card of one pretrained model, in Markdown, with a table of its errors by place.

    Args:
        folder: Of the model, with `run.json` and `scaling.json`.
        measured: What `experiments errors_by_place` measured.
    """
    run, scaling = (json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) for name in ("run", "scaling"))
    places = measured["models"][folder.name]
    worst = max(places["corners"], key=lambda corner: corner["pull_off"][1])
    cells = []
    for region, row in {"all": places["box"], **places["edges"], "the corner that errs most": worst}.items():
        errors = [" / ".join(number(level, 2) for level in row[name]) for name in ("pull_off", "hysteresis")]
        covered = [f"{row[f'inside/{name}']:.2f}" for name in INSIDE]
        cells.append([region, row["count"], *errors, *covered, number(row["width/pull_off"][0], 2)])
    return filled(
        "pretrained_card",
        name=folder.name,
        run=run,
        networks="the mean of the networks" if len(run["members"]) > 1 else "the network",
        recipes="\n".join(TRAINED.format(**member) for member in run["members"]),
        measured=measured,
        coverage=100 * measured["coverage"],
        corners=len(places["corners"]),
        errors=table_rows(cells),
        lowest=", ".join(f"{min(corner[f'inside/{name}'] for corner in places['corners']):.2f}" for name in INSIDE),
        ranges=range_rows(scaling["ranges"]),
    )


SOLID_PLACES = {
    "test_prony_2_4": "2 to 4 terms",
    "test_sls": "standard linear solids",
    "test_power_law": "power laws",
    "test_polyurea": "polyurea",
    "test_ratio_0.1": "modulus ratio 0.1",
    "test_slow_unloading": "slow unloading",
    "test_edges": "edges",
    "test_corners": "corners",
    "fast, test_sls": "`fast`, standard linear solids",
}
"""Words for the places of `make judge-any-solid`."""
SOLID_COLUMNS = ("pull-off force", "time since the dwell", "hysteresis", "curve, largest")


def _solid_places(measured: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Tables of errors by place, those of `fast` last."""
    return {SOLID_PLACES.get(place, place): table for place, table in (measured["places"] | measured["beside"]).items()}


def solid_table(measured: dict[str, Any]) -> str:
    """Errors and coverage of the model of any linear solid by place, and of `fast`, as a table in Markdown."""
    head = ["Place", "Contacts", *(f"{name.capitalize()} (%)" for name in SOLID_COLUMNS)]
    rows = [[*head, "Force in", "Time in", "Loop in", "Taken"], ["---"] * (len(head) + 4)]
    for place, table in _solid_places(measured).items():
        errors = [" / ".join(number(table[name][level], 2) for level in ("50", "90", "99")) for name in SOLID_COLUMNS]
        covered = [f"{table[name]['covered at 0.9']:.0f}" for name in SOLID_COLUMNS[:3]]
        count = table["trajectories"]
        rows.append([place, f"{count['count']:,.0f}", *errors, *covered, f"{count['inside']:.0f}"])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def solid_card(folder: Path, measured: dict[str, Any]) -> str:
    """The card of the model of any linear solid; `measured` is what `surrogate.training.solid_judgement` wrote."""
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    sources = "\n".join(
        f"  - {source['trajectories']:,} of `--solids {source['solids']}`, seed {source['seed']}, modulus ratios "
        f"{source['modulus_ratio'][0]:g} to {source['modulus_ratio'][1]:g}"
        for source in run["sources"]
    )
    return filled(
        "solid_card", name=folder.name, run=run, measured=measured, sources=sources, errors=solid_table(measured)
    )


def solid_limits(measured: dict[str, Any]) -> str:
    """Errors of the curves of any linear solid and of `fast`, as sentences for the table of limits."""
    parts = []
    for place, table in _solid_places(measured).items():
        mean, largest = table["curve, mean"], table["curve, largest"]
        values = ", ".join(number(part[level], 2) for part in (mean, largest) for level in ("50", "90"))
        parts.append(f"{place} {values}, {number(largest['99'], 2)}")
    least = min(table[name]["covered at 0.9"] for table in measured["places"].values() for name in SOLID_COLUMNS[:3])
    sides = {
        f"{side.removeprefix('at ').replace('_', ' ')} of {SOLID_PLACES[place]}": min(
            (row[name], name) for name in SOLID_COLUMNS[:3]
        )
        for place, table in measured["places"].items()
        for side, row in table.items()
        if side.startswith("at ")
    }
    side, (worst, result) = min(sides.items(), key=lambda entry: entry[1])
    times = measured["milliseconds"]
    return (
        "Errors of a curve in percent of its range, the mean at the median and 90th percentile, the largest there and "
        f"at the 99th: {'; '.join(parts)}. The 90 % intervals contain {least:.0f} % or more everywhere, on each of "
        f"the {len(sides)} sides of edges and corners {worst:.0f} % or more ({result}, {side}). A call takes "
        f"{times['single']:.2f} ms, in a batch {times['batch']:.2f}"
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
        solids = (folder / STAGES).is_file()
        results = published / ("any_solid.json" if solids else "measurements/errors_by_place.json")
        cards[folder] = (solid_card if solids else pretrained_card)(folder, read_json(results))
    write_whole(published / METADATA, json.dumps(croissant(path, dataset), indent=1) + "\n")
    for folder, text in cards.items():
        write_whole(folder / CARD, text)
    typer.echo(
        f"{len(cards) + 1} files written: {METADATA}, and {CARD} of the data set, the models and each pretrained one"
    )


if __name__ == "__main__":
    run_main(main)

"""Write numbers from results into documents, so that none is typed by hand.

A place in a document reads `<!-- NAME -->...<!-- end -->`, or `<!-- NAME -->` and `<!-- /NAME -->` around a block. The
numbers come from the published data set, measurements and trainings, and from `experiments/paper_values/`; the table of
targets in REPRODUCING.md also uses the registry in the Makefile.

Usage: `python tools/fill.py DOCUMENT ... [--published DIR]`; `--check` only reports whether the documents are up to
date.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from bem._support.command_line import run_main  # noqa: E402
from bem._support.wording import markdown_table  # noqa: E402
from experiments import registry  # noqa: E402
from experiments.paper_numbers import paper_values  # noqa: E402

PLACE = re.compile(r"<!-- ([a-z0-9 -]+) -->(.*?)<!-- (?:end|/\1) -->", re.DOTALL)
REPRODUCIBILITY = (
    "seeds there are",
    "statements",
    "spread over seeds",
    "inputs and step length",
    "training of the paper",
    "recipe and ranking",
    "forces of the models",
)
FILES = {
    "minutes": "measurements/target_minutes.json",
    "cost": "measurements/accuracy_cost.json",
    "peers": "measurements/peers.json",
    "scale": "measurements/campaign_scale.json",
    "coverage": "measurements/lab_coverage.json",
    "floor": "measurements/measurement_floor.json",
    "pretrained": "measurements/pretrained_errors.json",
    "features": "feature_sets.json",
    "streaming": "measurements/streaming_cost.json",
    "inverse": "measurements/inverse_problem.json",
    "size": "measurements/size_error.json",
}


def of_dataset(published: Path) -> dict[str, str]:
    """Size and cost of our data set, and the cost of the paper's."""
    from bem.dataset.file import load_dataset

    dataset = load_dataset(published / "dataset.h5")
    attributes, seconds = dataset.attributes, dataset.scalars["solver_seconds"]
    return {
        "trajectories": f"{int(attributes['count']):,}",
        "core-minutes": f"{seconds.sum() / 60.0:.2g}",
        "milliseconds": f"{1e3 * seconds.mean():.0f}",
        "paper-cpu-hours": str(paper_values("dataset")["cpu_hours"]),
    }


def of_price(published: Path) -> dict[str, str]:
    """Cost of the paper's trajectories by the present solver at standard accuracy, the start of a campaign included."""
    levels = _read(published / "accuracy_price.json", "make accuracy-price")["levels"]
    (standard,) = (level for level in levels if level["accuracy"] == "standard")
    return {
        "core-seconds": f"{standard['core_seconds']:.2g}",
        "milliseconds each": f"{1e3 * standard['core_seconds'] / standard['trajectories']:.2g}",
    }


def of_latency(published: Path) -> dict[str, str]:
    """Times of a prediction and of a step of a stream, or a note that they are not measured yet."""
    from experiments.cost.bench_surrogate import PREDICTIONS, STREAM, prediction_table, stream_table

    measurements = {
        "seconds of a prediction": (PREDICTIONS, prediction_table, "bench-surrogate"),
        "seconds of a step": (STREAM, stream_table, "bench-stream"),
    }
    words = {}
    for place, (path, table, target) in measurements.items():
        content = _read(published / "measurements" / path.name)
        measured = content and f"{table(content)}\n\nMeasured on one core of {content['host']}."
        words[place] = measured or f"Not measured yet: `make {target} docs-control`."
    return words


def of_streaming(published: Path) -> dict[str, str]:
    """Times of a step of a stream and of a stateful session, or a note that they are not measured yet."""
    from experiments.surrogates.streaming_cost import page_text

    content = _read(published / FILES["streaming"])
    return {
        "stream and session": page_text(content)
        if content
        else "Not measured yet: `make measure-streaming docs-control`."
    }


def of_targets(published: Path) -> dict[str, str]:
    """The table of the paper's targets with their minutes and hours, and the machine of the minutes."""
    from experiments.stages import hours_of, read_stages

    known, measured = read_stages(), _read(published / FILES["minutes"])
    spent = {target: f"{max(minutes, 0.1):.1f}" for target, minutes in measured.get("minutes", {}).items()}

    def hours(name: str) -> str:
        parts = [hours_of(stage, known, published) for stage in registry.stages(name)]
        total = sum(value for value, _ in parts)
        return (f"{total:.2g}" + ("" if all(sure for _, sure in parts) else " e")) if parts else "-"

    def row(target: str, caption: str, inputs: str, hours: str) -> list[str]:
        return [f"`make {target}`", caption, inputs, spent.get(target, "-"), hours]

    def words(name: str) -> str:
        return ", ".join(registry.INPUTS[one] for one in registry.inputs(name))

    shown = [entry for entry in registry.entries() if entry.kind == "paper"]
    rows = [row(entry.name, entry.caption, words(entry.name), hours(entry.name)) for entry in shown]
    rows += [row(target, caption, "", "") for target, caption in registry.WHOLE.items()]
    header = ["Target", "Shows", "Inputs", "Minutes", "Hours from scratch"]
    return {
        "targets": markdown_table(header, rows, "lllrr"),
        "machine": measured.get("host", "a machine not named yet"),
    }


def of_cost(published: Path) -> dict[str, str]:
    """The table of the fastest tools."""
    from paper_figures.tables.table_accuracy_cost import page_text

    return {"fastest tool": page_text(_read(published / FILES["cost"], "make measure-accuracy-cost"))}


def of_reproducibility(published: Path) -> dict[str, str]:
    """Results of seeds, forces and the paper's own recipe."""
    from paper_figures.report.reproducibility import values

    return values(published)


def of_peers(published: Path) -> dict[str, str]:
    """The table of the comparison with other software."""
    from paper_figures.tables.table_peers import page_text

    return {"peers": page_text(_read(published / FILES["peers"], "make measure-peers"))}


def of_scale(published: Path) -> dict[str, str]:
    """The estimate of a campaign on many cores."""
    from experiments.scale.ten_million import page_text

    return {"ten million": page_text(_read(published / FILES["scale"], "make bench-campaign"))}


def of_fits(published: Path) -> dict[str, str]:
    """How often intervals of fitted force curves contain the truth."""
    from experiments.lab.lab_coverage import page_text

    content = _read(published / FILES["coverage"])
    return {
        "fit coverage": page_text(content)
        if content
        else "Not measured yet: `make measure-fit-coverage docs-laboratory`."
    }


def of_floor(published: Path) -> dict[str, str]:
    """What measurement steps hold of the solver's results."""
    from paper_figures.measurements.figure_measurement_floor import page_text

    return {"floor of the steps": page_text(_read(published / FILES["floor"], "make measure-floor"))}


def of_pretrained(published: Path) -> dict[str, str]:
    """Errors, bands and cost of the pretrained models, and what each way to call them costs."""
    from paper_figures.tables.table_surrogates import calls_text, page_text

    content = _read(published / FILES["pretrained"], "make measure-surrogates")
    return {"pretrained models": page_text(content), "ways to call": calls_text(content)}


def of_features(published: Path) -> dict[str, str]:
    """Errors of the input representations at two kinds of measurement steps."""
    from paper_figures.models.figure_features import page_text

    return {"inputs and steps": page_text(_read(published / FILES["features"], "make feature-sets"))}


def of_inverse(published: Path) -> dict[str, str]:
    """The posterior of a material by surrogate and by solver."""
    from paper_figures.measurements.figure_inverse import page_text

    return {"inverse problem": page_text(_read(published / FILES["inverse"], "make measure-inverse"))}


def of_size(published: Path) -> dict[str, str]:
    """Errors against the number of parameters."""
    from paper_figures.measurements.figure_size_error import page_text

    return {"size against error": page_text(_read(published / FILES["size"], "make measure-size-error"))}


SOURCES: dict[tuple[str, ...], Callable[[Path], dict[str, str]]] = {
    ("trajectories", "core-minutes", "milliseconds", "paper-cpu-hours"): of_dataset,
    ("core-seconds", "milliseconds each"): of_price,
    ("seconds of a prediction", "seconds of a step"): of_latency,
    ("stream and session",): of_streaming,
    ("targets", "machine"): of_targets,
    ("fastest tool",): of_cost,
    REPRODUCIBILITY: of_reproducibility,
    ("peers",): of_peers,
    ("ten million",): of_scale,
    ("fit coverage",): of_fits,
    ("floor of the steps",): of_floor,
    ("pretrained models", "ways to call"): of_pretrained,
    ("inputs and steps",): of_features,
    ("inverse problem",): of_inverse,
    ("size against error",): of_size,
}
"""Function that returns the text of the places with these names."""


def values_for(text: str, published: Path) -> dict[str, str]:
    """Text of each place of a document, by name."""
    asked, found = {match[1] for match in PLACE.finditer(text)}, {}
    for names, source in SOURCES.items():
        if asked & set(names):
            found |= source(published)
    return found


def filled(text: str, values: dict[str, str]) -> str:
    """Fill every place of a document.

    Raises:
        ValueError: The name of a place is unknown.
    """

    def fill(match: re.Match) -> str:
        name = match[1]
        if name not in values:
            known = ", ".join(name for names in SOURCES for name in names)
            raise ValueError(f"places must be named one of {known}; received {name!r}")
        if match[0].endswith("<!-- end -->"):
            return f"<!-- {name} -->{values[name]}<!-- end -->"
        return f"<!-- {name} -->\n\n{values[name]}\n\n<!-- /{name} -->"

    return PLACE.sub(fill, text)


def main(
    documents: Annotated[list[Path], typer.Argument(help="Markdown files.")],
    published: Annotated[Path, typer.Option(help="Folder of published files.")] = ROOT / "published",
    check: Annotated[bool, typer.Option("--check", help="Change nothing; fail if a document is out of date.")] = False,
) -> None:
    """Fill the places of documents."""
    for document in documents:
        text = document.read_text(encoding="utf-8")
        whole = filled(text, values_for(text, published))
        if check and whole != text:
            print(f"fill: {document} is out of date; run `python tools/fill.py {document}`", file=sys.stderr)
            raise typer.Exit(1)
        if not check:
            document.write_text(whole, encoding="utf-8")


def _read(path: Path, made_by: str | None = None) -> Any:
    if made_by and not path.is_file():
        raise FileNotFoundError(f"measurement {str(path)!r} not found; `{made_by}` makes it")
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


if __name__ == "__main__":
    run_main(main, "fill")

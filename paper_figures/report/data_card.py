"""The card of the data set, its metadata in the Croissant format of ML Commons 1.0, and its numbers in README.md.

The texts of the cards are the templates beside this module; `paper_figures.report.cards` writes them.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bem.dataset.file import Dataset, load_dataset
from experiments.paper_numbers import paper_values
from paper_figures.style.writing import number, table_rows

METADATA = "dataset.croissant.json"
LICENCE = "BSD-3-Clause"
SHARES = (0.0, 0.1, 0.5, 0.9, 1.0)
HERE = Path(__file__).parent


def filled(template: str, **values: Any) -> str:
    """The text of a template beside this module, with its places filled."""
    text = (HERE / f"{template}.md").read_text(encoding="utf-8")
    return text.format(licence=LICENCE, metadata=METADATA, **values)


def range_rows(ranges: Mapping[str, Sequence[float]]) -> str:
    """Rows of a table of ranges, in Markdown."""
    return table_rows([(name, f"{low:g} to {high:g}") for name, (low, high) in ranges.items()])


def data_card(path: Path, dataset: Dataset) -> str:
    """The card of the data set, in Markdown."""
    scalars = dataset.scalars
    kinds = ("pull_off_force", "hysteresis", "max_compression", "end_force")
    quantiles = [(name, *(number(float(np.quantile(scalars[name], share)), 3) for share in SHARES)) for name in kinds]
    return filled(
        "data_card",
        name=path.name,
        count=len(dataset),
        about=dataset.attributes,
        ranges=range_rows(dataset.attributes["ranges"]),
        megabytes=path.stat().st_size / 1e6,
        steps=dataset.force.shape[1],
        quantiles=table_rows(quantiles),
        jumping=100 * np.mean(scalars["jump_count"] > 0),
        attached=100 * np.mean(scalars["end_force"] > 0.5 * scalars["pull_off_force"]),
        minutes=scalars["solver_seconds"].sum() / 60.0,
    )


def croissant(path: Path, dataset: Dataset) -> dict[str, Any]:
    """Metadata of the data set; what does not depend on the file is in `croissant_head.json`."""
    head = json.loads((HERE / "croissant_head.json").read_text(encoding="utf-8"))
    arrays = head["variableMeasured"].items()
    file = {"@type": "cr:FileObject", "@id": path.name, "name": path.name, "contentUrl": path.name}
    file |= {"contentSize": f"{path.stat().st_size} B", "encodingFormat": "application/x-hdf5"}
    return head | {
        "description": head["description"].format(count=len(dataset), ratio=dataset.attributes["modulus_ratio"]),
        "license": head["license"].format(licence=LICENCE),
        "variableMeasured": [
            {
                "@type": "sc:PropertyValue",
                "name": name,
                "description": f"{description}; shape {dataset.columns[name].shape}",
            }
            for name, description in arrays
        ],
        "distribution": [file | {"sha256": hashlib.sha256(path.read_bytes()).hexdigest()}],
    }


def trajectories(dataset: Path) -> str:
    """Number of trajectories."""
    return f"{len(load_dataset(dataset)):,}"


def core_seconds(dataset: Path) -> str:
    """Seconds of the solver in all."""
    return f"{load_dataset(dataset).scalars['solver_seconds'].sum():.2g}"


def milliseconds(dataset: Path) -> str:
    """Milliseconds of the solver for each trajectory."""
    return f"{1e3 * load_dataset(dataset).scalars['solver_seconds'].mean():.2g}"


def paper_hours() -> str:
    """CPU-hours of the paper's data set."""
    return str(paper_values("dataset")["cpu_hours"])

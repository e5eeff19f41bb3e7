"""What accuracy costs over the paper's design: the same protocols at draft, standard and reference.

All campaigns use the first protocols of one random draw without repetition, so that fewer protocols at `reference` are
a random sample of those at `draft` and `standard`. Errors are differences from `reference` on that sample. The
campaigns are kept in `results/accuracy_price/`; an interrupted run continues.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.command_line import progress_bar
from bem._support.validation import FloatArray, whole_number
from bem.dataset.campaign import Campaign, Solver
from bem.dataset.designs import agree
from bem.dataset.file import Dataset, load_dataset
from bem.dataset.run import run_campaign
from experiments.measurements.harness import Count, Seed
from experiments.paper.dataset_statistics import percentiles

FOLDER = Path("results/accuracy_price")
LEVELS = ("draft", "standard", "reference")


def errors(dataset: Dataset, reference: Dataset) -> dict[str, FloatArray]:
    """Relative differences of the trajectories that both data sets completed.

    Returns:
        Differences by name, each of shape (m,): of pull-off force and hysteresis, relative to the
        reference, and of the force, as the root mean square over the measurement steps relative to its range.

    Raises:
        ValueError: The data sets do not begin with the same protocols.
    """
    rows = np.intersect1d(dataset.completed, reference.completed)
    for name, values in reference.protocols.items():
        if not agree(values[rows], dataset.protocols[name][rows]):
            raise ValueError(f"data sets must begin with the same protocols; received different {name}")
    found = {
        name: np.abs(dataset.scalars[name][rows] / reference.scalars[name][rows] - 1.0)
        for name in ("pull_off_force", "hysteresis")
    }
    exact = reference.force[rows].astype(np.float64)
    difference = dataset.force[rows].astype(np.float64) - exact
    return found | {"force": np.sqrt(np.mean(difference**2, axis=1)) / np.ptp(exact, axis=1)}


def price(datasets: dict[str, Dataset]) -> list[dict[str, Any]]:
    """One entry for each accuracy: trajectories, seconds, and errors against the last accuracy."""
    reference = list(datasets.values())[-1]
    rows = []
    for name, dataset in datasets.items():
        seconds = dataset.scalars["solver_seconds"]
        row: dict[str, Any] = {
            "accuracy": name,
            "trajectories": len(dataset),
            "failed": len(dataset) - len(dataset.completed),
            "seconds": {"mean": float(seconds.mean()), **percentiles(seconds)},
        }
        if dataset is not reference:
            found = errors(dataset, reference)
            row["compared"] = len(found["force"])
            row["errors"] = {quantity: percentiles(values) for quantity, values in found.items()}
        rows.append(row)
    return rows


def run(
    count: int, reference_count: int, seed: int, folder: Path, workers: int | None, solver: Solver | None = None
) -> dict[str, Dataset]:
    """Data set of each accuracy; campaigns that were computed before are read."""
    whole_number("reference_count", reference_count, low=1, high=count)
    datasets = {}
    for level in LEVELS:
        campaign = Campaign(count=reference_count if level == "reference" else count, seed=seed, accuracy=level)
        path = folder / f"{level}.h5"
        with progress_bar(campaign.count) as progress:
            run_campaign(campaign, path, workers=workers, solver=solver, progress=progress, replace=True)
        datasets[level] = load_dataset(path)
    return datasets


def study(
    *,
    count: Count = 12_450,
    reference_count: Annotated[int, typer.Option(help="Protocols at reference, at most as many.")] = 12_450,
    seed: Seed = 0,
    workers: Annotated[int | None, typer.Option(help="Processes; one per core by default.")] = None,
    folder: Annotated[Path, typer.Option(help="Folder in which the campaigns are kept.")] = FOLDER,
) -> dict[str, Any]:
    """Measure the price of accuracy."""
    datasets = run(count, reference_count, seed, folder, workers)
    return {"design": "paper", "seed": seed, "levels": price(datasets)}

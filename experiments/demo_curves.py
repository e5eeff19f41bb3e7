"""Solver curves that the browser demonstrator draws over the predictions of the surrogate.

There are two kinds. The first are the paper's twelve canonical protocols (its timing table), simulated at the accuracy
of the data set. The second are trajectories of the published data set on which no model was trained: the held-out
protocols nearest to the points of a Sobol sequence in the logarithms of the five quantities, so that a few of them
cover the whole box.

Usage: `python -m experiments.demo_curves [--count N] [--out FILE]`.
"""

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from scipy.stats import qmc

from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from bem._support.provenance import provenance
from bem.dataset.designs import QUANTITIES
from experiments.common import DATASET, MODELS, MODULUS_RATIO, on_steps, simulated
from experiments.paper_numbers import paper_rows
from surrogate.data.dataset import Split, TrajectoryDataset

SPLIT = MODELS / "M1-concat" / "split.json"
OUT = Path("demo/public/curves.json")
ACCURACY = "standard"
COUNT = 36
RESULTS = ("pull_off_force", "pull_off_time", "hysteresis")
# Forces of the data set have single precision; more digits would only lengthen the file.
SIGNIFICANT_DIGITS = 7


def rounded(values: np.ndarray) -> list[float]:
    """Values rounded to the precision of the file."""
    return [float(f"{value:.{SIGNIFICANT_DIGITS}g}") for value in np.asarray(values, dtype=np.float64)]


def spread(protocols: dict[str, np.ndarray], count: int, seed: int = 0) -> np.ndarray:
    """Choose protocols that cover their box evenly.

    Args:
        protocols: The five quantities by name, each of shape (n,).
        count: Number of protocols to choose, from 1 to n.
        seed: Seed of the Sobol sequence.

    Returns:
        Distinct indices into the arrays, of shape (count,), in the order of the sequence.

    Raises:
        ValueError: `count` is not between 1 and n.
    """
    logarithms = np.log([protocols[name] for name in QUANTITIES]).T
    if not 0 < count <= len(logarithms):
        raise ValueError(f"count must lie between 1 and the {len(logarithms)} held-out protocols; received {count!r}")
    low, high = logarithms.min(axis=0), logarithms.max(axis=0)
    places = (logarithms - low) / np.where(high > low, high - low, 1.0)
    free = np.ones(len(places), dtype=bool)
    chosen = []
    for point in qmc.Sobol(len(QUANTITIES), seed=seed).random_base2(int(np.ceil(np.log2(count))))[:count]:
        distance = np.where(free, np.sum((places - point) ** 2, axis=1), np.inf)
        chosen.append(int(np.argmin(distance)))
        free[chosen[-1]] = False
    return np.array(chosen)


def paper_curve(row: dict[str, Any]) -> dict[str, Any]:
    """Simulate one of the paper's samples.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    trajectory = simulated(row, accuracy=ACCURACY)
    return {
        "name": f"paper-{row['sample']:g}",
        "kind": "paper",
        "protocol": {name: row[name] for name in QUANTITIES},
        "results": dict(zip(RESULTS, rounded([getattr(trajectory, name) for name in RESULTS]), strict=True)),
        "force": rounded(on_steps(row, trajectory)["force"]),
    }


def held_out_curves(dataset: TrajectoryDataset, split: Split, count: int) -> list[dict[str, Any]]:
    """Select trajectories of the test part of the data set."""
    rows = split.test[spread(dataset.protocols_of(split.test), count)]
    return [
        {
            "name": f"data-set-{row}",
            "kind": "test",
            "protocol": {name: float(dataset.protocols[name][row]) for name in QUANTITIES},
            "results": dict(zip(RESULTS, rounded([dataset.scalars[name][row] for name in RESULTS]), strict=True)),
            "force": rounded(dataset.force[row]),
        }
        for row in rows.tolist()
    ]


def main(
    out: Annotated[Path, typer.Option(help="File to write.")] = OUT,
    count: Annotated[int, typer.Option(help="Trajectories of the data set's test part.")] = COUNT,
) -> None:
    """Write the curves as JSON, one line each."""
    dataset = TrajectoryDataset.load(DATASET)
    split = Split.load(SPLIT) if SPLIT.is_file() else dataset.split()
    curves = [paper_curve(row) for row in paper_rows("canonical_protocols")]
    curves += held_out_curves(dataset, split, count)
    head = {
        "modulus_ratio": MODULUS_RATIO,
        "accuracy": ACCURACY,
        "counts": dataset.points_per_phase,
        "dataset_sha256": dataset.sha256,
        **provenance("python -m experiments.demo_curves"),
    }
    lines = ",\n".join(json.dumps(curve) for curve in curves)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_whole(out, f'{json.dumps(head)[:-1]}, "curves": [\n{lines}\n]}}\n')


if __name__ == "__main__":
    run_main(main)

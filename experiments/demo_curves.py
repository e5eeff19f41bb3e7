"""Solver curves that the browser demonstrator draws over the predictions of the surrogate.

There are three kinds. The first are the paper's twelve canonical protocols (its timing table), simulated at the
accuracy of the data set. The second are trajectories of the published data set on which no model was trained: the
held-out protocols nearest to the points of a Sobol sequence in the logarithms of the five quantities, so that a few of
them cover the whole box. One file has both on the measurement steps of the data set. Another file has them on the
physical steps of the pretrained models, simulated, and the third kind: protocols on other standard linear solids, drawn
in the ranges of the pretrained models with a seed of their own.

Usage: `python -m experiments.demo_curves [--count N] [--out FILE] [--solids N] [--solids-out FILE]`.
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
from bem.dataset.designs import QUANTITIES, Design
from bem.dataset.measurement_steps import PHYSICAL
from bem.dataset.physical_steps import physical_grid
from experiments.common import DATASET, MODELS, MODULUS_RATIO, on_steps, simulated
from experiments.paper_numbers import paper_rows
from surrogate.data.dataset import Split, TrajectoryDataset

SPLIT = MODELS / "M1-concat" / "split.json"
OUT = Path("demo/public/curves.json")
SOLIDS_OUT = Path("demo/public/solids.json")
ACCURACY = "standard"
COUNT = 36
SOLIDS = 24
ANY_SOLID = (0.01, 1.0)
SEED = 77
"""Of the other solids; trainings and hidden protocols use others."""
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


def other_solids(count: int) -> list[dict[str, Any]]:
    """Draw protocols and modulus ratios: entries without results and force."""
    drawn = Design("log-uniform", modulus_ratio=ANY_SOLID).protocols(count, SEED)
    names = (*QUANTITIES, "modulus_ratio")
    return [
        {"name": f"solid-{row + 1}", "kind": "solid", "protocol": {name: float(drawn[name][row]) for name in names}}
        for row in range(count)
    ]


def physical_curve(curve: dict[str, Any]) -> dict[str, Any]:
    """Simulate the protocol of an entry, on the physical steps.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    protocol = {"modulus_ratio": MODULUS_RATIO} | curve["protocol"]
    trajectory = simulated(protocol, accuracy=ACCURACY, modulus_ratio=protocol["modulus_ratio"])
    times, _ = physical_grid(**protocol)
    return {
        "name": curve["name"],
        "kind": curve["kind"],
        "protocol": protocol,
        "results": dict(zip(RESULTS, rounded([getattr(trajectory, name) for name in RESULTS]), strict=True)),
        "force": rounded(trajectory.at(times[0].clip(max=trajectory.time[-1]))),
    }


def write_curves(out: Path, head: dict[str, Any], curves: list[dict[str, Any]]) -> None:
    """Write curves as JSON, one line each."""
    facts = {"modulus_ratio": MODULUS_RATIO, "accuracy": ACCURACY, **head}
    facts |= provenance("python -m experiments.demo_curves")
    lines = ",\n".join(json.dumps(curve) for curve in curves)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_whole(out, f'{json.dumps(facts)[:-1]}, "curves": [\n{lines}\n]}}\n')


def main(
    out: Annotated[Path, typer.Option(help="File of the curves on the data set's steps.")] = OUT,
    count: Annotated[int, typer.Option(help="Trajectories of the data set's test part.")] = COUNT,
    solids_out: Annotated[Path, typer.Option(help="File of the curves on physical steps.")] = SOLIDS_OUT,
    solids: Annotated[int, typer.Option(help="Protocols on other solids.", min=1)] = SOLIDS,
) -> None:
    """Write both files of solver curves."""
    dataset = TrajectoryDataset.load(DATASET)
    split = Split.load(SPLIT) if SPLIT.is_file() else dataset.split()
    curves = [paper_curve(row) for row in paper_rows("canonical_protocols")]
    curves += held_out_curves(dataset, split, count)
    write_curves(out, {"counts": dataset.points_per_phase, "dataset_sha256": dataset.sha256}, curves)
    typer.echo(f"{out}: {len(curves)} curves")
    physical = [physical_curve(curve) for curve in [*curves, *other_solids(solids)]]
    write_curves(solids_out, {"counts": PHYSICAL, "dataset_sha256": dataset.sha256}, physical)
    typer.echo(f"{solids_out}: {len(physical)} curves")


if __name__ == "__main__":
    run_main(main)

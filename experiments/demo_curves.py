"""Solver curves that the browser demonstrator draws over the predictions of the surrogate.

There are three kinds. The first are the paper's twelve canonical protocols (its timing table), simulated at the
accuracy of the data set. The second are trajectories of the published data set on which no model was trained: the
held-out protocols nearest to the points of a Sobol sequence in the logarithms of the five quantities, so that a few of
them cover the whole box. One file has both on the measurement steps of the data set. Another file has them on
steps around their pull-off, simulated, and the third kind: protocols on other standard linear solids, drawn in the
ranges of the pretrained model with a seed of their own. A third file has the moving contact of all of them: surface and
traction over the radius at some instants, as whole numbers in base64.

Usage: `python -m experiments.demo_curves`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("experiments.demo_curves")

import json
from base64 import b64encode
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from bem import Trajectory
from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from bem._support.provenance import provenance
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import PULL_OFF, measurement_grid
from bem.dataset.pull_off_steps import pull_off_grid
from experiments.cases import ANY_SOLID, Case, hidden_protocols, rows_of
from experiments.common import DATASET, MODELS, MODULUS_RATIO
from experiments.paper_numbers import paper_rows
from surrogate.data.dataset import Split, TrajectoryDataset

SPLIT = MODELS / "split.json"
OUT = Path("demo/public/curves.json")
SOLIDS_OUT = Path("demo/public/solids.json")
CONTACTS_OUT = Path("demo/public/contacts.json")
ACCURACY = "standard"
COUNT = 36
SOLIDS = 24
SEED = 77
"""Of the other solids; trainings and hidden protocols use others."""
FRAMES, NODES, WIDER = 30, 40, 1.35
"""Instants and radii of a moving contact, and its largest radius over the largest contact radius."""
RESULTS = ("pull_off_force", "pull_off_time", "hysteresis")
# Forces of the data set have single precision; more digits would only lengthen the file.
SIGNIFICANT_DIGITS = 7
# After a slow loading, instants of a fast unloading differ in their last digits; steps follow from the pull-off time.
TIME_DIGITS = 12


def rounded(values: ArrayLike, digits: int = SIGNIFICANT_DIGITS) -> list[float]:
    """Values rounded to the precision of the file."""
    return [float(f"{value:.{digits}g}") for value in np.asarray(values, dtype=np.float64)]


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


def entry(name: str, source: str, protocol: dict[str, float], results: Any, force: np.ndarray) -> dict[str, Any]:
    """One curve; `results` has the quantities `RESULTS` as attributes."""
    numbers = dict(
        zip(RESULTS, rounded([getattr(results, quantity) for quantity in RESULTS], TIME_DIGITS), strict=True)
    )
    return {"name": name, "kind": source, "protocol": protocol, "results": numbers, "force": rounded(force)}


def equal_steps(protocol: dict[str, Any], _: Trajectory) -> np.ndarray:
    """The paper's measurement steps."""
    return measurement_grid(**protocol)[0][0]


def steps_around_pull_off(protocol: dict[str, Any], trajectory: Trajectory) -> np.ndarray:
    """Measurement steps around the pull-off of a trajectory, as the file has its time."""
    ramps = {name: protocol[name] for name in QUANTITIES}
    (time,) = rounded([trajectory.pull_off_time], TIME_DIGITS)
    strength = 1.0 - protocol["modulus_ratio"]
    times, _ = pull_off_grid(**ramps, strengths=[[strength]], retardation_times=[[1.0]], pull_off_time=time)
    return times[0]


def simulated_curve(curve: dict[str, Any], steps: Callable[[dict[str, Any], Trajectory], np.ndarray]) -> dict[str, Any]:
    """Simulate the protocol of an entry, and take its force at the steps of its protocol and trajectory.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    protocol = curve["protocol"]
    trajectory = Case.of(protocol).simulated(ACCURACY)
    return entry(curve["name"], curve["kind"], protocol, trajectory, trajectory.at(steps(protocol, trajectory)))


def held_out_curves(dataset: TrajectoryDataset, split: Split, count: int) -> list[dict[str, Any]]:
    """Select trajectories of the test part of the data set."""
    curves, chosen = [], split.test[spread(dataset.protocols_of(split.test), count)]
    for row, protocol in zip(chosen.tolist(), rows_of(dataset.protocols_of(chosen)), strict=True):
        results = SimpleNamespace(**{name: dataset.scalars[name][row] for name in RESULTS})
        curves.append(entry(f"data-set-{row}", "test", protocol, results, dataset.force[row]))
    return curves


def other_solids(count: int) -> list[dict[str, Any]]:
    """Draw protocols and modulus ratios: entries without results and force."""
    columns = hidden_protocols(count, ANY_SOLID, SEED)
    rows = rows_of({name: columns[name] for name in (*QUANTITIES, "modulus_ratio")})
    return [{"name": f"solid-{number}", "kind": "solid", "protocol": row} for number, row in enumerate(rows, 1)]


def contact(curve: dict[str, Any]) -> dict[str, Any]:
    """The moving contact of an entry: height of the surface in 16 bits and traction in 8, on `NODES` radii each.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    trajectory = Case.of(curve["protocol"]).simulated(ACCURACY, profiles=FRAMES)
    profiles = trajectory.profiles
    assert profiles is not None
    reach = min(WIDER * trajectory.contact_radius.max(), np.nanmax(profiles.radius))
    radii = np.linspace(0.0, reach, NODES)
    rows = list(zip(profiles.radius, -profiles.displacement, profiles.traction, strict=True))
    # Where the solver's nodes end, the surface is flat and free.
    surface = np.array([np.interp(radii, r[r == r], z[r == r]) for r, z, _ in rows])
    traction = np.array([np.interp(radii, r[r == r], t[r == r], right=0.0) for r, _, t in rows])
    low, high = float(surface.min()), float(surface.max())
    push, pull = (max(float(np.quantile(sign * traction, 0.98)), 1e-3) for sign in (-1.0, 1.0))
    heights = np.rint(65535 * (surface - low) / max(high - low, 1e-9)).astype("<u2")
    levels = np.rint(128 + 127 * np.clip(traction / np.where(traction < 0.0, push, pull), -1.0, 1.0)).astype("u1")
    numbers = zip(("reach", "low", "high", "push", "pull"), rounded([reach, low, high, push, pull]), strict=True)
    packed = {"surface": heights, "traction": levels}
    return {"name": curve["name"], **dict(numbers), "times": rounded(profiles.time, TIME_DIGITS)} | {
        key: b64encode(values.tobytes()).decode() for key, values in packed.items()
    }


def write_lines(out: Path, head: dict[str, Any], title: str, lines: list[dict[str, Any]]) -> None:
    """Write curves or contacts as JSON, one line each."""
    facts = {"modulus_ratio": MODULUS_RATIO, "accuracy": ACCURACY, **head}
    facts |= provenance("python -m experiments.demo_curves")
    body = ",\n".join(map(json.dumps, lines))
    out.parent.mkdir(parents=True, exist_ok=True)
    write_whole(out, f'{json.dumps(facts)[:-1]}, "{title}": [\n{body}\n]}}\n')
    print(f"{out}: {len(lines)} {title}")


def main() -> None:
    """Write both files of solver curves, and that of their contacts."""
    dataset = TrajectoryDataset.load(DATASET)
    split = Split.load(SPLIT) if SPLIT.is_file() else dataset.split()
    papers = {row["sample"]: {name: row[name] for name in QUANTITIES} for row in paper_rows("canonical_protocols")}
    entries = [{"name": f"paper-{number:g}", "kind": "paper", "protocol": ramps} for number, ramps in papers.items()]
    curves = [simulated_curve(curve, equal_steps) for curve in entries]
    curves += held_out_curves(dataset, split, COUNT)
    same = {"dataset_sha256": dataset.sha256}
    write_lines(OUT, {"counts": dataset.points_per_phase, **same}, "curves", curves)
    of_any_solid = [curve | {"protocol": {"modulus_ratio": MODULUS_RATIO} | curve["protocol"]} for curve in curves]
    solids = [simulated_curve(curve, steps_around_pull_off) for curve in [*of_any_solid, *other_solids(SOLIDS)]]
    write_lines(SOLIDS_OUT, {"counts": PULL_OFF, **same}, "curves", solids)
    write_lines(CONTACTS_OUT, {"nodes": NODES, **same}, "contacts", [contact(curve) for curve in solids])


if __name__ == "__main__":
    run_main(main)

"""Very many random scenes: a soak inside the paper's box, beyond it and of stiff contacts.

The soak counts exceptions, trajectories that did not complete (by status), and, among those that completed, values
that are not finite and lone spikes of the force. Memory is read after each chunk. Its growth is that of the second half
of the chunks over the first, in which kernels and caches settle; it is not reported for fewer than `CHUNKS_FOR_MEMORY`
chunks. Protocol i depends on the seed and i only. Chunks are kept, so that the same command continues an interrupted
soak; they are identified by the version of the solver, its accuracy and their protocols.
"""

from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem.methods.version import SOLVER_VERSION
from bem.results.trajectory import is_completed
from experiments.cases import Case, drawn, rows_of
from experiments.harness import Jobs, Seed, fingerprint, in_parallel, kept

KEPT = Path("results/soak")
CHUNK = 250
CHUNKS_FOR_MEMORY = 8
ACCURACY = "standard"


def simulated_row(point: dict[str, float]) -> dict[str, Any]:
    """Simulate one protocol: its status, and whether its results are finite. An exception becomes the status."""
    outcome = {"raised": False, "silent": False, "spikes": 0, "spike_share": 0.0, "seconds": 0.0}
    try:
        trajectory = Case.of(point).run(ACCURACY)
    except Exception as error:
        return outcome | {"status": f"{type(error).__name__}: {error}", "raised": True}
    arrays = (trajectory.time, trajectory.indentation, trajectory.force, trajectory.contact_radius)
    scalars = (trajectory.pull_off_force, trajectory.pull_off_time, trajectory.hysteresis, trajectory.end_force)
    finite = all(np.all(np.isfinite(values)) for values in arrays) and bool(np.all(np.isfinite(scalars)))
    outcome |= {"status": trajectory.status, "seconds": trajectory.stats.seconds}
    if not (trajectory.completed and finite):
        return outcome | {"silent": trajectory.completed}
    spikes = lone_spikes(trajectory.force, trajectory.pull_off_force)
    return outcome | {"spikes": len(spikes), "spike_share": float(spikes.max(initial=0.0))}


def lone_spikes(force: np.ndarray, scale: float) -> np.ndarray:
    """Heights of lone spikes in a force of shape (n,), relative to its range; the force of a contact has none.

    A lone spike lies above or below both neighbours by more than 1 % of `scale`, and by more than ten times the
    differences between these and their neighbours. A jump is a step, not a spike.
    """
    if force.size < 5:
        return np.empty(0)
    # Without adhesion there is no pull-off force, and the range of the force takes its place.
    scale = scale or float(np.ptp(force))
    before, at, after = force[1:-3], force[2:-2], force[3:-1]
    out = np.minimum(np.abs(at - before), np.abs(at - after)) * ((at - before) * (at - after) > 0.0)
    around = np.abs(np.stack([before - force[:-4], after - before, force[4:] - after])).max(axis=0)
    alone = (out > 0.01 * abs(scale)) & (out > 10.0 * around)
    return out[alone] / np.ptp(force)


def chunk(where: str, first: int, count: int, seed: int, folder: Path) -> dict[str, Any]:
    """Results of protocols `first` to `first` + CHUNK of `count`, kept, and the memory (bytes) after them."""
    points = rows_of(drawn(where, count, seed))[first : first + CHUNK]

    def simulated() -> dict[str, Any]:
        import psutil

        rows = [{"index": first + i, **point, **simulated_row(point)} for i, point in enumerate(points)]
        return {"rows": rows, "memory": psutil.Process().memory_info().rss}

    key = fingerprint(solver=SOLVER_VERSION, accuracy=ACCURACY, protocols=points)
    return kept(folder / f"{where}-rows-{first}-{key}.json", simulated)


def summary(chunks: list[dict[str, Any]]) -> dict[str, Any]:
    """Summary of all chunks; `notable` are the first that did not complete, or not as they should."""
    rows = [row for group in chunks for row in group["rows"]]
    memory = np.array([group["memory"] for group in chunks], dtype=float)
    half, enough = len(memory) // 2, len(memory) >= CHUNKS_FOR_MEMORY
    wrong = [row for row in rows if not is_completed(row["status"]) or row["silent"] or row["spikes"]]
    return {
        "protocols": len(rows),
        **{name: sum(row[name] > 0 for row in rows) for name in ("raised", "silent", "spikes")},
        "largest_spike_share": max(row["spike_share"] for row in rows),
        "statuses": dict(Counter(row["status"].split(" (at")[0] for row in rows).most_common()),
        "slowest_seconds": max(row["seconds"] for row in rows),
        "memory_growth": float(memory[half:].mean() / memory[:half].mean() - 1.0) if enough else None,
        "notable": wrong[:50],
    }


def study_soak(
    *,
    count: Annotated[int, typer.Option(help="Protocols inside the box.")] = 100_000,
    beyond: Annotated[int, typer.Option(help="Protocols beyond the box.")] = 20_000,
    stiff: Annotated[int, typer.Option(help="Stiff contacts, with and without adhesion.")] = 3_000,
    seed: Seed = 11,
    jobs: Jobs = 2,
    folder: Annotated[Path, typer.Option(help="Folder in which the chunks are kept.")] = KEPT,
) -> dict[str, Any]:
    """The soak: random scenes of every kind, and how each ends. It goes on where it stopped."""
    result: dict[str, Any] = {"accuracy": ACCURACY, "seed": seed, "solver": SOLVER_VERSION}
    for where, total in (("inside", count), ("beyond", beyond), ("stiff", stiff)):
        tasks = [(where, first, total, seed, folder) for first in range(0, total, CHUNK)]
        chunks = in_parallel(chunk, tasks, jobs=jobs, label=f"{where}, chunks of {CHUNK}")
        if chunks:
            result[where] = summary(chunks)
    return result

"""Random viscoelastic scenes of Tabor parameters from 20 to 3,000: how each ends, what it costs, and its bounds.

The solids are standard linear ones and Prony series, the laws those of the package. A cycle with a dwell is moved by
the stage, behind a spring, or by a prescribed force, at rates over six decades, each of loading and unloading its own.
The accuracy is that of a draft. A trajectory that completes is held against bounds that hold for every method:

- all numbers are finite, and a closed loop gives no work;
- no tension exceeds that of a sharp crack in the glass, 1.5 / k, and no compression that of Hertz on the glass;
- no contact is larger than that of Johnson, Kendall and Roberts at the deepest indentation.

Some are simulated again at a quarter of the target. Seconds are those of the processor, without compilation; tables of
the solid, which a sharp crack needs once, are in them.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import typer

from bem import ForceProtocol, LoadingProtocol, Scene, Trajectory, simulate
from bem._support.wording import markdown_table
from bem.methods.closed_forms import hertz, jkr
from bem.problem.accuracy import resolve_accuracy
from bem.results.trajectory import is_completed
from bem.simulation import load_kernels
from experiments.cases import between, random_contact
from experiments.harness import CLOCK, Count, Jobs, Seed, in_parallel

DEVICES = ("stage", "spring", "force")
TABORS, RATES = (20.0, 60.0, 200.0, 700.0, 3000.0), (1e-3, 1e-1, 1.0, 10.0, 1e3)
"""Bounds of the classes of the table; rates are those of unloading, in mu h0 per retardation time."""
REFINEMENT = 4.0
QUANTITIES = ("pull_off_force", "max_compression", "hysteresis")
_AWAY = -4.0  # start and end of a cycle, in mu h0


def drawn(number: int, seed: int) -> tuple[Scene, LoadingProtocol | ForceProtocol, float]:
    """The random scene of a number, its protocol, and the rate of unloading."""
    random = np.random.default_rng((seed, number))
    tabor, material, law = random_contact(random, number, (TABORS[0], TABORS[-1]), (0.01, 0.9))
    peak, dwell = between(random, 0.3, 5.0), between(random, 1e-3, 10.0)
    loading, unloading = (between(random, RATES[0], RATES[-1]) for _ in range(2))
    device = DEVICES[number % len(DEVICES)]
    if device == "force":
        press = float(hertz.force_from_indentation(peak * tabor, tabor))
        times = np.cumsum([0.0, peak / loading, dwell, peak / unloading])
        return Scene(tabor, material, law), ForceProtocol(times, [0.0, press, press, 1.0]), unloading
    cycle = LoadingProtocol(
        peak_indentation=peak * tabor,
        loading_rate=loading * tabor,
        dwell_time=dwell,
        unloading_rate=unloading * tabor,
        start_indentation=_AWAY * tabor,
    )
    return Scene(tabor, material, law, between(random, 0.1, 100.0) if device == "spring" else None), cycle, unloading


def breaches(scene: Scene, trajectory: Trajectory) -> Iterator[str]:
    """Names of the bounds that a trajectory breaks by more than its accuracy."""
    force, depth, radius = trajectory.force, trajectory.indentation, trajectory.contact_radius
    more, k, deepest = 1.0 + trajectory.accuracy, scene.material.modulus_ratio, max(float(depth.max()), 0.0)
    if not all(np.isfinite(column).all() for column in (trajectory.time, force, depth, radius)):
        yield "finite"
    if force.max() > more * jkr.PULL_OFF_FORCE / k:
        yield "tension"
    if force.min() < more * float(hertz.force_from_indentation(deepest, scene.tabor)) / k:
        yield "compression"
    if radius.max() > more * float(jkr.contact_radius_from_indentation(deepest, scene.tabor)):
        yield "contact radius"
    if depth[0] == depth[-1] and trajectory.work() < -trajectory.accuracy * trajectory.turnover():
        yield "work"


def solved(number: int, seed: int, refine: bool) -> dict[str, Any]:
    """How one scene ended, which bounds it breaks, and how much its quantities change under refinement."""
    scene, protocol, rate = drawn(number, seed)
    load_kernels("sharp crack", "boundary elements")
    with CLOCK:
        trajectory = simulate(scene, protocol, "draft")
    row: dict[str, Any] = {"number": number, "tabor": scene.tabor, "rate": rate, "seconds": CLOCK.seconds}
    row |= {"status": trajectory.status, "method": trajectory.stats.method}
    if not trajectory.completed:
        return row
    row["breaches"] = list(breaches(scene, trajectory))
    if refine:
        fine = simulate(scene, protocol, resolve_accuracy("draft").target / REFINEMENT)
        values = ((getattr(trajectory, name), getattr(fine, name)) for name in QUANTITIES)
        row["change"] = max(abs(value - exact) / max(abs(exact), 1.0) for value, exact in values)
    return row


def page_text(large_tabor: Any) -> str:
    """Shares that complete, by rate and Tabor parameter, for docs/limits.md."""
    rows, table = large_tabor["scenes"], []
    for slow, fast in pairwise(RATES):
        cells = [f"{slow:g} to {fast:g}"]
        for low, high in pairwise(TABORS):
            cell = [row for row in rows if slow <= row["rate"] < fast and low <= row["tabor"] < high]
            cells.append(f"{sum(is_completed(row['status']) for row in cell)} of {len(cell)}")
        table.append(cells)
    heads = [f"$\\mu$ {low:g} to {high:g}" for low, high in pairwise(TABORS)]
    changes = [row["change"] for row in rows if "change" in row]
    seconds, breaking = np.array([row["seconds"] for row in rows]), sum(bool(row.get("breaches")) for row in rows)
    above = sum("in place of" in row["status"] for row in rows)
    text = (
        f"Each cell: scenes that complete, of all; {above} by a sharp crack that errs more than the target, which "
        f"their status says. Of {len(rows)} random ones {sum(seconds > 1.0)} "
        f"take more than 1 s of processor time, {seconds.max():.1f} s at most; {breaking} break a "
        f"physical bound. {len(changes)} were simulated again with a quarter of the target: pull-off force, largest "
        f"compression and hysteresis change by {100.0 * max(changes):.1f} % at most, in "
        f"{sum(change > large_tabor['target'] for change in changes)} scenes by more than the target. "
        f"Measured by `{large_tabor['command']}` on {large_tabor['host']}."
    )
    header = ["Rate ($\\mu h_0$ per retardation time)", *heads]
    return f"{markdown_table(header, table, 'l' + 'r' * len(heads))}\n\n{text}"


def study(
    *,
    count: Count = 300,
    refined: Annotated[int, typer.Option(help="Scenes to simulate again, more finely.")] = 60,
    seed: Seed = 17,
    jobs: Jobs = 1,
) -> dict[str, Any]:
    """Simulate random scenes of large Tabor parameters."""
    tasks = [(number, seed, number < refined) for number in range(count)]
    rows = in_parallel(solved, tasks, jobs=jobs, label="scenes")
    seconds = np.array([row["seconds"] for row in rows])
    summary = {
        "completed": sum(is_completed(row["status"]) for row in rows),
        "above_a_second": int(np.sum(seconds > 1.0)),
        "longest": float(seconds.max()),
        "breaches": sum(bool(row.get("breaches")) for row in rows),
    }
    return {"target": resolve_accuracy("draft").target, "summary": summary, "scenes": rows}

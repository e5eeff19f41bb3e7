"""Large Tabor parameters at draft accuracy: which random scenes complete, in what time, and with what error.

Scenes of Tabor parameters from 10 to 100 are elastic (a quarter) or standard linear solids, moved by the stage, behind
a spring, or by a prescribed force, at rates of over five decades. Every scene completes, or its status names the limit
that it met. Some that complete are simulated again with a quarter of the target error.
"""

from itertools import cycle, pairwise
from typing import Annotated, Any

import numpy as np
import typer

from bem import Elastic, ForceProtocol, LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem._support.wording import markdown_table
from bem.accuracy import resolve_accuracy
from bem.reference_solutions import hertz
from bem.trajectory import is_completed
from experiments.measurements.cases import rows_of
from experiments.measurements.harness import CLOCK, Count, Jobs, Seed, in_parallel

DEVICES = ("stage", "spring", "force")
TABORS, RATES = (10.0, 20.0, 45.0, 100.0), (1e-2, 1e-1, 1.0, 10.0, 100.0, 1e3)
"""Bounds of the classes of the table; rates are in units of mu h0 per retardation time."""
DWELL, REFINEMENT = 0.1, 4.0


def drawn(count: int, seed: int) -> list[dict[str, Any]]:
    """Random scenes, as rows of numbers."""
    generator = np.random.default_rng(seed)

    def between(low: float, high: float) -> np.ndarray:
        return np.exp(generator.uniform(np.log(low), np.log(high), count))

    columns = {
        "tabor": between(TABORS[0], TABORS[-1]),
        "rate": between(RATES[0], RATES[-1]),
        "depth": between(0.3, 4.0),
        "spring": between(0.1, 10.0),
        "modulus_ratio": np.where(generator.random(count) < 0.25, 1.0, between(0.01, 0.9)),
    }
    return [{"device": device, **row} for device, row in zip(cycle(DEVICES), rows_of(columns))]


def case(row: dict[str, Any]) -> tuple[Scene, LoadingProtocol | ForceProtocol]:
    """Scene and protocol of one row."""
    tabor, ratio = row["tabor"], row["modulus_ratio"]
    material = Elastic() if ratio == 1.0 else StandardLinearSolid(ratio)
    scene = Scene(tabor, material, spring=row["spring"] if row["device"] == "spring" else None)
    peak, rate = row["depth"] * tabor, row["rate"] * tabor
    if row["device"] == "force":
        press, ramp = float(hertz.force_from_indentation(peak, tabor)), peak / rate
        return scene, ForceProtocol([0.0, ramp, ramp + DWELL, 2.0 * ramp + DWELL], [0.0, press, press, 1.0])
    ramps = {"peak_indentation": peak, "loading_rate": rate, "dwell_time": DWELL, "unloading_rate": rate}
    return scene, LoadingProtocol(**ramps, start_indentation=-3 * tabor)


def solved(row: dict[str, Any], refine: bool) -> dict[str, Any]:
    """How one scene ended, and how much its largest compression and tension change under refinement."""
    simulate(Scene(1.0), LoadingProtocol(peak_indentation=2, loading_rate=1, dwell_time=0, unloading_rate=1))
    with CLOCK:
        found = simulate(*case(row), "draft")
    result = {**row, "status": found.status, "rung": found.stats.rung, "seconds": CLOCK.seconds}
    if refine and found.completed:
        fine = simulate(*case(row), resolve_accuracy("draft").target / REFINEMENT)
        scale = max(fine.pull_off_force, 1.0)
        result["change"] = max(
            abs(found.pull_off_force - fine.pull_off_force) / scale,
            abs(found.max_compression - fine.max_compression) / max(scale, abs(fine.max_compression)),
        )
    return result


def page_text(large_tabor: Any) -> str:
    """Shares that complete, by rate and Tabor parameter, for docs/limits.md."""
    rows, table = large_tabor["scenes"], []
    for slow, fast in pairwise(RATES):
        cells = [f"{slow:g} to {fast:g}"]
        for low, high in pairwise(TABORS):
            here = [row for row in rows if slow <= row["rate"] < fast and low <= row["tabor"] < high]
            cells.append(f"{sum(is_completed(row['status']) for row in here)} of {len(here)}")
        table.append(cells)
    heads = [f"$\\mu$ {low:g} to {high:g}" for low, high in pairwise(TABORS)]
    changes = [row["change"] for row in rows if "change" in row]
    longest = max(row["seconds"] for row in rows)
    text = (
        f"Each cell: scenes that complete, of all; {len(rows)} random ones, {longest:.1f} s of processor "
        f"time at most. {len(changes)} were simulated again with a quarter of the target: pull-off force and "
        f"largest compression change by {100.0 * max(changes):.1f} % at most, in "
        f"{sum(change > large_tabor['target'] for change in changes)} scenes by more than the target. "
        f"Measured by `{large_tabor['command']}` on {large_tabor['host']}."
    )
    header = ["Rate ($\\mu h_0$ per retardation time)", *heads]
    return f"{markdown_table(header, table, 'lrrr')}\n\n{text}"


def study(
    *,
    count: Count = 300,
    refined: Annotated[int, typer.Option(help="Scenes to simulate again, more finely.")] = 30,
    seed: Seed = 17,
    jobs: Jobs = 1,
) -> dict[str, Any]:
    """Simulate random scenes of large Tabor parameters."""
    tasks = [(row, number < refined) for number, row in enumerate(drawn(count, seed))]
    rows = in_parallel(solved, tasks, jobs=jobs, label="scenes")
    return {"target": resolve_accuracy("draft").target, "scenes": rows}

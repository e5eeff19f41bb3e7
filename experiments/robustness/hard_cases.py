"""Cases in which a contact solver is most likely to fail: extreme combinations, and the corners of the paper's box.

Each case is simulated at one accuracy and again with a quarter of the target error, which halves the spacing at the
contact edge and shortens the steps. The study reports how the simulation ended, the change of the pull-off force,
whether the loop created energy (its work compared with the integral of |P d(delta)|), the smallest eigenvalue of the
Jacobian at jumps, and seconds.
"""

from __future__ import annotations

import csv
import itertools
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem import Elastic, LoadingProtocol, Scene, StandardLinearSolid, Trajectory, simulate
from bem._support.provenance import provenance
from bem._support.wording import markdown_table
from bem.accuracy import resolve_accuracy
from bem.dataset.designs import PAPER_RANGES, QUANTITIES
from bem.effects.scene_effects import IndentationProtocol
from bem.protocol import default_start_indentation
from experiments.timing import Jobs, in_parallel

OUT = Path("results/solver/hard_cases.csv")
REPORT = Path("docs/solver-hard-cases.md")
ACCURACY = "standard"
TARGET = resolve_accuracy(ACCURACY).target
REFINEMENT = 4.0
RATES = (1e-3, 1e-1, 1e1, 1e3, 1e5)
VALUES = {
    "tabor": (0.02, 0.2, 1.0, 3.2, 5.0),
    "modulus_ratio": (1.0, 0.1, 0.01, 0.001),
    "loading_rate": RATES,
    "unloading_rate": RATES,
    "dwell_time": (0.0, 1e-6, 1.0, 1e3),
    "peak_indentation": (-1.0, 0.5, 10.0, 100.0, 500.0),
}
SHALLOWEST = -0.02
"""Peak indentation that replaces a peak below the start, for which the sphere would only move away."""
DEEPEST_FOR_LARGE_TABOR = 100.0  # peak indentation, if the Tabor parameter exceeds 1
ENERGY_TOLERANCE = 1e-3

Case = dict[str, Any]


def random_combinations(count: int, seed: int) -> list[Case]:
    """Distinct random combinations of `VALUES`, each with a peak above its start."""
    possible = [dict(zip(VALUES, values, strict=True)) for values in itertools.product(*VALUES.values())]
    possible = [
        case for case in possible if case["tabor"] <= 1.0 or case["peak_indentation"] <= DEEPEST_FOR_LARGE_TABOR
    ]
    for case in possible:
        if case["peak_indentation"] <= default_start_indentation(case["tabor"]):
            case["peak_indentation"] = SHALLOWEST
    drawn = np.random.default_rng(seed).permutation(len(possible))[:count]
    return [{"kind": "random", **possible[i]} for i in drawn]


def corners() -> list[Case]:
    """The corners of the paper's box."""
    return [
        {"kind": "corner", "modulus_ratio": 0.1, **dict(zip(PAPER_RANGES, values, strict=True))}
        for values in itertools.product(*PAPER_RANGES.values())
    ]


def scene_of(case: Case) -> tuple[Scene, LoadingProtocol]:
    """Scene and protocol of a case."""
    ratio = case["modulus_ratio"]
    scene = Scene(tabor=case["tabor"], material=StandardLinearSolid(ratio) if ratio < 1.0 else Elastic())
    return scene, LoadingProtocol(**{name: case[name] for name in QUANTITIES[1:]})


def pair(scene: Scene, protocol: IndentationProtocol) -> tuple[Trajectory, Trajectory]:
    """Trajectories of one case at both accuracies."""
    simulate(*scene_of(corners()[0]), "draft")  # loads the kernels, so that the first call of a process is not timed
    return simulate(scene, protocol, ACCURACY), simulate(scene, protocol, TARGET / REFINEMENT)


def energy(trajectory: Trajectory) -> float:
    """Work of the trajectory over its turnover; NaN if it did not complete."""
    return trajectory.work() / trajectory.turnover() if trajectory.completed else np.nan


def relative_change(value: float, reference: float) -> float:
    """Change of a force from its reference; zero where both vanish, as without adhesion."""
    return 0.0 if value == reference else abs(value / reference - 1.0) if reference else np.inf


def compared(coarse: Trajectory, fine: Trajectory) -> dict[str, Any]:
    """Status, cost and results of both trajectories, and the change of the results."""
    both = coarse.completed and fine.completed
    return {
        "status": coarse.status,
        "refined_status": fine.status,
        "finite": bool(np.all(np.isfinite(coarse.force))),
        "pull_off_force": coarse.pull_off_force,
        "refined_pull_off_force": fine.pull_off_force,
        "change": relative_change(coarse.pull_off_force, fine.pull_off_force) if both else np.nan,
        "work_change": abs(coarse.work() - fine.work()) / fine.turnover() if both else np.nan,
        "energy": energy(coarse),
        "refined_energy": energy(fine),
        "end_over_pull_off": coarse.end_force / coarse.pull_off_force if coarse.pull_off_force else np.nan,
        "jumps": len(coarse.jumps),
        "refined_jumps": len(fine.jumps),
        "steps": coarse.stats.steps,
        "nodes": coarse.stats.nodes,
        "seconds": coarse.stats.seconds,
        "refined_seconds": fine.stats.seconds,
    }


def examined(case: Case) -> Case:
    """The case with all its reported quantities."""
    coarse, fine = pair(*scene_of(case))
    before, after = ([getattr(jump, f"eigenvalue_{side}") for jump in coarse.jumps] for side in ("before", "after"))
    eigenvalues = {
        "largest_eigenvalue_before": max(map(abs, before), default=np.nan),
        "smallest_eigenvalue_after": min(after, default=np.nan),
    }
    return {**case, **compared(coarse, fine), **eigenvalues}


def markdown(rows: list[Case], origin: dict[str, Any]) -> str:
    """Summary of the table as a Markdown document."""
    lines = [
        "# Hard cases",
        "",
        f"Written by `{origin['command']}`; do not edit. Each line of the table it summarises, `{OUT}`, is one case at "
        f"accuracy {ACCURACY} (target {TARGET:g}) and at a quarter of that target.",
        "",
        f"Machine: {origin['host']}, all cores shared by the cases.",
        "",
    ]
    titles = {"random": "Random combinations", "corner": "Corners of the paper's box"}
    kinds = {title: [row for row in rows if row["kind"] == kind] for kind, title in titles.items()}
    columns = {title: _summary(group) for title, group in kinds.items() if group}
    names = next(iter(columns.values()))
    lines.append(
        markdown_table(["Quantity", *columns], [[name, *(one[name] for one in columns.values())] for name in names])
    )
    unfinished = Counter(row["status"].split(" (at")[0] for row in rows if row["status"] != "completed")
    if unfinished:
        lines += ["", "## Not completed", "", *(f"- {times} x {status}" for status, times in unfinished.most_common())]
    moved = sorted((row for row in rows if row["change"] > TARGET), key=lambda row: -row["change"])
    if moved:
        names = [*VALUES, "pull_off_force", "refined_pull_off_force", "change", "jumps", "refined_jumps"]
        lines += ["", f"## Pull-off force moves by more than {TARGET:g} when refined", ""]
        cells = [[f"{row[name]:.5g}" for name in names] for row in moved]
        lines.append(markdown_table([name.replace("_", " ") for name in names], cells))
    return "\n".join([*lines, ""])


def _summary(rows: list[Case]) -> dict[str, str]:
    change = np.array([row["change"] for row in rows])
    known = change[np.isfinite(change)]
    work = np.array([row["energy"] for row in rows])
    seconds = np.array([row["seconds"] for row in rows])
    with_jumps = [row for row in rows if row["jumps"]]
    before = [row["largest_eigenvalue_before"] for row in with_jumps]
    after = [row["smallest_eigenvalue_after"] for row in with_jumps]
    middle, high, highest = np.percentile(known, [50.0, 95.0, 100.0])
    return {
        "cases": str(len(rows)),
        "completed with finite numbers": str(sum(row["status"] == "completed" and row["finite"] for row in rows)),
        "refined and completed as well": str(len(known)),
        "change of the pull-off force, median / 95th / largest (%)": f"{100 * middle:.2g} / {100 * high:.2g} / "
        f"{100 * highest:.2g}",
        "move by more than the target": str(int(np.sum(known > TARGET))),
        "loops that create energy (work below -0.1 % of the energy exchanged, the integral of abs(P d(delta)))": str(
            int(np.sum(work < -ENERGY_TOLERANCE))
        ),
        "smallest work over energy exchanged": f"{np.nanmin(work):.2g}",
        "cases with jumps": str(len(with_jumps)),
        "smallest eigenvalue before a jump, median / largest": f"{np.median(before):.2g} / {np.max(before):.2g}"
        if before
        else "-",
        "smallest eigenvalue after a jump, smallest": f"{np.min(after):.2g}" if after else "-",
        "seconds, median / mean / largest": f"{np.median(seconds):.3g} / {seconds.mean():.3g} / {seconds.max():.3g}",
    }


def main(
    count: Annotated[int, typer.Option(help="Random combinations.")] = 400,
    seed: Annotated[int, typer.Option(help="Seed of the combinations.")] = 1,
    jobs: Jobs = 2,
    out: Annotated[Path, typer.Option(help="Table to write.")] = OUT,
    report: Annotated[Path, typer.Option(help="Summary to write.")] = REPORT,
) -> None:
    """Run all cases, write the table and its summary."""
    cases = corners() + random_combinations(count, seed)
    # The most expensive cases run first, so that the other cores do not wait for the last one.
    order = sorted(cases, key=lambda case: -case["tabor"] * max(case["peak_indentation"], 0.0))
    rows = in_parallel(examined, [(case,) for case in order], jobs=jobs, label="hard cases", ordered=False)
    rows.sort(key=lambda row: tuple(row[name] for name in ("kind", *VALUES)))
    out.parent.mkdir(parents=True, exist_ok=True)
    with out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    summary = markdown(rows, provenance(f"python -m experiments hard_cases --count {count} --seed {seed}"))
    report.write_text(summary, encoding="utf-8")
    print(summary)

"""How exact the sharp crack is: random histories of Tabor parameters from 10 to 40, beside boundary elements.

The solids are standard linear ones and Prony series, the laws are those of the package. Cycles with dwells, reloads and
holds are moved by the stage or behind a spring. Only histories are compared that `simulate` answers by the sharp crack
within the loosest accuracy. Boundary elements answer each at two targets; where the two differ by more than a fifth of
the crack's expected error, they have not settled, and where one does not complete, there is no reference: both are left
out and counted. Half of the histories give the factor of the error estimate that covers 95 % of the errors, the others
judge it. What boundary elements gave is kept in files, so that the same command continues.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem import PiecewiseLinearProtocol, Scene, simulate
from bem.methods.sharp_crack import STEP_ERROR, ZONE_ERROR
from bem.methods.version import SOLVER_VERSION
from bem.problem.accuracy import LOOSEST
from bem.problem.protocol import default_start_indentation
from experiments.cases import between, random_contact
from experiments.harness import Count, Jobs, Seed, fingerprint, in_parallel, kept

KEPT = Path("results/sharp_crack_error")
TARGETS = (5e-3, 2e-3)
MOST_WORK = 1e10  # of one reference
SETTLED = 0.2  # difference of the two references, over the expected error
COVERED = 0.95
QUANTITIES = ("pull_off_force", "hysteresis")


def history(number: int, seed: int) -> tuple[Scene, PiecewiseLinearProtocol]:
    """The random history of a number."""
    random = np.random.default_rng((seed, number))
    tabor, material, law = random_contact(random, number, (10.0, 40.0), (0.02, 0.5))
    start, peak = default_start_indentation(1.0), between(random, 0.5, 5.0)
    load, unload = between(random, 0.1, 100.0), between(random, 0.03, 1000.0)
    depths, rates = [start, peak], [load]
    if random.random() < 0.3:  # a reload, or a hold on the way
        middle = random.uniform(-0.5, 0.7 * peak)
        depths += [middle, middle if random.random() < 0.5 else random.uniform(middle, peak)]
        rates += [unload, load]
    depths, rates = [*depths, 2.0 * start], [*rates, unload]
    times, path = [0.0], [depths[0]]
    for depth, rate in zip(depths[1:], rates, strict=True):
        times.append(times[-1] + (abs(depth - path[-1]) / rate or between(random, 0.01, 3.0)))
        path.append(depth)
        if len(path) == 2 and random.random() < 0.7:
            times.append(times[-1] + between(random, 0.01, 10.0))
            path.append(depth)
    spring = between(random, 1.0, 100.0) / tabor if random.random() < 0.2 else None
    return Scene(tabor, material, law, spring), PiecewiseLinearProtocol(times, tabor * np.array(path))


def references(number: int, seed: int, folder: Path) -> dict[str, Any]:
    """Quantities of one history by boundary elements at each target, as far as they complete, and the last status."""
    scene, path = history(number, seed)

    def solved() -> dict[str, Any]:
        values, seconds, status = [], 0.0, ""
        for target in TARGETS:  # boundary elements answer where profiles are asked for
            trajectory = simulate(scene, path, target, profiles=[path.times[-1]], most_work=MOST_WORK)
            seconds, status = seconds + trajectory.stats.seconds, trajectory.status
            if not trajectory.completed:
                break
            values.append({name: getattr(trajectory, name) for name in QUANTITIES})
        return {"values": values, "seconds": seconds, "status": status}

    key = fingerprint(solver=SOLVER_VERSION, targets=TARGETS, work=MOST_WORK, history=repr((scene, path)))
    return kept(folder / f"{number}-{key}.json", solved)


def compared(number: int, seed: int, folder: Path) -> dict[str, Any]:
    """One history by the sharp crack, beside what is kept of boundary elements."""
    scene, path = history(number, seed)
    crack = simulate(scene, path, LOOSEST)
    row = {"number": number, "tabor": scene.tabor, "terms": scene.material.strengths.size}
    if crack.stats.method != "sharp crack":
        return row | {"outcome": "out of reach"}
    reference = references(number, seed, folder)
    row |= {"expected": crack.accuracy, "seconds": crack.stats.seconds}
    if len(reference["values"]) < len(TARGETS):
        return row | {"outcome": "no reference", "status": reference["status"]}
    coarse, fine = reference["values"]
    change = max(abs(coarse[name] / fine[name] - 1.0) for name in QUANTITIES)
    outcome = "compared" if change <= SETTLED * crack.accuracy else "not settled"
    error = {name: getattr(crack, name) / fine[name] - 1.0 for name in QUANTITIES}
    return row | {"outcome": outcome, "change": change, "error": error}


def factor(rows: list[dict[str, Any]], name: str) -> float:
    """Of the root of the zone's length, that covers the errors of a quantity; the error by steps is given."""
    roots = np.array([(row["expected"] - STEP_ERROR) / ZONE_ERROR for row in rows])
    errors = np.array([abs(row["error"][name]) for row in rows])
    return float(np.quantile((errors - STEP_ERROR) / roots, COVERED))


def limits_text(sharp_crack_error: Any) -> str:
    """How often the expected error holds, for docs/limits.md."""
    rows, judging = sharp_crack_error["histories"], sharp_crack_error["summary"]["judging"]
    compared = [row for row in rows if row["outcome"] == "compared"]
    texts = []
    for name in QUANTITIES:
        errors = 100.0 * np.array([abs(row["error"][name]) for row in compared])
        half, most, all_of = np.quantile(errors, (0.5, 0.9, 1.0))
        words, within = name.replace("pull_off", "pull-off").replace("_", " "), 100.0 * judging[name]["within"]
        texts.append(f"{words} {half:.2f}, {most:.1f} and {all_of:.1f} %, within the expected error in {within:.0f} %")
    return (
        f"Of {len(rows)} random histories, {len(compared)} that boundary elements settle: at the median, the 90th "
        f"percentile and at most {'; '.join(texts)} of the half that judges"
    )


def study(
    *,
    count: Count = 500,
    seed: Seed = 23,
    jobs: Jobs = 1,
    folder: Annotated[Path, typer.Option(help="Folder of what boundary elements gave.")] = KEPT,
) -> dict[str, Any]:
    """Compare random histories; it goes on where it stopped."""
    rows = in_parallel(compared, [(i, seed, folder) for i in range(count)], jobs=jobs, label="histories")
    outcomes = [row["outcome"] for row in rows]
    chosen = [row for row in rows if row["outcome"] == "compared"]
    summary: dict[str, Any] = {name: outcomes.count(name) for name in sorted(set(outcomes))}
    halves = {"giving": chosen[::2], "judging": chosen[1::2]}
    for half, members in halves.items():
        for name in QUANTITIES:
            errors = np.array([abs(row["error"][name]) for row in members])
            within = errors <= [row["expected"] for row in members]
            summary[half] = summary.get(half, {}) | {
                name: {"within": float(np.mean(within)), "factor": factor(members, name), "median": np.median(errors)}
            }
    return {"targets": TARGETS, "zone_error": ZONE_ERROR, "summary": summary, "histories": rows}

"""The solver of the working tree compared with that of another git revision, on scenes beyond the paper's box.

The samples are those of `experiments.robustness.soak`: 'beyond' has Tabor parameters, depths, rates and modulus ratios
far outside the box, 'stiff' has nearly rigid contacts and stiff glasses, half of them without adhesion, and 'elastic'
is 'beyond' without memory. Each scene is judged by itself, so that a few expensive ones do not hide a slower cheap one.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from experiments.robustness.soak import points_of, protocols
from experiments.solver.revision_comparison import NOW, commit_of, ratio, source_of
from experiments.solver.solver_processes import ROOT, Request, Solver, in_turn

SAMPLES = ("beyond", "stiff", "elastic")
SLOWER = 1.2
"""Ratio of the processor seconds of a scene above which it counts as slower."""
SUSPECT = 1.1
"""Ratio above which a scene is run again more often: the least of a few times of a millisecond is not yet its cost."""
AGAIN = 25
LISTED = 8


def requests(sample: str, count: int, seed: int) -> list[Request]:
    """Requests of a sample, without measurement steps."""
    columns = protocols("beyond" if sample == "elastic" else sample, count, seed)
    if sample == "elastic":
        columns["modulus_ratio"] = np.ones(count)
    scene = ("tabor", "modulus_ratio", "adhesion")
    return [
        {
            **{name: point.pop(name) for name in scene if name in point},
            "protocol": point,
            "times": [],
        }
        for point in points_of(columns)
    ]


def compare(baseline: str, accuracy: str | float, count: int, seed: int, repeats: int) -> dict[str, Any]:
    """Run both solvers on all samples.

    Args:
        baseline: Git revision to compare with.
        accuracy: Name or target error.
        count: Scenes of each sample.
        seed: Seed of the draw.
        repeats: Most runs of each solver; the fastest counts for each scene. Scenes above `SUSPECT` have `AGAIN` more.

    Returns:
        For each sample the requests, and for each solver the least processor seconds of each scene and its status.

    Raises:
        ValueError: There is no such revision.
    """
    solvers = {baseline: Solver(source_of(baseline)), NOW: Solver(ROOT)}
    samples = {}
    for sample in SAMPLES:
        asked = requests(sample, count, seed)
        answers = in_turn(solvers, asked, accuracy, repeats)
        suspect = np.flatnonzero(answers[NOW][0] > SUSPECT * answers[baseline][0])
        if suspect.size:
            for name, (seconds, _) in in_turn(solvers, [asked[i] for i in suspect], accuracy, AGAIN).items():
                answers[name][0][suspect] = np.minimum(answers[name][0][suspect], seconds)
        found = {
            name: {"seconds_each": seconds.tolist(), "statuses": [answer["status"] for answer in answered]}
            for name, (seconds, answered) in answers.items()
        }
        samples[sample] = {"scenes": asked, "solvers": found, **judged(found[NOW], found[baseline])}
    for solver in solvers.values():
        solver.close()
    return {"baseline": commit_of(baseline), "accuracy": str(accuracy), "samples": samples}


def judged(new: Mapping[str, Any], old: Mapping[str, Any]) -> dict[str, Any]:
    """Ratios of the seconds of each scene that both completed, new over old, and what either did not complete."""
    done = [[status == "completed" for status in one["statuses"]] for one in (new, old)]
    both = np.logical_and(*done)
    seconds = [np.asarray(one["seconds_each"]) for one in (new, old)]
    each = np.where(both, seconds[0] / seconds[1], np.nan)
    return {
        "ratios": [float(value) if np.isfinite(value) else None for value in each],
        "ratio": ratio(seconds[0][both], seconds[1][both]),
        "slower": int(np.sum(each > SLOWER)),
        "not_completed": {"new": int(np.sum(~np.array(done[0]))), "old": int(np.sum(~np.array(done[1])))},
    }


def show(content: dict[str, Any]) -> None:
    """Print one line for each sample, and the scenes whose ratio is largest."""
    columns = ("Sample", "Scenes", "Before (ms)", "Now (ms)", "Ratio of sums", "Median", "95th", "Largest")
    table = Table(*columns, f"Above {SLOWER:g}", "Not completed, before / now", box=box.SIMPLE_HEAD)
    table.caption = f"Beyond the paper's box at {content['accuracy']}: ratio of processor seconds, scene by scene"
    worst: list[tuple[float, str, Request, float, float]] = []
    for sample, found in content["samples"].items():
        old, new = (np.asarray(one["seconds_each"]) for one in found["solvers"].values())
        each = np.array(found["ratios"], dtype=float)
        middle = np.nanpercentile(each, [50.0, 95.0, 100.0])
        failed = found["not_completed"]
        cells = [sample, str(each.size), f"{1e3 * old.mean():.3g}", f"{1e3 * new.mean():.3g}"]
        cells += [f"{found['ratio'][0]:.3f}", *(f"{value:.2f}" for value in middle)]
        table.add_row(*cells, str(found["slower"]), f"{failed['old']} / {failed['new']}")
        known = np.flatnonzero(np.isfinite(each))
        worst += [(float(each[i]), sample, found["scenes"][i], 1e3 * old[i], 1e3 * new[i]) for i in known]
    listed = Table("Ratio", "Sample", "Before (ms)", "Now (ms)", "Scene and protocol", box=box.SIMPLE_HEAD)
    for value, sample, scene, before, now in sorted(worst, key=lambda one: -one[0])[:LISTED]:
        listed.add_row(f"{value:.2f}", sample, f"{before:.2f}", f"{now:.2f}", described(scene))
    console = Console(width=None if sys.stdout.isatty() else 150)
    console.print(table)
    console.print(listed)


def described(scene: Request) -> str:
    """A scene and its protocol in one line."""
    words = {name: value for name, value in scene.items() if name not in ("protocol", "times")} | scene["protocol"]
    return ", ".join(f"{name.replace('_', ' ')} {value:.3g}" for name, value in words.items())

"""The solver of the working tree compared with that of another git revision: cost and delivered errors in one run.

Both solve the same protocols, which fill the paper's box off the grid of the data set. They run in two processes that
take turns, so that the ratio of their processor seconds is valid on a machine of any speed and load. Errors are against
one solution, refined beyond `reference` by a fixed revision. Checked-out revisions are kept in
`results/solver/revisions`.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tarfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from bem.accuracy import resolve_accuracy
from experiments.solver.solver_processes import EXACT_TARGET, ROOT, WORK, Solver, drawn, in_turn, judged, refined

KEPT = Path("results/solver/revisions")
ACCURACIES: tuple[str | float, ...] = ("draft", 1e-2, "standard", 2e-3, 1e-3, 3e-4, "reference")
NOW = "now"
ERRORS = {"pull_off_force": ("median", "p95"), "hysteresis": ("median", "p95", "largest"), "force": ("median", "p95")}


def commit_of(revision: str) -> str:
    """Hash of the commit of a git revision.

    Raises:
        ValueError: There is no such revision.
    """
    command = ["git", "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(f"baseline must be a git revision; received {revision!r}")
    return done.stdout.strip()


def checked_out(revision: str, folder: Path) -> Path:
    """Extract the package `bem` of a git revision into `folder`, and return `folder`.

    Raises:
        ValueError: There is no such revision.
    """
    command = ["git", "archive", commit_of(revision), "bem"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        archive.extractall(folder, filter="data")
    return folder


def source_of(revision: str) -> Path:
    """Folder of the package of a revision; it is kept, together with its compiled kernels."""
    folder = (KEPT / commit_of(revision)[:12]).resolve()
    return folder if (folder / "bem" / "__init__.py").is_file() else checked_out(revision, folder)


def ratio(new: Sequence[float], old: Sequence[float], draws: int = 2000) -> tuple[float, float, float]:
    """Ratio of the mean seconds, new over old, and its 95 % interval by resampling the protocols."""
    new, old = np.asarray(new), np.asarray(old)
    chosen = np.random.default_rng(0).integers(len(new), size=(draws, len(new)))
    low, high = np.percentile(new[chosen].sum(axis=1) / old[chosen].sum(axis=1), [2.5, 97.5])
    return float(new.sum() / old.sum()), float(low), float(high)


def compare(
    baseline: str, exact_by: str, accuracies: Sequence[str | float], count: int, seed: int, repeats: int, jobs: int
) -> dict[str, Any]:
    """Run both solvers and compare them at each accuracy.

    Args:
        baseline: Git revision to compare with.
        exact_by: Git revision whose refined solutions count as exact.
        accuracies: Names or target errors.
        count: Protocols.
        seed: Seed of the draw.
        repeats: Most runs of each solver, as far as `BUDGET` allows; the fastest counts for each protocol.
        jobs: Processes for the refined solutions, which are not timed.
    """
    requests = drawn(count, seed)
    sources = {baseline: source_of(baseline), NOW: ROOT}
    exact = refined(requests, source_of(exact_by), commit_of(exact_by), jobs)
    solvers = {name: Solver(source) for name, source in sources.items()}
    levels = []
    for accuracy in accuracies:
        found = in_turn(solvers, requests, accuracy, repeats)
        target = resolve_accuracy(accuracy).target
        solved = {name: judged(*answers, exact, target) for name, answers in found.items()}
        speed = ratio(found[NOW][0], found[baseline][0])
        levels.append({"accuracy": str(accuracy), "ratio": speed, "solvers": solved})
    for solver in solvers.values():
        solver.close()
    content = {"baseline": commit_of(baseline), "refined_by": commit_of(exact_by), "refined_target": EXACT_TARGET}
    return {**content, "protocols": requests, "levels": levels}


def show(content: dict[str, Any]) -> None:
    """Print cost and errors, two lines for each accuracy."""
    cost = ["Accuracy", "Solver", "CPU (ms)", "Ratio", "95 % interval", *(name.capitalize() for name in WORK), "Failed"]
    wrong = [f"{name.replace('_', ' ').capitalize()}: {' / '.join(of)}" for name, of in ERRORS.items()]
    tables = Table(*cost), Table("Accuracy", "Solver", *wrong, "Compared")
    for level in content["levels"]:
        speed, low, high = level["ratio"]
        for name, found in level["solvers"].items():
            first, last = [level["accuracy"], name[:12]], name == NOW
            cells = [f"{1e3 * found['seconds']['mean']:.2f}"]
            cells += [f"{speed:.3f}", f"{low:.3f} to {high:.3f}"] if last else ["", ""]
            cells += [f"{found['work'][one]:.0f}" if one in found["work"] else "" for one in WORK]
            tables[0].add_row(*first, *cells, str(len(found["failures"])), end_section=last)
            errors = found["errors"]
            cells = [
                " / ".join(f"{100 * errors[one][of]:.2g}" for of in ERRORS[one]) if errors else "" for one in ERRORS
            ]
            tables[1].add_row(*first, *cells, str(found["compared"]), end_section=last)
    for table, caption in zip(tables, ("cost, means", "errors in percent"), strict=True):
        table.box, table.caption = box.SIMPLE_HEAD, f"{len(content['protocols'])} protocols: {caption}"
        Console(width=None if sys.stdout.isatty() else 130).print(table)

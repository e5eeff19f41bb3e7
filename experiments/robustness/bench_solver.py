"""The solver of the working tree beside that of another git revision: the ratio of their cost, and the errors of both.

Each solver runs in a process of its own. They take turns, so that the ratio of their processor seconds is valid on a
machine of any speed and load. Protocols fill the paper's box, off the grid of the data set; there, errors are against
one solution, refined beyond `reference` by the other revision. Samples beyond the box compare cost and completion. What
the solver of the working tree costs by itself is measured by `experiments.measurements.accuracy_cost`.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tarfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.command_line import parse_accuracy
from bem._support.wording import markdown_table
from bem.accuracy import resolve_accuracy
from bem.trajectory import is_completed
from experiments.measurements.cases import Case, drawn, rows_of
from experiments.measurements.harness import Count, Seed, progress
from experiments.measurements.statistics import answer_errors, spread
from experiments.measurements.tools import EXACT_TARGET

ROOT = Path(__file__).resolve().parents[2]
KEPT = Path("results/solver/revisions")
ACCURACIES: tuple[str | float, ...] = ("draft", 1e-2, "standard", 2e-3, 1e-3, 3e-4, "reference")
BEYOND = ("beyond", "stiff", "elastic")
HEADS = ["Sample", "Accuracy", "Scenes", "Before / now (ms)", "Ratio of sums", "Largest ratio", "Not completed"]
HEADS += ["Pull-off error (%): median, 95th, largest; before / now", "Hysteresis error (%)", "Force error (%)"]


class Solver:
    """The solver of one source folder, in a process of its own.

    Raises:
        RuntimeError: The process ended, or imported another package.
    """

    def __init__(self, source: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(source), "OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-P", str(Path(__file__).with_name("solver_child.py"))]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "bufsize": 1}
        self._process = subprocess.Popen(command, text=True, cwd=source, env=environment, **pipes)
        self.close = self._process.communicate
        package = Path(self._said())
        if not package.is_relative_to(source):
            self.close()
            raise RuntimeError(f"the solver must come from {str(source)!r}; received {str(package)!r}")

    def __call__(self, request: dict[str, Any], accuracy: str | float) -> dict[str, Any]:
        """Answer to a request, both as `solver_child` defines them."""
        self._process.stdin.write(json.dumps({**request, "accuracy": accuracy}) + "\n")
        return json.loads(self._said())

    def _said(self) -> str:
        if line := self._process.stdout.readline():
            return line.rstrip("\n")
        raise RuntimeError(f"a solver's process ended with status {self._process.wait()}")


def source_of(revision: str) -> Path:
    """Folder with the package `bem` of a git revision; it is kept, together with its compiled kernels.

    Raises:
        ValueError: There is no such revision.
    """
    command = ["git", "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(f"baseline must be a git revision; received {revision!r}")
    commit = done.stdout.strip()
    folder = (KEPT / commit[:12]).resolve()
    if not (folder / "bem" / "__init__.py").is_file():
        archive = subprocess.run(["git", "archive", commit, "bem"], cwd=ROOT, capture_output=True, check=True).stdout
        with tarfile.open(fileobj=io.BytesIO(archive)) as opened:
            opened.extractall(folder, filter="data")
    return folder


def requests(where: str, count: int, seed: int) -> list[dict[str, Any]]:
    """Requests to simulate protocols of a set of `cases.drawn`, inside the box with their measurement steps."""
    rows = rows_of(drawn(where, count, seed))
    return [row | {"times": Case.of(row).steps.tolist() if where == "inside" else []} for row in rows]


def table_of(answers: Sequence[dict[str, Any]], size: int = 120) -> np.ndarray:
    """Pull-off force, hysteresis and `size` forces of each answer; NaN where it did not complete."""
    return np.array([one.get("results") or np.full(size + 2, np.nan) for one in answers], dtype=float)


def compared(
    solvers: Sequence[Any], sample: str, accuracy: str | float, asked: list[dict[str, Any]], exact: Any, repeats: int
) -> dict[str, Any]:
    """Two solvers, the other revision's first, on one sample: cost where both completed, and errors inside the box.

    The solvers take turns, each first every other time, and the fastest run counts. `exact` are refined answers of
    shape (n, 122) inside the box, otherwise `None`.
    """
    seconds = np.full((len(solvers), len(asked)), np.inf)
    answers: list[list[dict[str, Any]]] = [[{}] * len(asked) for _ in solvers]
    for solver in solvers:
        solver(asked[0], accuracy)  # kernels are compiled or loaded by the first call
    for repeat in range(repeats):
        for i, request in enumerate(progress(asked, f"accuracy {accuracy}, run {repeat + 1} of {repeats}")):
            for place in range(len(solvers))[:: 1 if (i + repeat) % 2 else -1]:
                answers[place][i] = answer = solvers[place](request, accuracy)
                seconds[place, i] = min(seconds[place, i], answer["seconds"])
    done = np.array([[is_completed(one["status"]) for one in each] for each in answers])
    before, now = seconds[:, done.all(axis=0)]
    errors = [answer_errors(table_of(each), exact) for each in answers] if exact is not None else []
    return {
        "sample": sample,
        "accuracy": str(accuracy),
        "scenes": asked,
        "seconds": seconds,
        "errors": [{name: spread(values) for name, values in each.items()} for each in errors],
        "ratio": now.sum() / before.sum(),
        "largest_ratio": np.max(now / before, initial=0.0),
        "not_completed": np.sum(~done, axis=1).tolist(),
    }


def row_of(one: dict[str, Any]) -> list[str]:
    """A comparison as a row of the table; errors are median, 95th percentile and largest."""
    cells = [one["sample"], one["accuracy"], str(len(one["scenes"]))]
    cells += [" / ".join(f"{1e3 * np.mean(values):.3g}" for values in one["seconds"])]
    cells += [f"{one['ratio']:.3f}", f"{one['largest_ratio']:.2f}", " / ".join(map(str, one["not_completed"]))]
    for name in ("pull_off_force", "hysteresis", "force"):
        errors = [[100.0 * found[name][key] for key in ("median", "p95", "largest")] for found in one["errors"]]
        cells.append(" / ".join(", ".join(f"{value:.2g}" for value in each) for each in errors))
    return cells


def study(
    *,
    count: Count = 300,
    seed: Seed = 1,
    baseline: Annotated[str, typer.Option(help="Git revision to compare with.")] = "HEAD",
    accuracy: Annotated[list[str] | None, typer.Option(help="Accuracy; repeatable.")] = None,
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each solver; the fastest counts.")] = 3,
    beyond: Annotated[int, typer.Option(min=0, help="Scenes of each sample beyond the box.")] = 100,
) -> dict[str, Any]:
    """Compare and print the table."""
    accuracies = tuple(map(parse_accuracy, accuracy or ())) or ACCURACIES
    for one in accuracies:
        resolve_accuracy(one)  # before anything runs
    source = source_of(baseline)
    solvers = [Solver(source), Solver(ROOT)]
    inside = requests("inside", count, seed)
    exact = table_of([solvers[0](one, EXACT_TARGET) for one in progress(inside, "refined solutions")])
    comparisons = [compared(solvers, "inside", one, inside, exact, repeats) for one in accuracies]
    for sample in BEYOND if beyond else ():
        comparisons.append(compared(solvers, sample, "standard", requests(sample, beyond, seed), None, repeats))
    for solver in solvers:
        solver.close()
    print(markdown_table(HEADS, [row_of(one) for one in comparisons]))
    return {"baseline": source.name, "comparisons": comparisons}

"""The solver of the working tree beside that of another revision, on random protocols of the paper's box.

Two processes, each with one of both solvers, answer all protocols in turn, so that a busy machine slows both.
Seconds are those of the processor, and of each protocol the fastest run counts.
"""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.wording import markdown_table
from experiments.cases import drawn, rows_of
from experiments.harness import Count, Seed, progress

ROOT = Path(__file__).resolve().parents[2]
HEADS = ["Accuracy", "Before (ms)", "Now (ms)", "Ratio", "Outside the kernel (ms): before / now"]
HEADS += ["Largest relative difference: pull-off force", "Hysteresis"]
CHILD = """
import json, sys, time, bem
for line in sys.stdin:
    accuracy, rows = json.loads(line)
    answers = []
    for row in rows:
        scene = bem.Scene(row.pop("tabor"), bem.StandardLinearSolid(row.pop("modulus_ratio")))
        protocol = bem.LoadingProtocol(**row)
        wall, processor = time.perf_counter(), time.process_time()
        found = bem.simulate(scene, protocol, accuracy)
        processor, wall = time.process_time() - processor, time.perf_counter() - wall
        answers.append([processor, wall - found.stats.seconds, found.pull_off_force, found.hysteresis])
    print(json.dumps([bem.__file__, answers]), flush=True)
"""
"""Program that answers protocols on its standard input; it uses only what the `bem` of all revisions shares."""


@contextlib.contextmanager
def checkout(revision: str) -> Iterator[Path]:
    """A temporary checkout of a revision of this repository."""
    git = ["git", "-C", str(ROOT), "worktree"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "before"
        subprocess.run([*git, "add", "--quiet", "--detach", str(path), revision], check=True)
        try:
            yield path
        finally:
            subprocess.run([*git, "remove", "--force", str(path)], check=True)


class Solver:
    """The solver of a checkout, in a process of its own."""

    def __init__(self, source: Path) -> None:
        self._source = source
        environment = os.environ | {"PYTHONPATH": str(source), "PYTHONSAFEPATH": "1", "OMP_NUM_THREADS": "1"}
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._process: Any = subprocess.Popen([sys.executable, "-c", CHILD], env=environment, **pipes)

    def __call__(self, rows: list[dict[str, float]], accuracy: str) -> list[list[float]]:
        """Processor seconds of each call, wall seconds outside its kernel, pull-off force and hysteresis."""
        print(json.dumps([accuracy, rows]), file=self._process.stdin, flush=True)
        file, answers = json.loads(self._process.stdout.readline())
        if not Path(file).is_relative_to(self._source):
            raise RuntimeError(f"the solver must come from {str(self._source)!r}; received {file!r}")
        return answers

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def compared(sources: tuple[Path, Path], rows: list[dict[str, float]], accuracy: str, repeats: int) -> list[str]:
    """A row of the table, of the solvers of two checkouts, the one to compare with first."""
    solvers = [Solver(source) for source in sources]
    for solver in solvers:
        solver(rows[:1], accuracy)  # loads the kernels
    turns = progress(range(repeats), f"alternations at {accuracy}")
    runs = [[solver(rows, accuracy) for solver in solvers] for _ in turns]
    for solver in solvers:
        solver.close()
    best, answers = np.min(runs, axis=0), np.array(runs[0])
    (before, now), outside = best[..., 0].mean(axis=1), np.median(best[..., 1], axis=1)
    differences = np.abs(answers[1, :, 2:] / answers[0, :, 2:] - 1.0).max(axis=0)
    cells = [accuracy, f"{1e3 * before:.3g}", f"{1e3 * now:.3g}", f"{now / before:.3f}"]
    cells.append(" / ".join(f"{1e3 * seconds:.2g}" for seconds in outside))
    return cells + [f"{difference:.1e}" for difference in differences]


def study(
    *,
    count: Count = 160,
    seed: Seed = 1,
    revision: Annotated[str, typer.Option(help="Revision to compare with.")] = "b10bbed",
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each solver; the fastest counts.")] = 5,
) -> dict[str, Any]:
    """Compare, print the table and return it."""
    rows = rows_of(drawn("inside", count, seed))
    with checkout(revision) as before:
        table = [compared((before, ROOT), rows, name, repeats) for name in ("standard", "draft")]
    print(markdown_table(HEADS, table))
    return {"revision": revision, "table": [dict(zip(HEADS, cells, strict=True)) for cells in table]}


def limit_text(speed: Any) -> str:
    """What a trajectory costs beside the other revision."""
    ratios = " and ".join(f"{row['Ratio']} at `{row['Accuracy']}`" for row in speed["table"])
    outside = " and ".join(row[HEADS[4]].rpartition("/ ")[2] for row in speed["table"])
    return (
        f"{ratios} of the processor time of `{speed['revision']}`; the aims were 0.95 and 0.9. {outside} ms of it lie "
        "outside the kernel; the aim was 0.2 ms"
    )

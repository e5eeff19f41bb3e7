"""The solver of the working tree beside that of another checkout: the ratio of their cost, and the errors of both.

Each solver runs in processes of its own, which take turns, so that the ratio of their processor seconds is valid on a
machine of any speed and load. Samples are those of `cases.drawn`, inside the paper's box off the grid of the data set,
and beyond it. Inside, errors are against one solution, refined beyond `reference` by the other solver. What the
solver costs by itself is measured by `experiments.measurements.accuracy_cost`.
"""

import json
import tempfile
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from bem._support.command_line import parse_accuracy
from bem._support.wording import markdown_table
from bem.accuracy import resolve_accuracy
from experiments.measurements.cases import drawn, rows_of
from experiments.measurements.harness import Count, Seed, in_fresh_process, progress
from experiments.measurements.tools import EXACT_TARGET

ROOT = Path(__file__).resolve().parents[2]
ACCURACIES: tuple[str | float, ...] = ("draft", 1e-2, "standard", 2e-3, 1e-3, 3e-4, "reference")
BEYOND, LEVELS = ("beyond", "stiff", "elastic"), (0.5, 0.95, 1.0)
HEADS = ["Sample", "Accuracy", "Scenes", "Before / now (ms)", "Ratio of sums", "Largest ratio", "Not completed"]
HEADS += ["Pull-off error (%): median, 95th, largest; before / now", "Hysteresis error (%)"]
CHILD = """
import json, sys, time, bem
source, accuracy, rows = json.load(open(sys.argv[1]))
if not bem.__file__.startswith(source):
    sys.exit(f"the solver must come from {source!r}; received {bem.__file__!r}")
for row in [rows[0], *rows]:  # the first call loads the kernels
    started, answer = time.process_time(), ["nan", "nan"]
    try:
        ratio, adhesive = row["modulus_ratio"], row.get("adhesion", 1.0)
        material = bem.StandardLinearSolid(ratio) if ratio < 1.0 else bem.Elastic()
        scene = bem.Scene(row["tabor"], material, *([] if adhesive else [bem.HardContact()]))
        others = ("tabor", "modulus_ratio", "adhesion")
        protocol = bem.LoadingProtocol(**{name: value for name, value in row.items() if name not in others})
        started = time.process_time()
        found = bem.simulate(scene, protocol, accuracy)
        if found.completed:
            answer = [found.pull_off_force, found.hysteresis]
    except Exception as error:  # one case that fails does not end the comparison
        print(error, file=sys.stderr)
    print(time.process_time() - started, *answer)
"""
"""Program that simulates rows of `cases.drawn`; it uses only what the `bem` of all revisions shares."""


def solved(source: Path, rows: list[dict[str, float]], accuracy: str | float) -> np.ndarray:
    """Processor seconds, pull-off force and hysteresis by the `bem` of a folder, (n, 3); NaN where it did not complete.

    Raises:
        RuntimeError: The process ended, or imported another package.
    """
    with tempfile.NamedTemporaryFile("w", suffix=".json", encoding="utf-8") as file:
        json.dump([str(source), accuracy, rows], file)
        file.flush()
        found = in_fresh_process(CHILD, file.name, PYTHONPATH=str(source), PYTHONSAFEPATH="1", OMP_NUM_THREADS="1")
    return np.reshape(found, (-1, 3))[1:]


def compared(
    sources: list[Path], rows: list[dict[str, float]], accuracy: str | float, repeats: int, exact: np.ndarray | None
) -> list[str]:
    """Cells of two solvers, the other checkout's first: cost where both completed, and errors against `exact`, (n, 2).

    Each solver is first every other time, and the fastest run of a scene counts.
    """
    runs = []
    for turn in [slice(None, None, -1 if turn % 2 else 1) for turn in range(repeats)]:
        runs.append([solved(source, rows, accuracy) for source in sources[turn]][turn])
    seconds, answers = np.min(runs, axis=0)[..., 0], runs[0]
    done = np.array([np.isfinite(each[:, 1]) for each in answers])
    before, now = seconds[:, done.all(axis=0)]
    cells = [" / ".join(f"{1e3 * each.mean():.3g}" for each in seconds), f"{now.sum() / before.sum():.3f}"]
    cells += [f"{np.max(now / before, initial=0.0):.2f}", " / ".join(map(str, np.sum(~done, axis=1)))]
    if exact is None:
        return [*cells, "", ""]
    errors = [np.nanquantile(100.0 * np.abs(each[:, 1:] / exact - 1.0), LEVELS, axis=0).T for each in answers]
    return cells + [" / ".join(", ".join(f"{one:.2g}" for one in each[kind]) for each in errors) for kind in (0, 1)]


def study(
    *,
    count: Count = 300,
    seed: Seed = 1,
    baseline: Annotated[Path, typer.Option(help="Checkout of another revision, or this one.")] = ROOT,
    accuracy: Annotated[list[str] | None, typer.Option(help="Accuracy; repeatable.")] = None,
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each solver; the fastest counts.")] = 3,
    beyond: Annotated[int, typer.Option(min=0, help="Scenes of each sample beyond the box.")] = 100,
) -> None:
    """Compare and print the table."""
    accuracies = tuple(map(parse_accuracy, accuracy or ())) or ACCURACIES
    for one in accuracies:
        resolve_accuracy(one)  # before anything runs
    if not (baseline / "bem" / "__init__.py").is_file():
        raise ValueError(f"baseline must be a checkout with the package `bem`; received {str(baseline)!r}")
    sources = [baseline.resolve(), ROOT]
    inside = rows_of(drawn("inside", count, seed))
    exact = solved(sources[0], inside, EXACT_TARGET)[:, 1:]
    asked = [("inside", inside, one, exact) for one in accuracies]
    if beyond:
        asked += [(where, rows_of(drawn(where, beyond, seed)), "standard", None) for where in BEYOND]
    cells = [
        [where, str(one), str(len(rows)), *compared(sources, rows, one, repeats, known)]
        for where, rows, one, known in progress(asked, "comparisons")
    ]
    print(markdown_table(HEADS, cells))

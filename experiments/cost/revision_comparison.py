"""The solver of this working tree beside that of another git revision: cost and delivered errors in one run.

Both solve the same protocols, which fill the paper's box off the grid of the data set, in two processes that take
turns, so that the ratio of their processor seconds holds on a machine of any speed and load. Errors are against one
solution refined beyond `reference` by a revision that is not being worked on. Checked-out revisions and refined
solutions are kept in `results/solver/revisions`.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tarfile
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from bem import LoadingProtocol
from bem.accuracy import resolve_accuracy
from bem.dataset.designs import Design
from bem.dataset.measurement_steps import measurement_times
from experiments.timing import fingerprint, force_error, progress, spread

ROOT = Path(__file__).resolve().parents[2]
KEPT = Path("results/solver/revisions")
ACCURACIES: tuple[str | float, ...] = ("draft", 1e-2, "standard", 2e-3, 1e-3, 3e-4, "reference")
EXACT_TARGET = 7e-5
BUDGET = 60.0  # seconds of a solver at an accuracy, after which it is run no more
MODULUS_RATIO = 0.1
NOW = "now"
WORK = ("steps", "rejections", "iterations", "factorisations", "nodes")
ERRORS = {"pull_off_force": ("median", "p95"), "hysteresis": ("median", "p95", "largest"), "force": ("median", "p95")}
Request = dict[str, Any]


class Solver:
    """The solver of one source folder in a process of its own.

    Raises:
        RuntimeError: its process ended.
    """

    def __init__(self, source: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(source), "OMP_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(Path(__file__).with_name("revision_child.py"))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=source, env=environment,
        )  # fmt: skip
        package = Path(self._said())
        if not package.is_relative_to(source):
            self.close()
            raise RuntimeError(f"the solver must come from {str(source)!r}; received {str(package)!r}")

    def __call__(self, request: Request, accuracy: str | float) -> dict[str, Any]:
        """What it answers to a request, as `revision_child` words it."""
        self._process.stdin.write(json.dumps({**request, "accuracy": accuracy}) + "\n")
        self._process.stdin.flush()
        return json.loads(self._said())

    def close(self) -> None:
        """End its process."""
        self._process.communicate()

    def _said(self) -> str:
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"a solver's process ended with status {self._process.wait()}")
        return line.rstrip("\n")


def commit_of(revision: str) -> str:
    """The commit that a git revision names.

    Raises:
        ValueError: git knows no such revision.
    """
    command = ["git", "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(f"baseline must be a git revision; received {revision!r}")
    return done.stdout.strip()


def checked_out(revision: str, folder: Path) -> Path:
    """The package `bem` of a git revision, in `folder`.

    Raises:
        ValueError: git knows no such revision.
    """
    command = ["git", "archive", commit_of(revision), "bem"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        archive.extractall(folder, filter="data")
    return folder


def source_of(revision: str) -> Path:
    """The folder of a revision's package; kept, and its compiled kernels with it."""
    folder = (KEPT / commit_of(revision)[:12]).resolve()
    return folder if (folder / "bem" / "__init__.py").is_file() else checked_out(revision, folder)


def drawn(count: int, seed: int) -> list[Request]:
    """Random protocols of the paper's box, off the grid of the data set, with their measurement steps."""
    columns = Design("log-uniform").protocols(count, seed)
    requests = []
    for i in range(count):
        protocol = {name: float(values[i]) for name, values in columns.items()}
        tabor = protocol.pop("tabor")
        times = measurement_times(LoadingProtocol(**protocol), tabor).tolist()
        requests.append({"tabor": tabor, "modulus_ratio": MODULUS_RATIO, "protocol": protocol, "times": times})
    return requests


def results(answer: dict[str, Any], size: int) -> np.ndarray:
    """Pull-off force, hysteresis, and force at the measurement steps; NaN where not completed."""
    return np.array(answer.get("results") or np.full(size + 2, np.nan))


def refined(requests: list[Request], source: Path, known_as: str, jobs: int) -> np.ndarray:
    """Solutions that a solver refined, (count, 122); computed once and kept.

    Args:
        requests: The protocols.
        source: Folder of its package.
        known_as: What tells this solver from others.
        jobs: Its processes.
    """
    size = len(requests[0]["times"])
    key = fingerprint(solver=known_as, target=EXACT_TARGET, requests=requests)
    path = KEPT / f"refined-{key}.npy"
    if path.is_file():
        return np.load(path)
    own, solvers = threading.local(), []

    def start() -> None:
        own.solver = Solver(source)
        solvers.append(own.solver)

    with ThreadPoolExecutor(jobs, initializer=start) as pool:
        rows = pool.map(lambda request: results(own.solver(request, EXACT_TARGET), size), requests)
        table = np.array(list(progress(rows, "refined solutions", len(requests))))
    for solver in solvers:
        solver.close()
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, table)
    return table


def in_turn(
    solvers: dict[str, Solver], requests: list[Request], accuracy: str | float, repeats: int
) -> dict[str, tuple[np.ndarray, list[dict[str, Any]]]]:
    """Least seconds of each request (count,) and the answers of each solver, which begins every other time."""
    names = list(solvers)
    seconds = {name: np.full(len(requests), np.inf) for name in names}
    answers: dict[str, list[dict[str, Any]]] = {name: [] for name in names}
    for name in names:
        solvers[name](requests[0], accuracy)  # kernels are compiled or loaded by the first call
    spent = dict.fromkeys(names, 0.0)
    for repeat in range(repeats):
        if repeat and max(spent.values()) * (1.0 + 1.0 / repeat) > BUDGET:
            break
        for i, request in enumerate(progress(requests, f"accuracy {accuracy}, run {repeat + 1} of {repeats}")):
            for name in names if (i + repeat) % 2 else names[::-1]:
                answer = solvers[name](request, accuracy)
                spent[name] += answer["seconds"]
                seconds[name][i] = min(seconds[name][i], answer["seconds"])
                if repeat == 0:
                    answers[name].append(answer)
    return {name: (seconds[name], answers[name]) for name in names}


def judged(seconds: np.ndarray, answers: list[dict[str, Any]], exact: np.ndarray, target: float) -> dict[str, Any]:
    """One solver at one accuracy: cost, work, and errors of what completed in both it and the refined solutions.

    Args:
        seconds: Of each protocol, (count,).
        answers: What it answered.
        exact: Refined solutions, (count, 122).
        target: The error that was asked for.
    """
    table = np.array([results(answer, exact.shape[1] - 2) for answer in answers])
    errors = dict(zip(ERRORS, np.abs(table[:, :2] / exact[:, :2] - 1.0).T, strict=False))
    errors["force"] = force_error(table[:, 2:], exact[:, 2:])
    known = np.isfinite(errors["force"])
    work = {name: [answer["work"][name] for answer in answers if name in answer["work"]] for name in WORK}
    return {
        "seconds": spread(seconds),
        "seconds_each": seconds.tolist(),
        "work": {name: float(np.mean(values)) for name, values in work.items() if values},
        "failures": [[i, answer["status"]] for i, answer in enumerate(answers) if "results" not in answer],
        "compared": int(known.sum()),
        "errors": {name: spread(values[known]) for name, values in errors.items()},
        "worst": {name: int(np.argmax(np.where(known, values, -1.0))) for name, values in errors.items()},
        "met": {
            name: float(np.mean(values[known] <= target)) if known.any() else np.nan for name, values in errors.items()
        },
    }


def ratio(new: Sequence[float], old: Sequence[float], draws: int = 2000) -> tuple[float, float, float]:
    """Ratio of the mean seconds, and its 95 % interval by resampling the protocols."""
    new, old = np.asarray(new), np.asarray(old)
    chosen = np.random.default_rng(0).integers(len(new), size=(draws, len(new)))
    low, high = np.percentile(new[chosen].sum(axis=1) / old[chosen].sum(axis=1), [2.5, 97.5])
    return float(new.sum() / old.sum()), float(low), float(high)


def compare(
    baseline: str, exact_by: str, accuracies: Sequence[str | float], count: int, seed: int, repeats: int, jobs: int
) -> dict[str, Any]:
    """Run both solvers and judge them at every accuracy.

    Args:
        baseline: Git revision to compare with.
        exact_by: Git revision whose refined solutions count as exact.
        accuracies: Names or target errors.
        count: Protocols.
        seed: Seed of the draw.
        repeats: Runs of each while `BUDGET` lasts, of which the fastest counts for each protocol.
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

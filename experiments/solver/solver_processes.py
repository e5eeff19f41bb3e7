"""Solvers in separate processes, of the working tree or of another revision, compared with refined solutions.

Protocols are those of the paper's solid. Times are processor seconds of `simulate`. Refined solutions are kept in
`results/solver/refined`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from bem import LoadingProtocol
from bem.dataset.designs import Design
from bem.dataset.measurement_steps import measurement_times
from experiments.common import MODULUS_RATIO
from experiments.timing import fingerprint, force_error, progress, spread

ROOT = Path(__file__).resolve().parents[2]
KEPT = Path("results/solver/refined")
EXACT_TARGET = 7e-5
BUDGET = 60.0  # seconds in all runs of a solver at one accuracy, beyond which it is not run again
WORK = ("steps", "rejections", "iterations", "factorisations", "nodes")
QUANTITIES = ("pull_off_force", "hysteresis", "force")
Request = dict[str, Any]


class Solver:
    """The solver of one source folder, in a process of its own.

    Raises:
        RuntimeError: The process ended, or imported another package.
    """

    def __init__(self, source: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(source), "OMP_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(Path(__file__).with_name("solver_child.py"))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=source, env=environment,
        )  # fmt: skip
        package = Path(self._said())
        if not package.is_relative_to(source):
            self.close()
            raise RuntimeError(f"the solver must come from {str(source)!r}; received {str(package)!r}")

    def __call__(self, request: Request, accuracy: str | float) -> dict[str, Any]:
        """Answer to a request, as `solver_child` defines it."""
        self._process.stdin.write(json.dumps({**request, "accuracy": accuracy}) + "\n")
        self._process.stdin.flush()
        return json.loads(self._said())

    def close(self) -> None:
        """End the process."""
        self._process.communicate()

    def _said(self) -> str:
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"a solver's process ended with status {self._process.wait()}")
        return line.rstrip("\n")


def request(tabor: float, protocol: LoadingProtocol) -> Request:
    """Request to simulate a protocol in the paper's solid, with its measurement steps."""
    names = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
    return {
        "tabor": tabor,
        "modulus_ratio": MODULUS_RATIO,
        "protocol": {name: getattr(protocol, name) for name in names},
        "times": measurement_times(protocol, tabor).tolist(),
    }


def drawn(count: int, seed: int) -> list[Request]:
    """Random protocols of the paper's box, off the grid of the data set."""
    columns = Design("log-uniform").protocols(count, seed)
    rows = [dict(zip(columns, row, strict=True)) for row in np.column_stack(list(columns.values())).tolist()]
    return [request(row.pop("tabor"), LoadingProtocol(**row)) for row in rows]


def results(answer: dict[str, Any], size: int) -> np.ndarray:
    """Pull-off force, hysteresis and forces at the measurement steps, (size + 2,); NaN if it did not complete."""
    return np.array(answer.get("results") or np.full(size + 2, np.nan))


def refined(requests: list[Request], source: Path, known_as: str, jobs: int) -> np.ndarray:
    """Refined solutions of shape (count, 122); computed once and kept.

    They are converged, not exact: all discretisation errors lie several times below those of `reference`.

    Args:
        requests: The protocols.
        source: Folder of the solver's package.
        known_as: Identifies the solver: its version or its commit.
        jobs: Number of processes.
    """
    size = len(requests[0]["times"])
    key = fingerprint(solver=known_as, target=EXACT_TARGET, requests=requests)
    path = KEPT / f"{key}.npy"
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
    """Least seconds (count,) and answers of each solver. The solvers take turns, and each is first every other time."""
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
    """One solver at one accuracy: its cost and work, and its errors where it and the refined solution completed.

    Args:
        seconds: Seconds of each protocol, of shape (count,).
        answers: Answer to each request.
        exact: Refined solutions, of shape (count, 122).
        target: Target error of the accuracy.
    """
    table = np.array([results(answer, exact.shape[1] - 2) for answer in answers])
    errors = dict(zip(QUANTITIES, np.abs(table[:, :2] / exact[:, :2] - 1.0).T, strict=False))
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

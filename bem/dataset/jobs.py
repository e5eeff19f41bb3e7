"""What is common to all campaigns: cases in, records out.

A job lists scenes and protocols, each by its index, and says what is kept of each trajectory. It travels to the
workers without its cases, which each batch brings with it.
"""

import functools
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from bem._support.provenance import origin, peak_memory
from bem._support.validation import FloatArray
from bem.accuracy import NAMED_TARGETS, resolve_accuracy
from bem.dataset.executors import Batch, CampaignError, Executor, warm_solver
from bem.dataset.records import COMPLETED, FAILED, Columns, Layout, Record, blank, tabulate, untabulate
from bem.dataset.sealed_file import FORMAT
from bem.protocol import ForceProtocol, LoadingProtocol, Protocol
from bem.scene import Scene
from bem.solver.version import SOLVER_VERSION

LONGEST_BATCH = 1.0
"""Seconds a batch is expected to take at most; what a worker holds is lost when it dies."""
SAVING_BATCH = 0.01
"""Seconds as well for each worker, so that the one process which saves all batches, in a quarter of this, keeps up."""
SHARE_OF_REST = 5
"""A batch is at most this part of what each worker has yet to do, so that all end at about the same time ..."""
BATCHES_PER_WORKER = 96
"""... and need be no smaller than this part of all it does."""

Solver = Callable[..., Any]


class Job(ABC):
    """Trajectories to simulate, how, and what is kept of each.

    `indices`, shape (n,), names them; `accuracy` is that of `bem.simulate`; `layout` has the arrays that hold what is
    kept.
    """

    indices: np.ndarray
    accuracy: str | float
    layout: Layout
    form: ClassVar[str] = FORMAT
    """Name of the file's format."""
    stated: ClassVar[tuple[str, ...]] = ("accuracy",)
    """What of the identity the root attributes state again."""
    finite_in: ClassVar[str] = ""
    """Beginning of the paths of arrays in which every number must be finite."""

    @abstractmethod
    def identity(self, solver: Solver | None = None) -> dict[str, Any]:
        """Everything that determines the numbers."""

    @abstractmethod
    def cases_of(self, indices: np.ndarray) -> list[tuple[Scene, Protocol]]:
        """Scene and protocol of some of the trajectories."""

    @abstractmethod
    def inputs(self, indices: np.ndarray) -> Columns:
        """What the file says of the cases of some of the trajectories."""

    @abstractmethod
    def kept(self, trajectory: Any, case: tuple[Scene, Any]) -> tuple[Record, Record]:
        """What is kept of any trajectory, and of a completed one besides."""

    @abstractmethod
    def read(self, path: Path) -> tuple[Columns, dict[str, Any]]:
        """Arrays and root attributes of a complete file.

        Raises:
            DamagedFileError, ValueError: as `load_dataset`.
        """

    def shard_path(self, out: Path) -> Path:
        """Where the file goes: `out` itself, or beside it for one of several shards."""
        return out

    def batches(self, indices: np.ndarray, workers: int) -> list[Batch]:
        """Some of the trajectories in batches for these workers, with all that a worker needs to know of each."""
        cases = dict(zip(indices.tolist(), self.cases_of(indices), strict=True))
        chosen = batches_of(indices, expected_seconds(list(cases.values()), self.accuracy), workers)
        return [tuple((index, cases[index]) for index in batch) for batch in chosen]

    def simulated(self, index: int, case: tuple[Scene, Protocol], solver: Solver) -> Record:
        """Simulate one trajectory; an error of the solver, whatever it is, becomes a failed record."""
        # One failing case must not end the batch.
        try:
            trajectory = solver(*case, accuracy=self.accuracy)
            known, results = self.kept(trajectory, case)
        except Exception as error:
            return self.failed(index, f"{type(error).__name__}: {error}")
        sound = self._finite(known)
        if not (sound and self._finite(results)):
            return self.failed(index, "the solver returned numbers that are not finite", known if sound else {})
        if not trajectory.completed:
            return self.failed(index, trajectory.status, known)
        return {"index": index, "status": COMPLETED, "reason": ""} | known | results

    def failed(self, index: int, reason: str, known: Record | None = None) -> Record:
        """The record of a trajectory without a result, and with what is `known` of it all the same."""
        return blank(self.layout) | (known or {}) | {"index": index, "status": FAILED, "reason": reason}

    def columns(self, records: Iterable[Record]) -> Columns:
        """Arrays of some records, in the order of their index."""
        return tabulate(records, self.layout)

    def records(self, columns: Columns) -> list[Record]:
        """The records that such arrays hold."""
        return untabulate(columns, self.layout)

    def _finite(self, values: Record) -> bool:
        checked = (numbers for path, numbers in values.items() if path.startswith(self.finite_in))
        return all(np.all(np.isfinite(numbers)) for numbers in checked)


def solver_name(solver: Solver | None) -> str:
    """What the identity of a job says of the solver, or of its stand-in."""
    return SOLVER_VERSION if solver is None else f"{solver.__module__}.{solver.__qualname__}"


def expected_seconds(cases: list[tuple[Scene, Protocol]], accuracy: str | float) -> FloatArray:
    """Seconds that each case may take, shape (n,), a fit to measured ones.

    Deep contacts of large Tabor parameter cost most. The depth of a history is a third of its way down and up again
    in contact, and that of a prescribed force is that of Hertz.
    """

    def depth(scene: Scene, protocol: Any) -> float:
        if isinstance(protocol, LoadingProtocol):
            return protocol.peak_indentation
        if isinstance(protocol, ForceProtocol):
            path = scene.tabor * (0.75 * np.pi * np.maximum(-protocol.forces, 0.0)) ** (2.0 / 3.0)
        else:
            path = protocol.indentations
        return float(np.sum(np.maximum(path[1:], path[:-1]).clip(0.0))) / 3.0

    tabor, depths = np.array([(scene.tabor, depth(scene, protocol)) for scene, protocol in cases]).T
    tighter = NAMED_TARGETS["standard"] / resolve_accuracy(accuracy).target
    scale = 5.5e-4 * tighter ** (0.9 if tighter > 1.0 else 0.35)
    return scale * (0.5 + tabor**0.4 * np.sqrt(np.maximum(depths, 0.0)))


def batches_of(indices: np.ndarray, seconds: FloatArray, workers: int) -> list[tuple[int, ...]]:
    """Divide trajectories into batches, the costliest trajectories first, smaller and smaller ones towards the end."""
    order = indices[np.argsort(-seconds, kind="stable")]
    spent = np.cumsum(np.sort(seconds)[::-1])
    longest, least = max(LONGEST_BATCH, SAVING_BATCH * workers), spent[-1] / (BATCHES_PER_WORKER * workers)
    batches: list[tuple[int, ...]] = []
    begin, used = 0, 0.0
    while begin < len(order):
        share = min(max((spent[-1] - used) / (SHARE_OF_REST * workers), least), longest)
        end = max(begin + 1, int(np.searchsorted(spent, used + share, side="right")))
        batches.append(tuple(order[begin:end].tolist()))
        begin, used = end, spent[end - 1]
    return batches


class Arrival(NamedTuple):
    """The results of a batch.

    Args:
        records: one for each trajectory.
        seconds: what they took a worker.
        origin: versions and host of the worker, empty where it died.
        solver_version: of the worker's solver.
        memory: largest memory of the worker so far, in bytes.
    """

    records: list[Record]
    seconds: float = 0.0
    origin: dict[str, Any] = {}  # noqa: RUF012
    solver_version: str = SOLVER_VERSION
    memory: int = 0


def simulated_batch(job: Job, solver: Solver | None, batch: Batch) -> Arrival:
    """What a worker does with a batch."""
    solver = solver or warm_solver()
    started = time.perf_counter()
    records = [job.simulated(index, case, solver) for index, case in batch]
    return Arrival(records, time.perf_counter() - started, origin(), SOLVER_VERSION, peak_memory())


def results(job: Job, indices: np.ndarray, executor: Executor, solver: Solver | None) -> Iterator[Arrival]:
    """Some of a job's trajectories, as they arrive.

    Raises:
        CampaignError: the work cannot continue.
    """
    batches = job.batches(indices, executor.workers) if len(indices) else []
    for batch, arrival in executor.run(batches, functools.partial(simulated_batch, job, solver)):
        if arrival is None:
            reason = "the worker process died every time, perhaps for lack of memory"
            arrival = Arrival([job.failed(index, reason) for index, _ in batch])
        if arrival.solver_version != SOLVER_VERSION:
            raise CampaignError("the workers run another version of the solver than this machine")
        yield arrival

"""What is common to all campaigns: cases in, records out.

A job lists scenes and protocols, each by its index, and says what is kept of each trajectory. It travels to the
workers without its cases, which each batch brings with it.
"""

import functools
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from bem._support.provenance import origin, peak_memory
from bem.dataset.executors import Batch, CampaignError, Executor
from bem.dataset.records import COMPLETED, FAILED, Columns, Layout, Record, blank
from bem.dataset.sealed_file import FORMAT
from bem.materials import StandardLinearSolid
from bem.protocol import LoadingProtocol, Protocol
from bem.scene import Scene
from bem.solver.version import SOLVER_VERSION

LONGEST_BATCH = 1.0
"""Seconds after which a worker returns what it has done of a batch; what it holds is lost when it dies."""
SAVING_BATCH = 0.01
"""Seconds as well for each worker, so that the one process which saves all batches, in a quarter of this, keeps up."""
LARGEST_BATCH = 1000
SHARE_OF_REST = 5
"""A batch is at most this part of what each worker has yet to do, so that all end at about the same time ..."""
BATCHES_PER_WORKER = 96
"""... and need be no smaller than this part of all it does."""

Solver = Callable[..., Any]


class Job:
    """Trajectories to simulate, how, and what is kept of each, as its subclasses say."""

    indices: np.ndarray
    """Which trajectories, shape (n,)."""
    accuracy: str | float
    layout: Layout
    """The arrays that hold what is kept."""
    identity: Callable[..., dict[str, Any]]
    """Returns everything that determines the numbers, the solver included, or a stand-in for it."""
    cases_of: Callable[[Any], list[tuple[Scene, Any]]]
    """Returns scene and protocol of the trajectories of some indices."""
    inputs: Callable[[Any], Columns]
    """Returns what the file says of the cases of some indices."""
    kept: Callable[[Any, Any], tuple[Record, Record]]
    """Returns what is kept of any trajectory of a case, and of a completed one besides."""
    read: Callable[[Path], tuple[Columns, dict[str, Any]]]
    """Returns arrays and root attributes of a complete file; see `load_dataset` for its errors."""
    form: ClassVar[str] = FORMAT
    """Name of the file's format."""
    stated: ClassVar[tuple[str, ...]] = ("accuracy",)
    """What of the identity the root attributes state again."""
    finite_in: ClassVar[str] = ""
    """Beginning of the paths of arrays in which every number must be finite."""
    without_trajectory: ClassVar[Record] = {}
    """What is not blank in a record where the solver raised an error."""

    def shard_path(self, out: Path) -> Path:
        """Where the file goes: `out` itself, or beside it for one of several shards."""
        return out

    def batches(self, indices: np.ndarray, workers: int) -> deque[Batch]:
        """Some of the trajectories in batches for these workers, each with its case, in random order.

        The batches become smaller and smaller towards the end.
        """
        order = np.random.default_rng(0).permutation(indices)
        items = list(zip(order.tolist(), self.cases_of(order), strict=True))
        batches: deque[Batch] = deque()
        begin, least = 0, len(items) // (BATCHES_PER_WORKER * workers)
        while begin < len(items):
            size = min(max((len(items) - begin) // (SHARE_OF_REST * workers), least, 1), LARGEST_BATCH)
            batches.append(tuple(items[begin : begin + size]))
            begin += size
        return batches

    def simulated(self, index: int, case: tuple[Scene, Protocol], solver: Solver) -> Record:
        """Simulate one trajectory; an error of the solver, whatever it is, becomes a failed record."""
        # One failing case must not end the batch.
        try:
            trajectory = solver(*case, accuracy=self.accuracy)
            known, results = self.kept(trajectory, case)
        except Exception as error:
            return self.failed(index, f"{type(error).__name__}: {error}")
        if not self._finite(known | results):
            known = known if self._finite(known) else {}
            return self.failed(index, "the solver returned numbers that are not finite", known)
        if not trajectory.completed:
            return self.failed(index, trajectory.status, known)
        return {"index": index, "status": COMPLETED, "reason": ""} | known | results

    def failed(self, index: int, reason: str, known: Record | None = None) -> Record:
        """The record of a trajectory without a result, and with what is `known` of it all the same."""
        known = known or self.without_trajectory
        return blank(self.layout) | known | {"index": index, "status": FAILED, "reason": reason}

    def _finite(self, values: Record) -> bool:
        checked = (numbers for path, numbers in values.items() if path.startswith(self.finite_in))
        return all(np.all(np.isfinite(numbers)) for numbers in checked)


def solver_name(solver: Solver | None) -> str:
    """What the identity of a job says of the solver, or of its stand-in."""
    return SOLVER_VERSION if solver is None else f"{solver.__module__}.{solver.__qualname__}"


@functools.cache
def warm_solver() -> Solver:
    """The solver with its kernels loaded, so that no trajectory is charged for that."""
    from bem.solver.simulation import simulate

    protocol = LoadingProtocol(peak_indentation=2.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
    simulate(Scene(tabor=1.0, material=StandardLinearSolid(0.1)), protocol, "draft")
    return simulate


@dataclass(frozen=True)
class Arrival:
    """The results of a batch."""

    records: list[Record]
    """One for each trajectory that was simulated, the first ones of the batch."""
    seconds: float = 0.0
    """What they took a worker."""
    origin: dict[str, Any] = field(default_factory=dict)
    """Versions and host of the worker, empty where it died."""
    solver_version: str = SOLVER_VERSION
    memory: int = 0
    """Largest memory of the worker so far, in bytes."""


def simulated_batch(job: Job, solver: Solver | None, patience: float, batch: Batch) -> Arrival:
    """What a worker does with a batch: trajectory after trajectory, until its seconds are over."""
    solver = solver or warm_solver()
    started, records = time.perf_counter(), list[Record]()
    for index, case in batch:
        records.append(job.simulated(index, case, solver))
        if (seconds := time.perf_counter() - started) > patience:
            break
    return Arrival(records, seconds, origin(), SOLVER_VERSION, peak_memory())


def results(job: Job, indices: np.ndarray, executor: Executor, solver: Solver | None) -> Iterator[Arrival]:
    """Some of a job's trajectories, as they arrive.

    Raises:
        CampaignError: the work cannot continue.
    """
    batches = job.batches(indices, executor.workers)
    patience = max(LONGEST_BATCH, SAVING_BATCH * executor.workers)
    for batch, arrival in executor.run(batches, functools.partial(simulated_batch, job, solver, patience)):
        if arrival is None:
            reason = "the worker process died every time, perhaps for lack of memory"
            arrival = Arrival([job.failed(index, reason) for index, _ in batch])
        if arrival.solver_version != SOLVER_VERSION:
            raise CampaignError("the workers run another version of the solver than this machine")
        if rest := batch[len(arrival.records) :]:
            batches.appendleft(rest)
        yield arrival

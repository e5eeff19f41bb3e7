"""The work of a campaign: its trajectories divided into batches, and what a worker does with one of them."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bem._support.provenance import origin, peak_memory
from bem._support.validation import FloatArray
from bem.accuracy import NAMED_TARGETS, resolve_accuracy
from bem.dataset.campaign.executors import Batch, CampaignError, Executor
from bem.dataset.campaign.worker import Solver, warm_solver
from bem.solver.version import SOLVER_VERSION

LONGEST_BATCH = 1.0
"""Seconds a batch is expected to take at most; what a worker holds is lost when it dies."""
SAVING_BATCH = 0.01
"""Seconds as well for each worker, so that the one process which saves all batches, in a quarter of this, keeps up."""
SHARE_OF_REST = 5
"""A batch is at most this part of what each worker has yet to do, so that all end at about the same time ..."""
BATCHES_PER_WORKER = 96
"""... and need be no smaller than this part of all it does."""


def solver_name(solver: Solver | None) -> str:
    """What a campaign's identity says of the solver, or of its stand-in."""
    return SOLVER_VERSION if solver is None else f"{solver.__module__}.{solver.__qualname__}"


def expected_seconds(protocols: dict[str, FloatArray], accuracy: str | float = "standard") -> FloatArray:
    """Seconds each protocol may take, a fit to measured ones: deep contacts of large Tabor parameter cost most."""
    tighter = NAMED_TARGETS["standard"] / resolve_accuracy(accuracy).target
    scale = 5.5e-4 * tighter ** (0.9 if tighter > 1.0 else 0.35)
    return scale * (0.5 + protocols["tabor"] ** 0.4 * np.sqrt(np.maximum(protocols["peak_indentation"], 0.0)))


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


@dataclass(frozen=True)
class Arrival:
    """The results of a batch.

    Args:
        records: one for each trajectory.
        seconds: what they took a worker.
        origin: versions and host of the worker, empty where it died.
        solver_version: of the worker's solver.
        memory: largest memory of the worker so far, in bytes.
    """

    records: list[Any]
    seconds: float = 0.0
    origin: dict[str, Any] = field(default_factory=dict)
    solver_version: str = SOLVER_VERSION
    memory: int = 0


@dataclass(frozen=True)
class Task:
    """What a worker does with a batch; it travels with every batch, so it holds no more than all of them need."""

    simulator: Callable[[int, Any, Solver], Any]
    solver: Solver | None

    def __call__(self, batch: Batch) -> Arrival:
        """Simulate the batch."""
        solver = warm_solver() if self.solver is None else self.solver
        started = time.perf_counter()
        records = [self.simulator(index, item, solver) for index, item in batch]
        return Arrival(records, time.perf_counter() - started, origin(), SOLVER_VERSION, peak_memory())


def results(campaign: Any, indices: np.ndarray, executor: Executor, solver: Solver | None) -> Iterator[Arrival]:
    """Some of a campaign's trajectories, as they arrive.

    Raises:
        CampaignError: the work cannot continue.
    """
    if not len(indices):
        return
    items = dict(zip(indices.tolist(), campaign.items(indices), strict=True))
    batches = [
        tuple((index, items[index]) for index in batch)
        for batch in batches_of(indices, campaign.expected_seconds(indices), executor.workers)
    ]
    for batch, arrival in executor.run(batches, Task(campaign.simulator, solver)):
        if arrival is None:
            reason = "the worker process died every time, perhaps for lack of memory"
            arrival = Arrival([campaign.failed(index, reason) for index, _ in batch])
        if arrival.solver_version != SOLVER_VERSION:
            raise CampaignError("the workers run another version of the solver than this machine")
        yield arrival

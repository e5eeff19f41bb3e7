"""How a job is simulated: in batches, by processes of this machine (loky) or the workers of a Dask scheduler.

Both return futures. When a worker dies, its batch is started again. A batch whose worker dies every time is divided
into its items, which run alone; an item whose worker still dies is given up.
"""

import functools
import os
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Self

import numpy as np
from loky import cpu_count, get_reusable_executor

from bem._support.interruption import without_interrupts
from bem._support.provenance import origin, peak_memory
from bem._support.validation import whole_number
from bem._support.wording import shown
from bem.dataset.campaign import Batch, Job, Solver
from bem.dataset.records import Record
from bem.methods.version import SOLVER_VERSION
from bem.problem.materials import StandardLinearSolid
from bem.problem.protocol import LoadingProtocol
from bem.problem.scene import Scene

Task = Callable[[Batch], Any]

LONGEST_BATCH = 1.0
"""Seconds after which a worker returns what it has done of a batch; what it holds is lost when it dies."""
SAVING_BATCH = 0.01
"""Seconds as well for each worker, so that the one process which saves all batches, in a quarter of this, keeps up."""
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMBA", "NUMEXPR")}


class CampaignError(RuntimeError):
    """A campaign could not go on; what it has saved is kept, and the same command continues."""


class Executor:
    """Workers that take batches, as a context around their work; each kind says how to `submit` one."""

    workers: int
    in_flight: int
    """Batches submitted at a time."""
    patience = 1
    """How often a batch may lose its worker."""
    died: type[BaseException]
    """The error of a batch whose worker died."""
    submit: Callable[..., Future]
    """Starts a task with a batch."""

    def __enter__(self) -> Self:
        return self

    def run(self, batches: deque[Batch], task: Task) -> Iterator[tuple[Batch, Any]]:
        """Each batch with what the task returned, `None` where the worker died every time, in the order of arrival.

        Batches are taken from `batches` in their order; the caller may append others meanwhile.
        """
        running: dict[Future, Batch] = {}
        ended: SimpleQueue[Future] = SimpleQueue()
        deaths: Counter[int] = Counter()  # of batches, by the index of their first item
        suspects: list[Batch] = []
        alone = False
        while batches or running or suspects:
            if not batches and not running:
                alone = True
                batches.append(suspects.pop(0))
            while batches and len(running) < self.in_flight:
                batch = batches.popleft()
                future = self.submit(task, batch)
                running[future] = batch
                future.add_done_callback(ended.put)
            future = ended.get()
            batch = running.pop(future)
            try:
                result = future.result()
            except self.died:
                deaths[batch[0][0]] += 1
                if deaths[batch[0][0]] < self.patience:
                    batches.appendleft(batch)
                elif alone:
                    yield batch, None
                else:
                    del deaths[batch[0][0]]
                    suspects += [(item,) for item in batch]
            else:
                yield batch, result


class LocalExecutor(Executor):
    """Processes of this machine, one thread each.

    Args:
        workers: how many; as many as there are cores by default.

    Raises:
        ValueError: not a whole number from 1 to 4096.
    """

    patience = 3
    died = BrokenProcessPool

    def __init__(self, workers: int | None = None) -> None:
        self.workers = cpu_count() if workers is None else whole_number("workers", workers, low=1, high=4096)
        self.in_flight = 2 * self.workers if self.workers > 1 else 1
        self._processes: Any = None

    def submit(self, task: Task, batch: Batch) -> Future:
        """Start a batch, with new workers where the former ones died."""
        begin = {"initializer": _begin_worker, "initargs": (os.getpid(),), "env": ONE_THREAD}
        while True:
            with suppress(BrokenProcessPool), without_interrupts():
                self._processes = get_reusable_executor(self.workers, timeout=300, **begin)
                return self._processes.submit(task, batch)

    def __exit__(self, *error: object) -> None:
        """Leave the workers to the next campaign; end them at once after an error."""
        if error[0] is not None and self._processes is not None:
            self._processes.shutdown(wait=True, kill_workers=True)


def _begin_worker(parent: int) -> None:
    """End soon after a main process that was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class ClusterExecutor(Executor):
    """The workers of a Dask scheduler, each best started with one thread and able to `import bem`.

    Args:
        address: of the scheduler, e.g. 'tcp://127.0.0.1:8786'.
        patience: seconds to wait for the scheduler, and for its first worker.

    Raises:
        ValueError: Dask is not installed, or the address is malformed.
        CampaignError: no scheduler answers there, or it has no workers.
    """

    def __init__(self, address: str, patience: float = 10.0) -> None:
        try:
            import distributed
        except ImportError as error:
            raise ValueError("cluster needs Dask; install the extra `cluster` of this package") from error
        import asyncio
        import logging

        from distributed.comm import get_address_host_port, normalize_address

        self._place = shown(address)
        try:
            reachable = normalize_address(address.rstrip("/"))
            get_address_host_port(reachable)
        except ValueError as error:
            raise ValueError(f"cluster must be an address like 'tcp://host:8786'; received {self._place}") from error
        # Dask retries and reports by itself; its log would bury the one sentence that matters.
        for name in ("distributed", "distributed.client", "tornado.application"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        self.died = distributed.KilledWorker  # after three workers
        self._lost = (OSError, distributed.CancelledError, CancelledError)

        async def require_scheduler() -> None:
            """Refuse a server of another kind, for which `Client` itself would wait for ever."""
            how = {"timeout": patience, "connection_args": distributed.Security().get_connection_args("client")}
            async with asyncio.timeout(patience), distributed.rpc(reachable, **how) as connection:
                if "Scheduler" not in (await connection.identity())["type"]:
                    raise ConnectionError

        try:
            # In a thread of its own, because a notebook has a running loop in this one.
            with ThreadPoolExecutor(1) as thread:
                thread.submit(asyncio.run, require_scheduler()).result()
            self._client = distributed.Client(reachable, timeout=patience, set_as_default=False)
        except Exception as error:  # another kind of server may answer anything
            raise CampaignError(f"no Dask scheduler answers at {self._place}") from error
        try:
            self._client.wait_for_workers(1, timeout=patience)
            self.workers = sum(self._client.nthreads().values())
        except OSError as error:
            self._client.close()
            raise CampaignError(f"the Dask scheduler at {self._place} has no workers") from error
        self.in_flight = max(4 * self.workers, 256)  # more workers may join

    def __exit__(self, *error: object) -> None:
        """Cancel what is still running and close the connection."""
        with suppress(Exception):
            self._client.close()

    def submit(self, task: Task, batch: Batch) -> Future:
        """Start a batch."""
        return self._client.submit(task, batch, pure=False)

    def run(self, batches: deque[Batch], task: Task) -> Iterator[tuple[Batch, Any]]:
        """As `Executor.run`; raise `CampaignError` where the work cannot continue."""
        try:
            yield from super().run(batches, task)
        except self._lost as error:
            raise CampaignError(
                f"lost the Dask scheduler at {self._place}; what is saved is kept, and the same command continues"
            ) from error
        except ImportError as error:
            raise CampaignError(f"the workers of {self._place} cannot run the solver ({error})") from error


@functools.cache
def warm_solver() -> Solver:
    """The solver with its kernels loaded, so that no trajectory is charged for that."""
    from bem.simulation import simulate

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
        if remaining := batch[len(arrival.records) :]:
            batches.appendleft(remaining)
        yield arrival

"""Where batches of work run: processes of this machine (joblib), or the workers of a Dask cluster.

Both give results as they arrive, survive workers that die, and run one thread per worker. A batch is a tuple of items,
each with all a worker needs to know of it; a batch that cannot be finished because every worker dies on it is split,
and a single item that still kills is given up.
"""

import asyncio
import functools
import logging
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from types import TracebackType
from typing import Any, Protocol, Self
from urllib.parse import urlsplit

import joblib
from joblib.externals.loky.process_executor import TerminatedWorkerError, _ExecutorManagerThread

from bem._support.wording import shown
from bem.dataset.campaign.checkpoints import CampaignError
from bem.dataset.designs import whole_number

Item = tuple[int, tuple[float, ...]]
"""Index of a trajectory in its design, and its protocol in the order of `bem.dataset.designs.QUANTITIES`."""
Batch = tuple[Item, ...]
Task = Callable[[Batch], Any]
Outcome = tuple[Batch, Any]
"""A batch and what the task returned for it, `None` where the worker died every time."""

PATIENCE = 3
SCHEMES = ("tcp", "tls", "ucx", "ws", "wss")


class Pool(Protocol):
    """Something that runs batches."""

    workers: int

    def run(self, batches: Sequence[Batch], task: Task) -> Iterator[Outcome]:
        """Outcomes in the order they arrive; batches are started in the order given."""

    def __enter__(self) -> Self:
        """Claim the workers."""

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        """Let go of the workers."""


def _in_worker(key: int, task: Task, batch: Batch, parent: int) -> tuple[int, Any]:
    # Ctrl-C reaches the whole process group; ending the workers is the main process's business.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _end_with(parent)
    return key, task(batch)


@functools.cache
def _end_with(parent: int) -> None:
    """Let this process end within a second of a parent that was killed, instead of waiting minutes for work."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@functools.cache
def _excuse_the_manager() -> None:
    """Keep quiet about loky's own thread, which now and then trips over work that was called off under it."""
    report = threading.excepthook

    def hook(arguments: threading.ExceptHookArgs) -> None:
        if not isinstance(arguments.thread, _ExecutorManagerThread):
            report(arguments)

    threading.excepthook = hook


class LocalPool:
    """Processes of this machine.

    Args:
        workers: how many; as many as there are cores by default.

    Raises:
        ValueError: not a whole number from 1 to 4096.
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = joblib.cpu_count() if workers is None else whole_number("workers", workers, low=1, high=4096)
        # A single worker is still a process of its own: with one thread, and expendable.
        self._processes = max(self.workers, 2)
        self._in_flight = 2 * self.workers if self.workers > 1 else 1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        return None

    def run(self, batches: Sequence[Batch], task: Task) -> Iterator[Outcome]:
        """Outcomes in the order they arrive; see `Pool`."""
        waiting = dict(enumerate(batches))
        deaths = 0
        while waiting:
            stream = self._stream(waiting, task, self._in_flight)
            try:
                for key, result in stream:
                    yield waiting.pop(key), result
                    deaths = 0
            except TerminatedWorkerError:
                deaths += 1
            except BaseException:
                _excuse_the_manager()
                raise
            finally:
                # joblib warns of results nobody took; whoever stops early knows.
                with warnings.catch_warnings(action="ignore"):
                    stream.close()
            if deaths >= PATIENCE:
                # Whatever kills the workers was among those started first.
                for key in list(waiting)[: self._in_flight]:
                    yield from (((item,), self._alone(item, task)) for item in waiting.pop(key))
                deaths = 0

    def _stream(self, waiting: dict[int, Batch], task: Task, in_flight: int) -> Iterator[tuple[int, Any]]:
        with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
            parallel = joblib.Parallel(
                n_jobs=self._processes, pre_dispatch=in_flight, batch_size=1, return_as="generator_unordered"
            )
        return parallel(
            joblib.delayed(_in_worker)(key, task, batch, os.getpid()) for key, batch in list(waiting.items())
        )

    def _alone(self, item: Item, task: Task) -> Any:
        for _ in range(PATIENCE):
            with suppress(TerminatedWorkerError):
                return next(self._stream({0: (item,)}, task, 1))[1]
        return None


def scheduler_address(address: str) -> str:
    """The address of a scheduler with its scheme, 'tcp' unless another is given.

    Raises:
        ValueError: no scheme that Dask speaks between machines, no host or no port.
    """
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        sensible = parts.scheme in SCHEMES and parts.hostname and parts.port and not parts.path.strip("/")
    except ValueError:
        sensible = False
    if not sensible:
        raise ValueError(f"cluster must be an address like 'tcp://host:8786'; received {shown(address)}")
    return f"{parts.scheme}://{parts.netloc}"


class Cluster:
    """The workers of a Dask scheduler, each best started with one thread and able to `import bem`.

    Args:
        address: of the scheduler, e.g. 'tcp://127.0.0.1:8786'.
        patience: seconds to wait for the scheduler, and for its first worker.

    Raises:
        ValueError: Dask is not installed, or the address makes no sense.
        CampaignError: nobody answers there, or the scheduler has no workers.
    """

    def __init__(self, address: str, patience: float = 10.0) -> None:
        try:
            import distributed
        except ImportError as error:
            raise ValueError("cluster needs Dask; install the extra `cluster` of this package") from error
        # Dask retries and reports by itself; its log would bury the one sentence that matters.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        self._dask = distributed
        reachable = scheduler_address(address)
        nobody = f"no Dask scheduler answers at {shown(address)}"
        # Client itself waits for ever for a server of another kind, and prints tracebacks when it gives up.
        try:
            # In a thread of its own, because a notebook has a running loop in this one.
            with ThreadPoolExecutor(1) as thread:
                kind = thread.submit(asyncio.run, _kind_of_server(distributed, reachable, patience)).result()
        except Exception as error:  # another kind of server may answer anything
            raise CampaignError(nobody) from error
        if "Scheduler" not in kind:
            raise CampaignError(f"{nobody}, but a {kind}")
        try:
            self._client = distributed.Client(reachable, timeout=patience, set_as_default=False)
        except (OSError, TimeoutError) as error:
            raise CampaignError(nobody) from error
        try:
            self._client.wait_for_workers(1, timeout=patience)
            self.workers = sum(self._client.nthreads().values())
        except (OSError, TimeoutError) as error:
            self._client.close()
            raise CampaignError(f"the Dask scheduler at {shown(address)} has no workers") from error
        self.address = address

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(Exception):
            self._client.close()

    def run(self, batches: Sequence[Batch], task: Task) -> Iterator[Outcome]:
        """Outcomes in the order they arrive; see `Pool`."""
        batch_of = dict(zip(self._submit(batches, task), batches, strict=True))
        arriving = self._dask.as_completed(list(batch_of), loop=self._client.loop)
        lost = (
            f"lost the Dask scheduler at {shown(self.address)}; what is saved is kept, and the same command continues"
        )
        for future in arriving:
            batch = batch_of.pop(future)
            try:
                yield batch, future.result()
            except self._dask.scheduler.KilledWorker:
                if len(batch) == 1:
                    yield batch, None
                    continue
                singles = [(item,) for item in batch]
                more = dict(zip(self._submit(singles, task), singles, strict=True))
                batch_of |= more
                arriving.update(list(more))
            except (OSError, TimeoutError, self._dask.CancelledError) as error:
                raise CampaignError(lost) from error
            except ImportError as error:
                raise CampaignError(f"the workers of {shown(self.address)} cannot run the solver ({error})") from error
            future.release()
        if batch_of:
            raise CampaignError(lost)

    def _submit(self, batches: Sequence[Batch], task: Task) -> list[Any]:
        return self._client.map(task, list(batches), pure=False, batch_size=None)


async def _kind_of_server(distributed: Any, address: str, patience: float) -> str:
    """What a Dask server says it is, within `patience` seconds whatever it sends."""

    async def ask() -> str:
        arguments = distributed.Security().get_connection_args("client")
        async with distributed.rpc(address, timeout=patience, connection_args=arguments) as server:
            return str((await server.identity())["type"])

    async with asyncio.timeout(patience):
        return await ask()

"""Thousands of protocols, simulated on all cores or a cluster, into one data set file.

Workers, interruptions and the order of arrival leave no trace in the numbers, only in the seconds.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.outputs import require_suffix
from bem._support.provenance import merged, peak_memory, provenance
from bem._support.validation import FloatArray
from bem._support.wording import shown
from bem.dataset.campaign.checkpoints import CampaignError, PartStore, differences
from bem.dataset.campaign.executors import Cluster, LocalPool
from bem.dataset.campaign.plan import Campaign, Solver
from bem.dataset.campaign.work import Arrival, results
from bem.dataset.designs import QUANTITIES
from bem.dataset.file import SUFFIXES, load_dataset, write_dataset
from bem.dataset.opening import DamagedFileError
from bem.dataset.records import COMPLETED, FAILED, Columns, Record, tabulate, untabulate

Progress = Callable[[int, int], None]
"""Told how many trajectories are done and how many of them failed."""


@dataclass(frozen=True)
class Summary:
    """What came of a campaign.

    Args:
        path: the data set file.
        count: trajectories in it.
        computed: those of them computed by this call.
        failures: how often each reason occurred.
        wall_seconds: of all calls together.
        core_seconds: spent by workers on trajectories, all calls together.
        damaged: parts that had to be computed again.
    """

    path: Path
    count: int
    computed: int
    failures: Counter
    wall_seconds: float
    core_seconds: float
    damaged: int = 0


class _Done:
    """The trajectories a run need not compute any more, and what they cost."""

    def __init__(self, store: PartStore, retry_failed: bool) -> None:
        self.records: dict[int, Record] = {}
        self.failures = 0
        self._store = store
        self._retry_failed = retry_failed
        self._worker_memory = 0
        self._before = {"wall_seconds": 0.0, "core_seconds": 0.0}

    @property
    def seconds(self) -> dict[str, float]:
        """Wall and core seconds of all calls together."""
        return {name: self._before[name] + seconds for name, seconds in self._store.seconds.items()}

    def take_file(self, path: Path) -> None:
        """Keep what completed of a data set whose failed trajectories are computed again."""
        dataset = load_dataset(path, native=True)
        self._before = {name: float(dataset.attributes[name]) for name in self._before}
        self._store.origins += [{name: dataset.attributes[name]} for name in ("versions", "host")]
        self._keep(untabulate(dataset.columns))

    def take_parts(self, wanted: np.ndarray) -> None:
        """Keep what an interrupted call saved."""
        saved, wanted_indices = self._store.load(), frozenset(wanted.tolist())
        self._keep(record for index, record in saved.items() if index in wanted_indices)

    def memory(self, workers: int) -> int:
        """Bytes of this process and the workers together, each at its largest; no less than were held at once."""
        return peak_memory() + workers * self._worker_memory

    def add(self, arrival: Arrival) -> None:
        """Keep what has just arrived."""
        self._worker_memory = max(self._worker_memory, arrival.memory)
        self._store.add(arrival.records, arrival.seconds, arrival.origin)
        self.records |= {record.index: record for record in arrival.records}
        self.failures += sum(record.status == FAILED for record in arrival.records)

    def _keep(self, records: Iterable[Record]) -> None:
        kept = [record for record in records if record.status == COMPLETED or not self._retry_failed]
        self.records |= {record.index: record for record in kept}
        self.failures += sum(record.status == FAILED for record in kept)


def run_campaign(
    campaign: Campaign,
    out: str | Path,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    replace: bool = False,
    retry_failed: bool = False,
    solver: Solver | None = None,
    command: str = "",
    progress: Progress = lambda _done, _failed: None,
) -> Summary:
    """Compute a campaign, or what is left of it, and write its data set file.

    Args:
        campaign: what to compute.
        out: the data set file; work in progress is kept beside it.
        workers: processes of this machine; as many as cores by default.
        cluster: address of a Dask scheduler to use instead.
        replace: let the new data set take the place of another campaign's, once it is complete.
        retry_failed: compute trajectories that failed in an earlier call again.
        solver: a stand-in for `bem.simulate`, importable by the workers.
        command: what the user typed, for the record.
        progress: told of results as they arrive.

    Returns:
        what came of it; a complete file of the same campaign is left alone.

    Raises:
        ValueError: for a file of another campaign at `out`, one that is no data set, or a name that does not end as
            those of HDF5 files do.
        CampaignError: when the work cannot go on; saved work is kept.
    """
    require_suffix(out, SUFFIXES)
    path = campaign.path(out)
    identity = campaign.identity(solver)
    if workers is not None and cluster is not None:
        raise ValueError(f"workers must not be given with cluster, which has its own; received {shown(workers)}")
    local = LocalPool(workers) if cluster is None else None
    complete = existing(path, identity, replace=replace)
    store = PartStore(path, identity, campaign.settings, replace=replace)
    if complete:
        # A process killed right after the file was in place could not remove its parts.
        store.discard()
        if not (retry_failed and complete.failures):
            return complete
        store = PartStore(path, identity | {"retry_failed": True}, campaign.settings, replace=replace)
    protocols = campaign.protocols
    with local or Cluster(cluster) as pool, store:
        done = _Done(store, retry_failed)
        if complete := existing(path, identity, replace=replace):
            if not (retry_failed and complete.failures):
                store.remove()
                return complete
            done.take_file(path)
        done.take_parts(campaign.indices)
        resumed = len(done.records)
        progress(resumed, done.failures)
        missing = np.array([index for index in campaign.indices.tolist() if index not in done.records], dtype=np.int64)
        for arrival in results(campaign, missing, pool, solver):
            done.add(arrival)
            progress(len(done.records), done.failures)
        store.flush()
        attributes = root_attributes(identity) | done.seconds | {"workers": pool.workers}
        attributes["peak_memory"] = done.memory(pool.workers)
        attributes |= provenance(command) | merged(store.origins)
        columns = tabulate(done.records.values(), campaign.settings)
        write_result(path, columns, protocols, attributes, campaign.counts, scratch=store.folder)
        store.remove(others=replace)
    return summary_of(path, len(missing), damaged=store.damaged)


def existing(path: Path, identity: dict[str, Any], *, replace: bool) -> Summary | None:
    """The summary of a complete file of the same campaign; `None` for none, or one that may be replaced."""
    if path.is_dir():
        raise ValueError(f"out must be a file; received the folder {str(path)!r}")
    if not path.exists():
        return None
    try:
        attributes = load_dataset(path).attributes
    except DamagedFileError as error:
        if replace:
            return None
        raise ValueError(f"{error}, and may be replaced with --replace") from error
    difference = differences(identity, attributes["campaign"])
    if not difference:
        return summary_of(path, 0)
    if not replace:
        raise ValueError(
            f"out must name a new file or the same campaign; received {str(path)!r}, which holds another one "
            f"({difference}) and may be replaced with --replace"
        )
    return None


def root_attributes(identity: dict[str, Any]) -> dict[str, Any]:
    """Root attributes that follow from what was computed."""
    plain = {name: identity[name] for name in ("design", "ranges", "modulus_ratio", "seed", "accuracy", "count")}
    return {**plain, "shard": identity["shard"], "campaign": identity}


def write_result(
    path: Path,
    columns: Columns,
    protocols: dict[str, FloatArray],
    attributes: dict[str, Any],
    counts: tuple[int, int, int],
    *,
    scratch: Path | None = None,
) -> None:
    """Write a data set file of some of the protocols; `scratch` is where its temporary goes.

    Raises:
        CampaignError: it could not be written.
    """
    columns = {f"protocols/{name}": protocols[name][columns["index"]] for name in QUANTITIES} | columns
    try:
        write_dataset(path, columns, attributes, counts, scratch)
    except OSError as error:
        kept = "; what was computed is kept, and the same command continues" if scratch else ""
        raise CampaignError(f"cannot write {str(path)!r} ({error.strerror or error}){kept}") from error


def summary_of(path: Path, computed: int, damaged: int = 0) -> Summary:
    """Summary of a data set file of which this call computed some trajectories."""
    dataset = load_dataset(path)
    reasons = dataset.columns["reason"][dataset.columns["status"] != COMPLETED]
    seconds = (float(dataset.attributes[name]) for name in ("wall_seconds", "core_seconds"))
    return Summary(path, len(dataset), computed, Counter(reasons.tolist()), *seconds, damaged)

"""Thousands of protocols, simulated on all cores or a cluster, into one data set file.

Workers, interruptions and the order of arrival leave no trace in the numbers, only in the seconds.
"""

import functools
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bem._checks import FloatArray
from bem.campaign_plan import Campaign, Solver, solver_digest
from bem.dataset_file import load_dataset, write_dataset
from bem.designs import QUANTITIES, whole_number
from bem.materials import StandardLinearSolid
from bem.parts import CampaignError, PartStore, differences
from bem.pools import Batch, Cluster, LocalPool, Pool
from bem.protocol import LoadingProtocol
from bem.provenance import provenance
from bem.records import COMPLETED, FAILED, Columns, Record, Settings, failed, simulate_record, tabulate
from bem.scene import Scene

LARGEST_BATCH = 32
BATCHES_PER_WORKER = 48
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


def expected_cost(protocols: dict[str, FloatArray]) -> FloatArray:
    """Relative cost of each protocol, a fit to measured seconds: deep contacts of large Tabor parameter cost most."""
    return 2.5 + protocols["tabor"] ** 0.4 * protocols["peak_indentation"]


def batches_of(indices: np.ndarray, cost: FloatArray, workers: int) -> list[Batch]:
    """Divide trajectories into batches of about equal cost, the costliest trajectories first."""
    order = indices[np.argsort(-cost, kind="stable")]
    spent = np.cumsum(np.sort(cost)[::-1])
    share = max(spent[-1] / (BATCHES_PER_WORKER * workers), 1e-300)
    batches: list[Batch] = []
    begin, used = 0, 0.0
    for end in range(1, len(order) + 1):
        if end == len(order) or spent[end] - used > share or end - begin == LARGEST_BATCH:
            batches.append(tuple(order[begin:end].tolist()))
            begin, used = end, spent[end - 1]
    return batches


@functools.cache
def _warm_solver() -> Solver:
    """The solver with its kernels loaded, so that no trajectory is charged for that."""
    from bem.simulate import simulate

    protocol = LoadingProtocol(peak_indentation=2.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
    simulate(Scene(tabor=1.0, material=StandardLinearSolid(0.1)), protocol, "draft")
    return simulate


@dataclass(frozen=True)
class Task:
    """What a worker does with a batch; it travels to workers, so it holds no more than they need."""

    protocols: dict[str, FloatArray]
    settings: Settings
    solver: Solver | None

    def __call__(self, batch: Batch) -> tuple[list[Record], float, str]:
        """Records of the batch, the seconds they took, and the digest of the solver used."""
        solver = _warm_solver() if self.solver is None else self.solver
        started = time.perf_counter()
        rows = ({name: values[index] for name, values in self.protocols.items()} for index in batch)
        records = [simulate_record(index, row, self.settings, solver) for index, row in zip(batch, rows, strict=True)]
        return records, time.perf_counter() - started, solver_digest()


def results(
    campaign: Campaign, indices: np.ndarray, pool: Pool, solver: Solver | None
) -> Iterator[tuple[list[Record], float]]:
    """Records of some of a campaign's protocols, as they arrive, with the seconds they took a worker."""
    if not len(indices):
        return
    cost = expected_cost({name: values[indices] for name, values in campaign.protocols.items()})
    task = Task(campaign.protocols, campaign.settings, solver)
    for batch, outcome in pool.run(batches_of(indices, cost, pool.workers), task):
        if outcome is None:
            reason = "the worker process died every time, perhaps for lack of memory"
            yield [failed(index, reason, campaign.settings) for index in batch], 0.0
            continue
        records, seconds, digest = outcome
        if digest != solver_digest():
            raise CampaignError("the workers run another version of the solver than this machine")
        yield records, seconds


def run_campaign(
    campaign: Campaign,
    out: str | Path,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    replace: bool = False,
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
        solver: a stand-in for `bem.simulate`, importable by the workers.
        command: what the user typed, for the record.
        progress: told of results as they arrive.

    Returns:
        what came of it; a complete file of the same campaign is left alone.

    Raises:
        ValueError: for a file of another campaign at `out`, or one that is no data set.
        CampaignError: when the work cannot go on; saved work is kept.
    """
    path = campaign.path(out)
    identity = campaign.identity(solver)
    if path.exists() and (complete := existing(path, identity, replace=replace)):
        return complete
    protocols = campaign.protocols
    if workers is not None:
        whole_number("workers", workers, low=1, high=4096)
    with (
        Cluster(cluster) if cluster else LocalPool(workers) as pool,
        PartStore(path, identity, campaign.settings, replace=replace) as store,
    ):
        if path.exists() and (complete := existing(path, identity, replace=replace)):
            return complete
        records = {index: record for index, record in store.load().items() if index in set(campaign.indices.tolist())}
        resumed = len(records)
        failures = sum(record.status == FAILED for record in records.values())
        progress(resumed, failures)
        missing = np.array([index for index in campaign.indices.tolist() if index not in records], dtype=np.int64)
        for arrived, seconds in results(campaign, missing, pool, solver):
            store.add(arrived, seconds)
            records |= {record.index: record for record in arrived}
            failures += sum(record.status == FAILED for record in arrived)
            progress(len(records), failures)
        store.flush()
        attributes = root_attributes(identity) | store.seconds | {"workers": pool.workers} | provenance(command)
        write_result(path, tabulate(records.values(), campaign.settings), protocols, attributes, campaign.counts)
        store.remove()
    return summary_of(path, len(records) - resumed, damaged=store.damaged)


def existing(path: Path, identity: dict[str, Any], *, replace: bool) -> Summary | None:
    """The summary of a complete file of the same campaign; `None` for another one that may be replaced."""
    if path.is_dir():
        raise ValueError(f"out must be a file; received the folder {str(path)!r}")
    attributes = load_dataset(path).attributes
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
) -> None:
    """Write a data set file of some of the protocols.

    Raises:
        CampaignError: it could not be written.
    """
    columns = {f"protocols/{name}": protocols[name][columns["index"]] for name in QUANTITIES} | columns
    try:
        write_dataset(path, columns, attributes, counts)
    except OSError as error:
        raise CampaignError(
            f"cannot write {str(path)!r} ({error.strerror or error}); what was computed is kept, and the same command "
            "continues"
        ) from error


def summary_of(path: Path, computed: int, damaged: int = 0) -> Summary:
    """Summary of a data set file of which this call computed some trajectories."""
    dataset = load_dataset(path)
    reasons = dataset.columns["reason"][dataset.columns["status"] != COMPLETED]
    seconds = (float(dataset.attributes[name]) for name in ("wall_seconds", "core_seconds"))
    return Summary(path, len(dataset), computed, Counter(reasons.tolist()), *seconds, damaged)

"""Thousands of trajectories, simulated on all cores or a cluster, into one file.

Workers, interruptions and the order of arrival do not change the numbers, only the seconds.
"""

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.outputs import require_output, require_suffix
from bem._support.provenance import merged, peak_memory, provenance
from bem._support.wording import shown
from bem.dataset.campaign import Campaign, Job, Solver
from bem.dataset.executors import CampaignError, ClusterExecutor, LocalExecutor, results
from bem.dataset.file import SUFFIXES, load_dataset, write_file
from bem.dataset.journal import Journal, differences
from bem.dataset.records import COMPLETED, Columns, Record, tabulate, untabulate
from bem.dataset.sealed_file import DamagedFileError

Progress = Callable[[int, int], None]
"""Called with the number of trajectories that are done and of those that failed."""
SECONDS = ("wall_seconds", "core_seconds")


@dataclass(frozen=True)
class Summary:
    """The outcome of a campaign.

    Args:
        path: the file.
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


def run_campaign(
    campaign: Job,
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
    """Compute a campaign, or what is left of it, and write its file.

    Args:
        campaign: what to compute, protocols of a design or cases of any kind.
        out: the file, whose name ends in .h5 or .hdf5; work in progress is kept beside it.
        workers: processes of this machine; as many as cores by default.
        cluster: address of a Dask scheduler to use instead.
        replace: replace the file of another campaign, once the new one is complete.
        retry_failed: compute trajectories that failed in an earlier call again.
        solver: a stand-in for `bem.simulate`, importable by the workers.
        command: what the user typed, for the record.
        progress: called as results arrive.

    Returns:
        the outcome; a complete file of the same campaign is left unchanged.

    Raises:
        ValueError: for an `out` that holds another campaign or no data set, or does not end in .h5 or .hdf5.
        CampaignError: when the work cannot continue; saved work is kept.
    """
    require_suffix(out, SUFFIXES)
    path = followed(campaign.shard_path(Path(out)))
    identity = campaign.identity(solver)
    if workers is not None and cluster is not None:
        raise ValueError(f"workers must not be given with cluster, which has its own; received {shown(workers)}")
    local = LocalExecutor(workers) if cluster is None else None
    complete = existing(campaign, path, identity, replace=replace)
    journal = Journal(path, identity, replace=replace)
    if complete:
        if journal.path.exists():  # a process killed right after the file was in place could not remove it
            with suppress(CampaignError, ValueError), journal:
                journal.remove()
        summary = summary_of(path, *complete)
        if not (retry_failed and summary.failures):
            progress(summary.count, summary.failures.total())
            return summary
        journal = Journal(path, identity | {"retry_failed": True}, replace=replace)
    if path.absolute().parent.is_dir():  # others are made; a complete file is only read
        require_output(path)
    with local or ClusterExecutor(cluster) as executor, journal:
        if complete := existing(campaign, path, identity, replace=replace):  # another process may have completed it
            journal.batches.insert(0, complete[0])
            journal.costs.insert(0, {name: complete[1][name] for name in (*SECONDS, "versions", "host")})
        earlier = [record for columns in journal.batches for record in untabulate(columns, campaign.layout)]
        # Later records take the place of earlier ones.
        done = {record["index"]: record for record in earlier if record["status"] == COMPLETED or not retry_failed}
        missing = np.setdiff1d(campaign.indices, np.array(list(done), dtype=np.int64))
        failed, memory = sum(record["status"] != COMPLETED for record in done.values()), 0
        progress(len(done), failed)
        for arrival in results(campaign, missing, executor, solver):
            journal.add(tabulate(arrival.records, campaign.layout), arrival.seconds, arrival.origin)
            done |= {record["index"]: record for record in arrival.records}
            failed += sum(record["status"] != COMPLETED for record in arrival.records)
            memory = max(memory, arrival.memory)
            progress(len(done), failed)
        # The sum of each process's largest memory is an upper bound of what all held at once.
        cost = {"workers": executor.workers, "peak_memory": peak_memory() + executor.workers * memory}
        cost |= _joined(journal.costs, sum)
        contents = tabulate(done.values(), campaign.layout), {"campaign": identity} | provenance(command) | cost
        save_campaign(campaign, path, *contents, scratch=journal.path.with_suffix(".writing"))
        journal.remove()
    return summary_of(path, *contents, len(missing), journal.damaged)


def merge(shards: Sequence[str | Path], out: str | Path, *, command: str = "", replace: bool = False) -> Summary:
    """Join the data set files of all shards of a campaign into one.

    Raises:
        FileNotFoundError, ValueError: for files that are not data sets, belong to different campaigns, overlap or are
            incomplete, or for an `out` that does not end in .h5 or .hdf5.
        CampaignError: when the result cannot be written.
    """
    if not shards:
        raise ValueError("shards must name at least one data set file; received none")
    require_suffix(out, SUFFIXES)
    out = followed(Path(out))
    if out.absolute().parent.is_dir():
        require_output(out)
    records: dict[int, Record] = {}
    origins: list[dict[str, Any]] = []
    for path in shards:
        dataset = load_dataset(path, native=True)
        theirs = {**dataset.attributes["campaign"], "shard": "1/1"}
        if not origins:
            identity, campaign = theirs, Campaign.of(theirs)
        if difference := differences(identity, theirs):
            raise ValueError(f"shards must belong to one campaign; received {str(path)!r}: {difference}")
        if not records.keys().isdisjoint(dataset.columns["index"].tolist()):
            shard = dataset.attributes["shard"]
            raise ValueError(f"shards must not overlap; received {str(path)!r}, shard {shard}, a second time")
        origins.append(dataset.attributes)
        records |= {record["index"]: record for record in untabulate(dataset.columns, campaign.layout)}
    absent = sorted(set(range(identity["count"])) - records.keys())
    if absent:
        raise ValueError(
            f"shards must hold all {identity['count']} trajectories; received files without {len(absent)} of them, "
            f"the first being trajectory {absent[0]}"
        )
    # A merged file of this campaign is made anew: its shards may have been completed since.
    existing(campaign, out, identity, replace=replace)
    cost = {"workers": sum(origin["workers"] for origin in origins)} | _joined(origins, max)
    cost["peak_memory"] = max(origin.get("peak_memory", 0) for origin in origins)
    contents = tabulate(records.values(), campaign.layout), {"campaign": identity} | provenance(command) | cost
    save_campaign(campaign, out, *contents)
    return summary_of(out, *contents)


def _joined(entries: Sequence[Mapping[str, Any]], wall: Callable[[list[float]], float]) -> dict[str, Any]:
    """Cost and origin of parts; `wall` is `sum` where one was computed after the other, `max` where side by side."""
    seconds = {name: of([entry[name] for entry in entries]) for name, of in zip(SECONDS, (wall, sum), strict=True)}
    names = ("versions", "host", "git_revision")
    return seconds | merged({name: entry[name] for name in names if name in entry} for entry in entries)


def followed(path: Path) -> Path:
    """The path itself, or the target of a link, so that writing replaces the target and not the link."""
    return Path(os.path.realpath(path)) if path.is_symlink() else path


def existing(
    campaign: Job, path: Path, identity: dict[str, Any], *, replace: bool
) -> tuple[Columns, dict[str, Any]] | None:
    """Arrays and attributes of a complete file of the same campaign; `None` for none, or one that may be replaced."""
    if not path.exists():
        return None
    try:
        columns, attributes = campaign.read(path)
    except DamagedFileError as error:
        if replace:
            return None
        raise ValueError(f"{error}, and may be replaced with --replace") from error
    difference = differences(identity, attributes["campaign"])
    if difference and not replace:
        raise ValueError(
            f"out must name a new file or the same campaign; received {str(path)!r}, which holds another one "
            f"({difference}) and may be replaced with --replace"
        )
    return None if difference else (columns, attributes)


def save_campaign(
    campaign: Job, path: Path, columns: Columns, attributes: dict[str, Any], scratch: Path | None = None
) -> None:
    """Write the file of a campaign, whose identity is among the attributes; `scratch` is where it is written first.

    Raises:
        CampaignError: it could not be written.
    """
    try:
        stored = campaign.inputs(columns["index"]) | columns
        stated = {name: attributes["campaign"][name] for name in campaign.stated}
        write_file(path, stored, stated | attributes, scratch, form=campaign.form)
    except OSError as error:
        kept = "; what was computed is kept, and the same command continues" if scratch else ""
        raise CampaignError(f"cannot write {str(path)!r} ({error.strerror or error}){kept}") from error


def summary_of(
    path: Path, columns: Columns, attributes: dict[str, Any], computed: int = 0, damaged: int = 0
) -> Summary:
    """Summary of a file with these arrays and attributes, of which this call computed some trajectories."""
    failures = Counter(map(str, columns["reason"][columns["status"] != COMPLETED]))
    seconds = (float(attributes[name]) for name in SECONDS)
    return Summary(path, len(columns["index"]), computed, failures, *seconds, damaged)

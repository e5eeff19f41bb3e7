"""Thousands of trajectories, simulated on all cores or a cluster, into one file.

Workers, interruptions and the order of arrival do not change the numbers, only the seconds.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.outputs import require_suffix
from bem._support.provenance import merged, peak_memory, provenance
from bem._support.wording import shown
from bem.dataset.campaign.cases import Cases
from bem.dataset.campaign.checkpoints import CampaignCheckpoint, CampaignError, differences
from bem.dataset.campaign.executors import ClusterExecutor, LocalExecutor
from bem.dataset.campaign.plan import Campaign
from bem.dataset.campaign.work import Solver, results
from bem.dataset.file import SUFFIXES
from bem.dataset.opening import DamagedFileError
from bem.dataset.records import COMPLETED, FAILED, Columns

Progress = Callable[[int, int], None]
"""Called with the number of trajectories that are done and of those that failed."""


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
    campaign: Campaign | Cases,
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
    checkpoint = CampaignCheckpoint(path, identity, replace=replace)
    if complete:
        # A process killed right after the file was in place could not remove its parts.
        checkpoint.discard()
        if not (retry_failed and _failures(complete[0])):
            return summary_of(path, *complete)
        checkpoint = CampaignCheckpoint(path, identity | {"retry_failed": True}, replace=replace)
    with local or ClusterExecutor(cluster) as executor, checkpoint:
        parts: list[Columns] = []
        if complete := existing(campaign, path, identity, replace=replace):
            if not (retry_failed and _failures(complete[0])):
                checkpoint.remove()
                return summary_of(path, *complete)
            parts = [complete[0]]
            checkpoint.take(complete[1])
        wanted = frozenset(campaign.indices.tolist())
        done: dict[int, Any] = {}
        for columns in (*parts, *checkpoint.load()):
            for record in campaign.records(columns):
                kept = record.status == COMPLETED or not (retry_failed or record.index in done)
                if kept and record.index in wanted:
                    done[record.index] = record
        failed = sum(record.status == FAILED for record in done.values())
        progress(len(done), failed)
        missing = np.array([index for index in campaign.indices.tolist() if index not in done], dtype=np.int64)
        memory = 0
        for arrival in results(campaign, missing, executor, solver):
            checkpoint.add(campaign.columns(arrival.records), arrival.seconds, arrival.origin)
            done |= {record.index: record for record in arrival.records}
            failed += sum(record.status == FAILED for record in arrival.records)
            memory = max(memory, arrival.memory)
            progress(len(done), failed)
        columns = campaign.columns(done.values())
        attributes = {"campaign": identity, **checkpoint.seconds, "workers": executor.workers}
        # The sum of each process's largest memory is an upper bound of what all held at once.
        attributes["peak_memory"] = peak_memory() + executor.workers * memory
        attributes |= provenance(command) | merged(checkpoint.origins)
        write_file(campaign, path, columns, attributes, checkpoint.folder)
        checkpoint.remove(others=replace)
    return summary_of(path, columns, attributes, len(missing), checkpoint.damaged)


def followed(path: Path) -> Path:
    """The path itself, or the target of a link, so that writing replaces the target and not the link.

    Raises:
        ValueError: a link that leads in circles.
    """
    try:
        return path.resolve() if path.is_symlink() else path
    except (OSError, RuntimeError) as error:
        raise ValueError(f"out must not be a link in circles; received {str(path)!r}") from error


def existing(
    campaign: Campaign | Cases, path: Path, identity: dict[str, Any], *, replace: bool
) -> tuple[Columns, dict[str, Any]] | None:
    """Arrays and attributes of a complete file of the same campaign; `None` for none, or one that may be replaced."""
    if path.is_dir():
        raise ValueError(f"out must be a file; received the folder {str(path)!r}")
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


def write_file(
    campaign: Campaign | Cases, path: Path, columns: Columns, attributes: dict[str, Any], scratch: Path | None = None
) -> None:
    """Write the file of a campaign; `scratch` is the folder of its temporary file.

    Raises:
        CampaignError: it could not be written.
    """
    try:
        campaign.write(path, columns, attributes, scratch)
    except OSError as error:
        kept = "; what was computed is kept, and the same command continues" if scratch else ""
        raise CampaignError(f"cannot write {str(path)!r} ({error.strerror or error}){kept}") from error


def summary_of(
    path: Path, columns: Columns, attributes: dict[str, Any], computed: int = 0, damaged: int = 0
) -> Summary:
    """Summary of a file with these arrays and attributes, of which this call computed some trajectories."""
    seconds = (float(attributes[name]) for name in ("wall_seconds", "core_seconds"))
    return Summary(path, len(columns["index"]), computed, _failures(columns), *seconds, damaged)


def _failures(columns: Columns) -> Counter:
    return Counter(map(str, columns["reason"][columns["status"] != COMPLETED]))

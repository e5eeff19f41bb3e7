"""What a campaign costs besides its trajectories, and an estimate for many cores.

- Runs: wall seconds of `bem campaign` with one and with two processes. Only these need an idle machine.
- Start: processor seconds until the command has loaded its modules, and until a worker has loaded the solver.
- One process draws all protocols, saves all batches, and writes or merges the file: its processor seconds and its
  memory for each trajectory.
- Tail: the workers wait for the last one. The batches of a campaign are replayed with the seconds of the published
  trajectories; the tail is the excess of the total time over an equal share for each worker.
- Dask: a scheduler on this machine and `DASK_WORKERS` workers of one thread, which sleep `STUB_SECONDS` for each
  trajectory, so that all processor seconds are due to scheduling.

Usage: `python -m experiments bench_campaign [--count N] [--out FILE]`; `--count 0` skips the runs.
"""

from __future__ import annotations

import heapq
import os
import resource
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import numpy as np
import typer

from bem.dataset.campaign.checkpoints import CampaignCheckpoint
from bem.dataset.campaign.executors import Batch, ClusterExecutor
from bem.dataset.campaign.files import campaign_of, merge
from bem.dataset.campaign.plan import Campaign
from bem.dataset.campaign.work import Arrival, batches_of
from bem.dataset.designs import Design
from bem.dataset.file import Dataset, load_dataset
from bem.dataset.records import Settings, failed
from experiments.common import DATASET
from experiments.scale.ten_million import page_text
from experiments.timing import CLOCK, MEASUREMENTS, Busy, in_fresh_process, progress, publish

OUT = MEASUREMENTS / "campaign_scale.json"
DASK_WORKERS, DASK_TRAJECTORIES, STUB_SECONDS = 8, 12_450, 0.008
REPLAYED = (2, 8, 64, 1000)
IDLE_SECONDS = 5.0
RUN = 3000
DRAWN = 200_000
SHARDS = 2
STARTS = {
    "command": "import bem.cli.campaign, bem.dataset.campaign.run",
    "worker": (
        "from bem.dataset.campaign import executors, plan, worker\nworker.own_process = True\nworker.warm_solver()"
    ),
}


def seconds_of(work: Callable[[], Any]) -> float:
    """Processor seconds of a call of `work`."""
    with CLOCK:
        work()
    return CLOCK.seconds


def start_seconds(repeats: int = 3) -> dict[str, float]:
    """Processor seconds until a new process has run the code of `STARTS`; the kernels are compiled before."""
    said = "\nimport time; print(time.process_time())"
    return {name: median(in_fresh_process(code + said)[0] for _ in range(repeats)) for name, code in STARTS.items()}


def run_seconds(count: int, workers: int) -> dict[str, float]:
    """Wall seconds of `bem campaign`, and processor seconds of the command and its workers."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "bem", "campaign", "--count", str(count), "--workers", str(workers)]
        before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run([*command, "--out", f"{folder}/runs.h5"], check=True, stdout=subprocess.DEVNULL)
        wall, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"workers": workers, "wall": wall, "processor": spent}


def tail(campaign: Any, seconds: np.ndarray, workers: int) -> dict[str, float]:
    """Number of batches, and the excess over an equal share, if trajectory i takes `seconds[i]`; `seconds` is (n,)."""
    batches = batches_of(campaign.indices, campaign.expected_seconds(campaign.indices), workers)
    free = [0.0] * workers
    for batch in batches:
        heapq.heapreplace(free, free[0] + float(seconds[list(batch)].sum()))
    share = float(seconds.sum()) / workers
    return {"workers": workers, "batches": len(batches), "tail": max(free) / share - 1.0}


def saved(dataset: Dataset, folder: Path) -> dict[str, float]:
    """Processor seconds, storage and memory of the saving process for each trajectory, from a replay of a data set."""
    campaign, count = campaign_of(dataset.attributes), len(dataset)
    records = campaign.records(dataset.columns)
    order = {record.index: record for record in records}
    batches = batches_of(campaign.indices, campaign.expected_seconds(campaign.indices), 2)
    with CampaignCheckpoint(folder / "saved.h5", campaign.identity()) as checkpoint:

        def save() -> None:
            for batch in batches:
                checkpoint.add(campaign.columns([order[index] for index in batch]), 1.0, {})

        saving = seconds_of(save)
        stored = sum(path.stat().st_size for path in checkpoint.folder.glob("part-*.npz"))
        checkpoint.remove()
    whole, attributes = folder / "whole.h5", _attributes(dataset, campaign)
    writing = seconds_of(lambda: campaign.write(whole, campaign.columns(records), attributes, None))
    tracemalloc.start()
    again = campaign.records(dataset.columns)
    held = tracemalloc.get_traced_memory()[0] + sum(record.force.nbytes for record in again)
    tracemalloc.stop()
    return {
        "per_batch": saving / len(batches),
        "saving": saving / count,
        "writing": writing / count,
        "merging": merging(dataset, folder) / count,
        "drawing": seconds_of(lambda: Design("log-uniform").protocols(DRAWN, 0)) / DRAWN,
        "bytes": whole.stat().st_size / count,
        "part_bytes": stored / count,
        "held_bytes": held / count,
    }


def _attributes(dataset: Dataset, campaign: Campaign) -> dict[str, Any]:
    names = ("wall_seconds", "core_seconds", "workers", "versions", "host", "git_revision", "command")
    return {name: dataset.attributes[name] for name in names} | {"campaign": campaign.identity()}


def merging(dataset: Dataset, folder: Path) -> float:
    """Processor seconds of merging a data set from `SHARDS` shards."""
    identity = campaign_of(dataset.attributes).identity()
    paths = []
    for number in range(1, SHARDS + 1):
        shard = campaign_of({"campaign": identity | {"shard": f"{number}/{SHARDS}"}})
        rows = set(shard.indices.tolist())
        records = [record for record in shard.records(dataset.columns) if record.index in rows]
        paths.append(folder / f"{number}.h5")
        shard.write(paths[-1], shard.columns(records), _attributes(dataset, shard), None)
    return seconds_of(lambda: merge(paths, folder / "merged.h5"))


@dataclass(frozen=True)
class Asleep:
    """A stand-in for a batch of simulations, which sleeps and returns records of the usual size."""

    seconds: float

    def __call__(self, batch: Batch) -> Arrival:
        """Sleep for each trajectory of the batch."""
        time.sleep(self.seconds * len(batch))
        return Arrival([failed(index, "", Settings()) for index, _ in batch], self.seconds * len(batch))


def under_dask(count: int, workers: int, seconds: float) -> dict[str, float]:
    """Processor seconds of scheduler, workers and this process, for each of `count` trajectories that only sleep.

    The seconds that these processes spend without any work are subtracted; `idle` gives them per worker and second.
    `central` is the share of the scheduler and this process, which does not decrease with more workers.
    """
    import dask
    import distributed
    import psutil

    campaign = Campaign(count=count)
    items = dict(zip(campaign.indices.tolist(), campaign.items(campaign.indices), strict=True))
    batches = [
        tuple((index, items[index]) for index in batch)
        for batch in batches_of(campaign.indices, campaign.expected_seconds(campaign.indices), workers)
    ]
    options = {"host": "127.0.0.1", "dashboard_address": None, "silence_logs": 50}
    # Without these, workers profile themselves every hundredth of a second, and one that answers late is dropped.
    settings = {"distributed.worker.profile.enabled": False, "distributed.scheduler.worker-ttl": None}
    settings |= {f"distributed.comm.timeouts.{name}": "600s" for name in ("connect", "tcp")}
    # The scheduler runs in this process.
    with (
        dask.config.set(settings),
        distributed.LocalCluster(n_workers=workers, threads_per_worker=1, **options) as cluster,
    ):
        processes = [psutil.Process(worker.pid) for worker in cluster.workers.values()]

        def spent() -> np.ndarray:
            times = [process.cpu_times() for process in processes]
            return np.array([time.process_time(), sum(one.user + one.system for one in times)])

        with ClusterExecutor(cluster.scheduler_address) as executor:
            with distributed.Client(cluster, set_as_default=False) as client:
                client.run(Asleep(0.0), ((0, ()),))  # every worker imports what it needs
            idle, started = -spent(), time.perf_counter()
            time.sleep(IDLE_SECONDS)
            idle = (idle + spent()) / (time.perf_counter() - started)
            before, started = spent(), time.perf_counter()
            for _, arrival in progress(executor.run(batches, Asleep(seconds)), "Dask, batches", len(batches)):
                campaign.columns(arrival.records)
            cost, wall = spent() - before, time.perf_counter() - started
    central, of_workers = np.maximum(cost - idle * wall, 0.0) / count
    return {
        "workers": workers,
        "trajectories": count,
        "batches": len(batches),
        "seconds": seconds,
        "central": central,
        "scheduling": central + of_workers,
        "share": (central + of_workers) / seconds,
        "idle": idle.sum() / workers,
        "wall_share": wall * workers / (count * seconds) - 1.0,
    }


def expected_seconds(content: dict[str, Any], count: int, workers: int) -> float:
    """Wall seconds of a campaign on as many idle cores as workers, estimated from processor seconds.

    The workers load the solver while the command loads its modules, on the same cores. The workers then share the
    trajectories and the saving. One process writes the file.
    """
    start, one = content["start"], content["one_process"]
    begin = max(start["worker"], (start["command"] + workers * start["worker"]) / workers if workers > 1 else 0.0)
    late = next((tail["tail"] for tail in content["tails"] if tail["workers"] == workers), 0.0)
    work = (content["trajectory"] + one["saving"]) * count / workers
    return begin + work * (1.0 + late) + one["writing"] * count


def lines(content: dict[str, Any]) -> Iterator[str]:
    """Lines that report the measurement on a terminal."""
    for run in content["runs"]:
        yield f"{run['workers']} processes {run['wall']:8.2f} s wall {run['processor']:8.2f} s of processors"
    expected = [expected_seconds(content, RUN, workers) for workers in (1, 2)]
    yield f"expected speed-up with two processes, from processor seconds: {expected[0] / expected[1]:.2f}"
    if content["runs"]:
        one, two = (run["wall"] for run in content["runs"])
        yield f"speed-up with two processes, start included: {one / two:.2f}"
    yield f"start: command {content['start']['command']:.2f} s, worker {content['start']['worker']:.2f} s"
    for replayed in content["tails"]:
        yield f"{replayed['workers']:5} workers {replayed['batches']:6} batches, tail {100 * replayed['tail']:.1f} %"
    dask = content["dask"]
    yield (
        f"Dask, {dask['workers']} workers: {1e6 * dask['scheduling']:.0f} microseconds a trajectory, "
        f"{100 * dask['share']:.1f} % of {1e3 * dask['seconds']:g} ms; "
        f"without work {100 * dask['idle']:.1f} % of a core a worker"
    )
    yield page_text(content)


def main(
    count: Annotated[int, typer.Option(min=0, help="Trajectories of a run; 0 for no runs.")] = RUN,
    dataset: Annotated[Path, typer.Option(help="Data set file.")] = DATASET,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
    busy: Busy = False,
) -> None:
    """Measure what a campaign costs besides its trajectories, print it and publish it."""
    known = load_dataset(dataset)
    seconds = known.scalars["solver_seconds"]
    campaign = campaign_of(known.attributes)
    with tempfile.TemporaryDirectory() as folder:
        content = {
            "runs": [run_seconds(count, workers) for workers in progress((1, 2), "runs")] if count else [],
            "count": count,
            "cores": os.cpu_count(),
            "trajectory": float(seconds.mean()),
            "start": start_seconds(),
            "tails": [tail(campaign, seconds, workers) for workers in REPLAYED],
            "one_process": saved(known, Path(folder)),
            "dask": under_dask(DASK_TRAJECTORIES, DASK_WORKERS, STUB_SECONDS),
        }
    print("\n".join(lines(content)))
    publish(out, f"bench_campaign --count {count}", content, busy=busy)

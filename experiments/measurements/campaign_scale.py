"""What a campaign costs besides its trajectories.

- Runs: wall seconds of `bem campaign` with one and with two processes. Only these need an idle machine.
- Start: processor seconds until the command has loaded its modules, and until a worker has loaded the solver.
- One process saves all batches and writes the file: its processor seconds for each trajectory.
- Dask: a scheduler on this machine and `DASK_WORKERS` workers of one thread, which sleep `STUB_SECONDS` for each
  trajectory, so that all processor seconds are due to scheduling.
"""

import tempfile
import time
from functools import partial
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.wording import markdown_table
from bem.dataset.campaign import Campaign
from bem.dataset.executors import Arrival, Batch, ClusterExecutor
from bem.dataset.file import Dataset, load_dataset
from bem.dataset.journal import Journal
from bem.dataset.records import tabulate, untabulate
from bem.dataset.run import save_campaign
from experiments.measurements.harness import CLOCK, in_fresh_process, of_command, progress

DASK_WORKERS, DASK_TRAJECTORIES, STUB_SECONDS = 8, 12_450, 0.008
IDLE_SECONDS = 5.0
SAID = "\nimport time; print(time.process_time())"
STARTS = {
    "command": "import bem.cli.campaign, bem.dataset.run",
    "worker": "from bem.dataset import executors\nexecutors.warm_solver()",
}
"""What a new process runs until it says its processor seconds; the kernels are compiled before."""


def saved(dataset: Dataset, folder: Path) -> dict[str, float]:
    """Processor seconds and bytes of the saving process for each trajectory, from a replay of a data set."""
    campaign, count = Campaign.of(dataset.attributes["campaign"]), len(dataset)
    records, whole = untabulate(dataset.columns, campaign.layout), folder / "whole.h5"
    order = {record["index"]: record for record in records}
    with Journal(folder / "saved.h5", campaign.identity()) as journal:
        with CLOCK:
            for batch in campaign.batches(campaign.indices, 2):
                journal.add(tabulate([order[index] for index, _ in batch], campaign.layout), 1.0, {})
        saving = CLOCK.seconds
        journal.remove()
    names = ("wall_seconds", "core_seconds", "workers", "versions", "host", "git_revision", "command")
    attributes = {name: dataset.attributes[name] for name in names} | {"campaign": campaign.identity()}
    with CLOCK:
        save_campaign(campaign, whole, tabulate(records, campaign.layout), attributes)
    return {"saving": saving / count, "writing": CLOCK.seconds / count, "bytes": whole.stat().st_size / count}


def asleep(seconds: float, batch: Batch) -> Arrival:
    """Sleep for each trajectory of a batch, in place of its simulations, and return records of the usual size."""
    time.sleep(seconds * len(batch))
    return Arrival([Campaign().failed(index, "") for index, _ in batch], seconds * len(batch))


def under_dask(count: int, workers: int, seconds: float) -> dict[str, float]:
    """Processor seconds of scheduler, workers and this process, for each of `count` trajectories that only sleep.

    The seconds that these processes spend without any work are subtracted. `central` is that of the scheduler and this
    process, which does not decrease with more workers.
    """
    import dask
    import distributed
    import psutil

    campaign = Campaign(count=count)
    batches = campaign.batches(campaign.indices, workers)
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
                client.run(asleep, 0.0, ((0, ()),))  # every worker imports what it needs
            idle, started = -spent(), time.perf_counter()
            time.sleep(IDLE_SECONDS)
            idle = (idle + spent()) / (time.perf_counter() - started)
            before, started = spent(), time.perf_counter()
            for _, arrival in progress(executor.run(batches, partial(asleep, seconds)), "Dask, batches", len(batches)):
                tabulate(arrival.records, campaign.layout)
            cost, wall = spent() - before, time.perf_counter() - started
    central, of_workers = np.maximum(cost - idle * wall, 0.0) / count
    return {"workers": workers, "seconds": seconds, "central": central, "scheduling": central + of_workers}


def page_text(campaign_scale: Any, dataset: Path) -> str:
    """The measurement as a Markdown table, for docs/cluster.md, beside the mean time of a published trajectory."""
    dask, one = campaign_scale["dask"], campaign_scale["one_process"]
    each = float(load_dataset(dataset).scalars["solver_seconds"].mean())
    starts = " s, ".join(f"{value:.1f}" for value in campaign_scale["start"].values())
    fed = [each / seconds for seconds in (one["saving"], one["saving"] + dask["central"])]
    scheduling = f"{1e6 * dask['scheduling']:.0f} µs, {100.0 * dask['scheduling'] / dask['seconds']:.1f} %"
    rows = [
        ["A trajectory, published data set", f"{1e3 * each:.1f} ms"],
        ["Start: the command, then a worker", f"{starts} s"],
        ["Saved by one process, for each trajectory", f"{1e6 * one['saving']:.0f} µs"],
        ["Written to the data set file at the end, for each", f"{1e6 * one['writing']:.0f} µs"],
        [f"Scheduled by Dask, {dask['workers']} workers", f"{scheduling} of {1e3 * dask['seconds']:g} ms"],
        ["Stored for each trajectory", f"{one['bytes']:.0f} bytes"],
        ["Cores that one process can save for", f"{fed[0]:.0f}, {fed[1]:.0f} with Dask"],
    ]
    return f"{markdown_table(['Quantity', 'Measured'], rows)}\n\nProcessor seconds of {campaign_scale['host']}."


def study(
    dataset: Path, *, count: Annotated[int, typer.Option(min=0, help="Trajectories of a run; 0 for no runs.")] = 3000
) -> dict[str, Any]:
    """Measure what a campaign costs besides its trajectories."""
    known = load_dataset(dataset)
    with tempfile.TemporaryDirectory() as folder:
        runs = []
        for workers in progress((1, 2) if count else (), "runs"):
            words = ("--count", str(count), "--workers", str(workers), "--out", f"{folder}/runs-{workers}.h5")
            wall, processor = of_command("campaign", *words)
            runs.append({"workers": workers, "wall": wall, "processor": processor})
        return {
            "runs": runs,
            "count": count,
            "start": {
                name: median(in_fresh_process(code + SAID)[0] for _ in range(3)) for name, code in STARTS.items()
            },
            "one_process": saved(known, Path(folder)),
            "dask": under_dask(DASK_TRAJECTORIES, DASK_WORKERS, STUB_SECONDS),
        }

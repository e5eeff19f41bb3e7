import functools
import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter

import pytest

from bem.dataset.executors import CampaignError, ClusterExecutor, scheduler_address
from bem.dataset.run import run_campaign
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import HANG, assert_same_numbers, await_parts, command, start_command
from tests.processes import ROOT


def test_cluster_gives_the_same_numbers_with_a_worker_killed(plan, undisturbed_slow, tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    out = tmp_path / "data.h5"
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as cluster:
        victim = next(iter(cluster.workers.values())).pid
        killed = []

        def kill_one(done, failed):
            if done > 20 and not killed:
                killed.append(os.kill(victim, signal.SIGKILL))

        address = cluster.scheduler_address
        summary = run_campaign(plan, out, cluster=address, solver=stand_in.slow, progress=kill_one)
    assert killed
    assert (summary.count, summary.failures) == (120, Counter())
    assert_same_numbers(out, undisturbed_slow)
    with pytest.raises(CampaignError, match="no Dask scheduler answers at"):
        ClusterExecutor(address, patience=1.0)


@pytest.mark.slow
def test_a_scheduler_lost_while_running_ends_in_one_sentence(undisturbed_slow, tmp_path):
    pytest.importorskip("distributed")
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    where = ("--host", "127.0.0.1", "--port", address.rpartition(":")[2], "--no-dashboard")
    begin = functools.partial(subprocess.Popen, env=environment, stderr=subprocess.DEVNULL)
    scheduler = begin([sys.executable, "-m", "distributed.cli.dask_scheduler", *where])
    worker = begin([sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"])
    out = tmp_path / "data.h5"
    command = ("campaign", "--count", 120, "--seed", 4, "--native", "--out", out)
    try:
        time.sleep(5.0)
        process = start_command(*command, "--cluster", address)
        await_parts(out, process, 3)
        scheduler.kill()
        _, errors = process.communicate(timeout=HANG)
    finally:
        for one in (scheduler, worker):
            one.kill()
            one.wait()
    lost = f"bem: lost the Dask scheduler at {address!r}; what is saved is kept, and the same command continues\n"
    assert (process.returncode, errors) == (1, lost)
    process = start_command(*command)
    printed, _ = process.communicate(timeout=HANG)
    assert (process.returncode, " 120 of them computed now" in printed) == (0, False)
    assert_same_numbers(out, undisturbed_slow)


@pytest.mark.parametrize("answers", [False, True])
def test_a_server_that_is_dead_or_of_another_kind_ends_in_one_sentence(answers, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(ClusterExecutor.__init__, "__defaults__", (1.0,))
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1] if answers else 9}"
        result = command("campaign", "--count", "3", "--out", tmp_path / "x.h5", "--cluster", address)
    assert (result.exit_code, result.stderr) == (1, f"bem: no Dask scheduler answers at {address!r}\n")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "address",
    ["foo", "tcp://127.0.0.1", "inproc://x", "http://host:1", "teleport://here:1", "", "tcp://h:99999", "tcp://h:1/x"],
)
def test_malformed_addresses_are_refused(address):
    with pytest.raises(ValueError, match="cluster must be an address like 'tcp://host:8786'; received"):
        scheduler_address(address)
    assert scheduler_address("host:8786") == "tcp://host:8786"
    assert scheduler_address("tls://[::1]:8786/") == "tls://[::1]:8786"

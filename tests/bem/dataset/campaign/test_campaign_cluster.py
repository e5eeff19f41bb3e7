import os
import signal
import socket
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from bem.dataset.campaign.checkpoints import CampaignError
from bem.dataset.campaign.executors import ClusterExecutor, scheduler_address
from bem.dataset.campaign.run import run_campaign
from tests.bem.dataset.campaign import stand_in
from tests.bem.dataset.campaign.helpers import HANG, assert_same_numbers, command

ROOT = Path(__file__).parents[4]


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


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp://127.0.0.1:9", "no Dask scheduler answers at 'tcp://127.0.0.1:9'"),
        ("teleport://here", "cluster must be an address like"),
        ("", "cluster must be an address like"),
    ],
)
def test_dead_scheduler(address, message, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(ClusterExecutor.__init__, "__defaults__", (1.0,))
    result = command("campaign", "--count", "3", "--out", tmp_path / "x.h5", "--cluster", address)
    assert (result.exit_code > 0, message in result.stderr, result.stderr.count("\n")) == (True, True, 1)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "address",
    ["foo", "tcp://127.0.0.1", "inproc://x", "http://host:1", "teleport://here:1", "", "tcp://h:99999", "tcp://h:1/x"],
)
def test_malformed_addresses_are_refused(address):
    with pytest.raises(ValueError, match="cluster must be an address like 'tcp://host:8786'; received"):
        scheduler_address(address)


def test_addresses():
    assert scheduler_address("host:8786") == "tcp://host:8786"
    assert scheduler_address("tls://[::1]:8786/") == "tls://[::1]:8786"


def test_a_server_of_another_kind_ends_in_one_sentence(tmp_path):
    """In a process of its own, because Dask would complain at its end."""
    pytest.importorskip("distributed")
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        code = (
            "import sys, bem.cli.app, bem.dataset.campaign.executors\n"
            "bem.dataset.campaign.executors.ClusterExecutor.__init__.__defaults__ = (1.0,)\n"
            f"sys.argv = ['bem', 'campaign', '--count', '3', '--out', 'x.h5', '--cluster', {address!r}]\n"
            "bem.cli.app.app_main()\n"
        )
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        result = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=HANG
        )
    assert (result.returncode, result.stderr) == (1, f"bem: no Dask scheduler answers at {address!r}\n")
    assert not list(tmp_path.iterdir())

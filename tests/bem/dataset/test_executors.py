"""Batches and the workers that take them: processes that die, a Dask scheduler that is lost."""

import itertools
import os
import pickle
import signal
import socket
from collections import Counter, deque
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from multiprocessing import active_children

import numpy as np
import pytest

from bem.dataset import executors
from bem.dataset.campaign import BATCHES_PER_WORKER, LARGEST_BATCH, SHARE_OF_REST, Campaign
from bem.dataset.designs import Design
from bem.dataset.executors import CampaignError, ClusterExecutor, results
from bem.dataset.file import load_dataset
from bem.dataset.run import run_campaign
from bem.results.trajectory import Jump
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import Here, assert_same_numbers, command, parts, run_here
from tests.processes import ROOT


@pytest.mark.parametrize(("count", "workers"), [(3000, 2), (3000, 1), (120, 8), (1, 4), (0, 1)])
def test_batches_hold_each_trajectory_once(count, workers):
    plan = Campaign(count=3000)
    batches = plan.batches(np.arange(count), workers)
    assert sorted(index for batch in batches for index, _ in batch) == list(range(count))
    for batch in batches:
        assert [case for _, case in batch] == plan.cases_of(np.array([index for index, _ in batch]))
    sizes = np.array([len(batch) for batch in batches])
    remaining = count - np.cumsum(sizes) + sizes
    least = max(count / (BATCHES_PER_WORKER * workers), 1.0)
    assert np.all(sizes <= np.minimum(np.maximum(remaining / (SHARE_OF_REST * workers), least), LARGEST_BATCH))
    assert np.all(sizes[:-1] >= sizes[1:])


@pytest.mark.parametrize(("workers", "largest"), [(1, 4), (200, 7)])
def test_long_batch_returns_in_pieces(workers, largest, plan, monkeypatch):
    """They are longer with many workers, so that one process can save them."""
    clock = itertools.count()
    monkeypatch.setattr("time.perf_counter", lambda: 0.3 * next(clock))
    monkeypatch.setattr(Here, "workers", workers)
    batch = tuple(enumerate(plan.cases_of(plan.indices)))
    monkeypatch.setattr(Campaign, "batches", lambda *_: deque([batch]))
    arrivals = list(results(plan, plan.indices, Here(), stand_in.solve))
    assert [record["index"] for arrival in arrivals for record in arrival.records] == list(range(120))
    assert {len(arrival.records) for arrival in arrivals[:-1]} == {largest}


class Mortal(executors.Executor):
    """Workers that die of some items as often as is told."""

    died, in_flight, patience = BrokenProcessPool, 2, 3

    def __init__(self, deaths):
        self.deaths, self.begun = deaths, []

    def submit(self, task, batch):
        self.begun.append(len(batch))
        future, deadly = Future(), [index for index, _ in batch if self.deaths.get(index, 0)]
        if deadly:
            self.deaths[deadly[0]] -= 1
            future.set_exception(BrokenProcessPool())
        else:
            future.set_result(task(batch))
        return future


@pytest.mark.parametrize(
    ("deaths", "begun", "given_up"),
    [({2: 2}, [4, 3, 4, 4], []), ({2: 5}, [4, 3, 4, 4, 1, 1, 1, 1, 1, 1], []), ({2: 9}, [4, 3, 4, 4] + 6 * [1], [2])],
)
def test_batch_of_a_dead_worker_is_divided(deaths, begun, given_up):
    items = [(index, None) for index in range(7)]
    executor = Mortal(deaths)
    outcomes = list(executor.run(deque([tuple(items[:4]), tuple(items[4:])]), len))
    assert executor.begun == begun
    assert sorted(item for batch, _ in outcomes for item in batch) == items
    assert [batch[0][0] for batch, result in outcomes if result is None] == given_up


def test_batch_carries_its_protocols_only():
    plan = Campaign(count=2000, design=Design("sobol"))

    class Pool(Here):
        def run(self, batches, task):
            for batch in batches:
                assert len(pickle.dumps((task, batch))) < 120 * (10 + len(batch))
            yield from super().run(deque([batches[-1]]), lambda batch: pickle.loads(pickle.dumps(task))(batch))

    for record in next(results(plan, plan.indices, Pool(), stand_in.solve)).records:
        (case,) = plan.cases_of(np.array([record["index"]]))
        assert record["scalars/end_force"] == stand_in.solve(*case).end_force


@pytest.mark.usefixtures("in_this_process")
def test_where_the_work_was_done_is_recorded(tmp_path, monkeypatch):
    places = iter([{"host": "A", "versions": {"numpy": "1"}}, {"host": "B", "versions": {"numpy": "1"}}] * 500)
    monkeypatch.setattr(executors, "origin", lambda: next(places))
    run_campaign(Campaign(count=60, seed=4), tmp_path / "data.h5", solver=stand_in.solve)
    attributes = load_dataset(tmp_path / "data.h5").attributes
    assert (attributes["host"], attributes["versions"]) == (["A", "B"], {"numpy": "1"})


def test_workers_with_another_solver_fail(plan):
    class Other(Here):
        def run(self, batches, task):
            batch = batches.popleft()
            yield batch, None
            yield batch, replace(task(batch), solver_version="older")

    arrivals = results(plan, plan.indices, Other(), stand_in.solve)
    lost = next(arrivals).records
    assert {(record["status"], record["reason"]) for record in lost} == {
        (1, "the worker process died every time, perhaps for lack of memory")
    }
    with pytest.raises(CampaignError, match="the workers run another version of the solver"):
        next(arrivals)


@pytest.mark.parametrize("spoilt", ["force", "stats", "jumps", "contact_radius"])
def test_infinite_numbers_are_failures(spoilt, plan):
    def solver(*arguments, accuracy):
        history = stand_in.solve(*arguments)
        bad = {
            "force": np.where(np.arange(len(history.time)) == 3, np.inf, history.force),
            "stats": replace(history.stats, nodes=np.inf),
            "jumps": (Jump(history.time[5], np.nan, 1.0, 2.0, 0.0, 0.0),),
            "contact_radius": np.full(len(history.time), np.nan),
        }
        return replace(history, **{spoilt: bad[spoilt]})

    (case,) = plan.cases_of(np.array([0]))
    assert plan.simulated(0, case, stand_in.solve)["reason"] == ""
    record = plan.simulated(0, case, solver)
    assert "not finite" in record["reason"]
    assert not np.isinf(record["scalars/nodes"])


def killing(worker, killed):
    """What is called as results arrive, and kills a worker once."""

    def progress(done, _):
        if done > 20 and not killed:
            killed.append(os.kill(worker(), signal.SIGKILL))

    return progress


def test_a_killed_worker_costs_nothing(plan, undisturbed, out):
    killed = []
    progress = killing(lambda: active_children()[0].pid, killed)
    summary = run_campaign(plan, out, workers=2, solver=stand_in.slow, progress=progress)
    assert (killed, summary.count, summary.failures) == ([None], 120, Counter())
    assert_same_numbers(out, undisturbed)


def test_cluster_gives_the_same_numbers(plan, undisturbed, out, tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    killed, lost = [], tmp_path / "lost.h5"
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as cluster:
        how = {"cluster": cluster.scheduler_address, "solver": stand_in.slow}
        progress = killing(lambda: next(iter(cluster.workers.values())).pid, killed)
        summary = run_campaign(plan, out, **how, progress=progress)
        assert (killed, summary.count, summary.failures) == ([None], 120, Counter())
        assert_same_numbers(out, undisturbed)
        with pytest.raises(CampaignError) as error:
            run_campaign(plan, lost, **how, progress=lambda done, _: cluster.close() if done else None)
    assert str(error.value) == (
        f"lost the Dask scheduler at {how['cluster']!r}; what is saved is kept, and the same command continues"
    )
    assert parts(lost)
    assert run_here(plan, lost, solver=stand_in.slow).computed < 120


@pytest.mark.parametrize("answers", [False, True])
def test_dead_server_gives_one_sentence(answers, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(ClusterExecutor.__init__, "__defaults__", (1.0,))
    with socket.create_server(("127.0.0.1", 0)) as server:
        # Of TCP, where no scheme is given.
        address = f"127.0.0.1:{server.getsockname()[1]}" if answers else "tcp://127.0.0.1:9/"
        result = command("campaign", "--count", "3", "--out", tmp_path / "x.h5", "--cluster", address)
    assert (result.exit_code, result.stderr) == (1, f"bem: no Dask scheduler answers at {address!r}\n")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "address", ["foo", "tcp://127.0.0.1", "inproc://x", "http://host:1", "teleport://here:1", "", "tcp://h:1/x"]
)
def test_malformed_addresses_are_refused(address):
    pytest.importorskip("distributed")
    with pytest.raises(ValueError, match="cluster must be an address like 'tcp://host:8786'; received"):
        ClusterExecutor(address)

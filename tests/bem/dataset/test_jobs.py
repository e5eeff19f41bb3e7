import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bem.dataset.jobs
from bem.dataset.campaign import Campaign
from bem.dataset.checkpoints import CampaignError
from bem.dataset.designs import Design
from bem.dataset.file import load_dataset
from bem.dataset.jobs import BATCHES_PER_WORKER, LONGEST_BATCH, SHARE_OF_REST, batches_of, expected_seconds, results
from bem.dataset.run import run_campaign
from bem.trajectory import Jump
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import Here

PRICE = json.loads((Path(__file__).parents[3] / "published" / "accuracy_price.json").read_text())["levels"]


@pytest.mark.parametrize(("count", "workers"), [(3000, 2), (3000, 1), (120, 8), (1, 4)])
def test_batches_hold_every_trajectory_once_the_costliest_first_and_shrink(count, workers):
    cost = expected_seconds(Campaign().cases_of(np.arange(count)), "standard")
    batches = batches_of(np.arange(count), cost, workers)
    assert sorted(index for batch in batches for index in batch) == list(range(count))
    shares = np.array([cost[list(batch)].sum() for batch in batches])
    rest = np.sum(cost) - np.cumsum(shares) + shares
    least = np.sum(cost) / (BATCHES_PER_WORKER * workers)
    single = np.array([len(batch) == 1 for batch in batches])
    assert np.all(single | (shares <= 1.001 * np.maximum(rest / (SHARE_OF_REST * workers), least)))
    assert cost[list(batches[0])].min() >= cost[list(batches[-1])].max()


def test_batches_of_many_workers_are_long_enough_to_be_saved():
    seconds = np.full(1_000_000, 0.006)
    batches = batches_of(np.arange(len(seconds)), seconds, workers=1000)
    assert len(batches[0]) == pytest.approx(seconds.sum() / (SHARE_OF_REST * 1000) / 0.006, rel=0.01)
    assert max(map(len, batches_of(np.arange(len(seconds)), 100.0 * seconds, 1000))) == 16  # 10 s of 0.6 s each


@pytest.mark.parametrize("level", PRICE, ids=lambda level: level["accuracy"])
def test_no_batch_is_expected_to_keep_a_worker_long(level):
    seconds = expected_seconds(Campaign().cases_of(np.arange(3000)), level["accuracy"])
    measured = level["seconds"]["mean"]
    assert measured / 3.0 < seconds.mean() < 3.0 * measured
    batches = batches_of(np.arange(3000), seconds, workers=2)
    assert all(len(batch) == 1 or seconds[list(batch)].sum() <= LONGEST_BATCH for batch in batches)


def test_a_batch_travels_with_its_own_protocols_only():
    plan = Campaign(count=50_000, design=Design("sobol"))

    class Pool:
        workers = 2

        def run(self, batches, task):
            sizes.extend(len(pickle.dumps((task, batch))) / (10 + len(batch)) for batch in batches)
            return ((batch, task(batch)) for batch in batches[:1])

    sizes = []
    arrivals = list(results(plan, plan.indices, Pool(), stand_in.solve))
    assert max(sizes) < 120
    for record in arrivals[0].records:
        quantities = {name: values[record["index"]] for name, values in plan.protocols.items()}
        alone = stand_in.solve(*stand_in.case(quantities))
        assert record["scalars/end_force"] == alone.end_force


@pytest.mark.usefixtures("in_this_process")
def test_where_the_work_was_done_is_recorded(tmp_path, monkeypatch):
    places = iter([{"host": "A", "versions": {"numpy": "1"}}, {"host": "B", "versions": {"numpy": "1"}}] * 500)
    monkeypatch.setattr(bem.dataset.jobs, "origin", lambda: next(places))
    run_campaign(Campaign(count=60, seed=4), tmp_path / "data.h5", solver=stand_in.solve)
    attributes = load_dataset(tmp_path / "data.h5").attributes
    assert (attributes["host"], attributes["versions"]) == (["A", "B"], {"numpy": "1"})


def test_workers_with_another_solver_end_the_campaign(plan):
    class Other(Here):
        def run(self, batches, task):
            return ((batch, task(batch)._replace(solver_version="older")) for batch in batches)

    with pytest.raises(CampaignError, match="the workers run another version of the solver"):
        next(results(plan, plan.indices, Other(), stand_in.solve))


@pytest.mark.parametrize("spoilt", ["force", "stats", "jumps", "contact_radius"])
def test_numbers_that_are_not_finite_are_a_failure_and_reach_no_file(spoilt, plan):
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

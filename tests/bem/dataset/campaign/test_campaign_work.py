import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import bem.dataset.campaign.work
from bem.dataset.campaign.plan import Campaign
from bem.dataset.campaign.run import run_campaign
from bem.dataset.campaign.work import LONGEST_BATCH, batches_of, expected_seconds, results
from bem.dataset.designs import Design
from bem.dataset.file import load_dataset
from bem.dataset.records import simulate_record
from tests.bem.dataset.campaign import stand_in
from tests.bem.dataset.campaign.helpers import Here

PRICE = json.loads((Path(__file__).parents[4] / "published" / "accuracy_price.json").read_text())["levels"]


def test_batches_hold_every_trajectory_once_and_the_costliest_first():
    protocols = Design("paper").protocols(3000, seed=0)
    cost = expected_seconds(protocols)
    batches = batches_of(np.arange(3000), cost, workers=2)
    assert sorted(index for batch in batches for index in batch) == list(range(3000))
    assert max(map(len, batches)) <= 32
    shares = [cost[list(batch)].sum() for batch in batches]
    assert max(shares) < 1.5 * np.sum(cost) / (2 * 48)
    assert cost[list(batches[0])].min() >= cost[list(batches[-1])].max()


@pytest.mark.parametrize("level", PRICE, ids=lambda level: level["accuracy"])
def test_no_batch_is_expected_to_keep_a_worker_long(level):
    seconds = expected_seconds(Design("paper").protocols(3000, seed=0), level["accuracy"])
    measured = level["seconds"]["mean"]
    assert measured / 3.0 < seconds.mean() < 3.0 * measured
    batches = batches_of(np.arange(3000), seconds, workers=2)
    assert all(len(batch) == 1 or seconds[list(batch)].sum() <= LONGEST_BATCH for batch in batches)


def test_a_batch_travels_with_its_own_protocols_only():
    plan = Campaign(count=50_000, design=Design("sobol"))

    class Pool:
        workers = 2

        def run(self, batches, task):
            sizes.extend(len(pickle.dumps((task, batch))) for batch in batches)
            return ((batch, task(batch)) for batch in batches[:1])

    sizes = []
    arrivals = list(results(plan, plan.indices, Pool(), stand_in.solve))
    assert max(sizes) < 5000
    for record in arrivals[0].records:
        alone = stand_in.solve(*stand_in.case({name: values[record.index] for name, values in plan.protocols.items()}))
        assert record.scalars["end_force"] == alone.end_force


def test_where_the_work_was_done_is_recorded(tmp_path, monkeypatch):
    places = iter([{"host": "A", "versions": {"numpy": "1"}}, {"host": "B", "versions": {"numpy": "1"}}] * 500)
    monkeypatch.setattr(bem.dataset.campaign.work, "origin", lambda: next(places))

    monkeypatch.setattr("bem.dataset.campaign.run.LocalExecutor", Here)
    run_campaign(Campaign(count=60, seed=4), tmp_path / "data.h5", solver=stand_in.solve)
    attributes = load_dataset(tmp_path / "data.h5").attributes
    assert (attributes["host"], attributes["versions"]) == (["A", "B"], {"numpy": "1"})


@pytest.mark.parametrize("spoilt", ["force", "nodes", "jumps", "contact_radius"])
def test_numbers_that_are_not_finite_are_a_failure_and_reach_no_file(spoilt, plan):
    class NoRadius(stand_in.History):
        contact_radius = property(lambda self: np.full(len(self.time), np.nan))

    def solver(*arguments, accuracy):
        history = stand_in.solve(*arguments)
        if spoilt == "force":
            history.force[3] = np.inf
        elif spoilt == "nodes":
            history.stats.nodes = np.nan
        elif spoilt == "jumps":
            history.jumps = (stand_in.Leap(0.5, np.nan, 1.0, 2.0),)
        else:
            history = NoRadius(**vars(history))
        return history

    quantities = {name: values[0] for name, values in plan.protocols.items()}
    assert simulate_record(0, quantities, plan.settings, stand_in.solve).reason == ""
    assert "not finite" in simulate_record(0, quantities, plan.settings, solver).reason

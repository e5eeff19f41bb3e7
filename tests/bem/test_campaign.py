import json
import pickle
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import bem.campaign_work
from bem.campaign import run_campaign
from bem.campaign_files import merge
from bem.campaign_plan import Campaign, deciding_modules
from bem.campaign_work import LONGEST_BATCH, batches_of, expected_seconds, results
from bem.dataset_file import load_dataset, open_dataset
from bem.designs import Design
from bem.measurement import measurement_grid
from surrogate.dataset import TrajectoryDataset

sys.path.insert(0, str(Path(__file__).parent))

import campaign_stand_in as stand_in
from campaign_helpers import assert_same_numbers

PRICE = json.loads((Path(__file__).parents[2] / "published" / "accuracy_price.json").read_text())["levels"]


def test_file_holds_what_its_documentation_says(plan, undisturbed):
    dataset = load_dataset(undisturbed)
    assert len(dataset) == 120
    assert dataset.force.shape == (120, 120)
    assert dataset.force.dtype == np.float32
    assert dataset.counts == (50, 20, 50)
    for name, values in plan.protocols.items():
        np.testing.assert_array_equal(dataset.protocols[name], values)
    for name in ("pull_off_force", "pull_off_time", "hysteresis", "max_compression", "end_force", "solver_seconds"):
        assert dataset.scalars[name].dtype == np.float64
    attributes = dataset.attributes
    assert (attributes["design"], attributes["seed"], attributes["accuracy"]) == ("paper", 4, "standard")
    assert attributes["ranges"]["tabor"] == [0.2, 3.2]
    assert attributes["command"] == "bem campaign --count 120"
    assert {"python", "numpy", "scipy", "numba"} <= attributes["versions"].keys()
    assert attributes["host"]
    assert attributes["git_revision"]
    assert 0.0 < attributes["core_seconds"] < 60.0
    assert 5e7 < attributes["peak_memory"] < 1e11
    jumps = dataset.columns["jumps/trajectory"]
    np.testing.assert_array_equal(np.unique(jumps), np.flatnonzero(plan.protocols["tabor"] > 1.0))
    np.testing.assert_array_equal(dataset.scalars["jump_count"], np.bincount(jumps, minlength=120))


def test_native_history_is_the_solvers_own(plan, undisturbed):
    times, _ = measurement_grid(**plan.protocols)
    with open_dataset(undisturbed) as file:
        offsets = file["native/offsets"][:]
        for row in (0, 57, 119):
            piece = slice(offsets[row], offsets[row + 1])
            time_, force = file["native/time"][piece], file["native/force"][piece]
            assert len(time_) >= 40
            assert force.max() == file["scalars/pull_off_force"][row]
            np.testing.assert_allclose(
                np.interp(times[row], time_, force), file["fms/force"][row], rtol=1e-6, atol=1e-6
            )


def test_the_surrogates_reader_reads_it(undisturbed):
    dataset = TrajectoryDataset.load(undisturbed)
    assert len(dataset.completed) == 120
    assert dataset.counts == (50, 20, 50)


def test_numbers_do_not_depend_on_the_number_of_workers(plan, undisturbed, tmp_path):
    run_campaign(plan, tmp_path / "one.h5", solver=stand_in.solve, workers=1)
    assert_same_numbers(tmp_path / "one.h5", undisturbed)


def test_failures_are_recorded_with_their_reason(tmp_path):
    plan = Campaign(count=200, seed=1)
    summary = run_campaign(plan, tmp_path / "data.h5", solver=stand_in.sometimes_fails)
    tabor = plan.protocols["tabor"]
    assert summary.failures == Counter(
        {
            "ArithmeticError: tabor is too large for me": int(np.sum(tabor > 3.0)),
            "no stable equilibrium found": int(np.sum(tabor < 0.25)),
        }
    )
    dataset = load_dataset(tmp_path / "data.h5")
    np.testing.assert_array_equal(dataset.completed, np.flatnonzero((tabor <= 3.0) & (tabor >= 0.25)))
    lost = dataset.columns["status"] == 1
    assert np.isnan(dataset.force[lost]).all()
    assert np.isnan(dataset.scalars["pull_off_force"][lost]).all()
    np.testing.assert_array_equal(dataset.protocols["tabor"], tabor)


def test_the_same_command_again_does_nothing(plan, undisturbed):
    content = undisturbed.read_bytes()
    assert run_campaign(plan, undisturbed, solver=stand_in.solve).computed == 0
    assert undisturbed.read_bytes() == content


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"seed": 5}, "seed 4 there and 5 here"),
        ({"accuracy": "draft"}, "accuracy 'standard' there and 'draft' here"),
        ({"design": Design("sobol")}, "design 'paper' there and 'sobol' here"),
    ],
)
def test_another_campaign_does_not_overwrite(change, message, undisturbed, tmp_path):
    plan = Campaign(**{"count": 120, "seed": 4, "native": True} | change)
    content = undisturbed.read_bytes()
    with pytest.raises(ValueError, match=message):
        run_campaign(plan, undisturbed, solver=stand_in.solve)
    assert undisturbed.read_bytes() == content
    copy = tmp_path / "data.h5"
    copy.write_bytes(content)
    assert run_campaign(plan, copy, solver=stand_in.solve, replace=True).computed == 120
    run_campaign(plan, tmp_path / "fresh.h5", solver=stand_in.solve)
    assert_same_numbers(copy, tmp_path / "fresh.h5")


def test_another_version_of_the_solver_is_told_apart(plan, undisturbed):
    with pytest.raises(ValueError, match="made by another version of the solver"):
        run_campaign(plan, undisturbed, solver=stand_in.slow)


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


def test_resuming_asks_once_which_trajectories_are_wanted(undisturbed, tmp_path, monkeypatch):
    class Counted(np.ndarray):
        def tolist(self):
            asked.append(len(self))
            return super().tolist()

    asked = []
    plan = Campaign(count=120, seed=4, native=True)
    plan.__dict__["indices"] = plan.indices.view(Counted)
    with monkeypatch.context() as patch:
        patch.setattr("bem.campaign.write_dataset", lambda *_: (_ for _ in ()).throw(OSError("unplugged")))
        with pytest.raises(RuntimeError, match="unplugged"):
            run_campaign(plan, tmp_path / "data.h5", solver=stand_in.solve)
    asked.clear()
    assert run_campaign(plan, tmp_path / "data.h5", solver=stand_in.solve).computed == 0
    assert len(asked) < 5
    assert_same_numbers(tmp_path / "data.h5", undisturbed)


def test_the_digest_is_of_what_decides_the_numbers():
    names = {path.stem for path in deciding_modules()}
    assert names == {
        *("_checks", "_jit", "_lapack", "accuracy", "cohesive_zone", "contact", "equilibrium", "folds", "hard_contact"),
        *("hertz", "history", "influence", "march", "materials", "measurement", "memory", "mesh", "monotone", "peaks"),
        *("prediction", "protocol", "records", "scene", "simulate", "tractions", "trajectory", "transfer"),
    }


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"count": "12"}, "count must be a whole number from 1 to 559872; received '12'"),
        ({"count": 1e400}, "count must be a whole number"),
        ({"count": float("nan")}, "count must be a whole number"),
        ({"count": 10**30}, "count must be a whole number"),
        ({"count": 0}, "count must be a whole number"),
        ({"seed": -1}, "seed must be a whole number"),
        ({"seed": 0.5}, "seed must be a whole number"),
        ({"counts": (50.9, 20, 50)}, "counts must be three integers"),
        ({"counts": 120}, "counts must be three integers"),
        ({"shard": (4, 5), "count": 3}, "shards must be a whole number from 1 to 3; received 5"),
        ({"shard": (0, 5)}, "shard must be a whole number from 1 to 5; received 0"),
    ],
)
def test_impossible_campaigns_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Campaign(**arguments)


def test_failed_trajectories_are_computed_again_when_asked(tmp_path, monkeypatch):
    out, mended = tmp_path / "data.h5", tmp_path / "mended"
    monkeypatch.setenv("STAND_IN_MARKER", str(mended))
    plan = Campaign(count=200, seed=1)
    tabor = plan.protocols["tabor"]
    deep = int(np.sum(tabor > 3.0))

    def run(**options):
        return run_campaign(plan, out, solver=stand_in.fails_until_mended, workers=1, **options)

    stand_in.restart_workers()
    assert sum(run().failures.values()) == deep
    assert run().computed == 0
    again = run(retry_failed=True)
    assert (again.computed, sum(again.failures.values())) == (deep, deep)
    mended.touch()
    before = load_dataset(out)
    found = run(retry_failed=True)
    assert (found.computed, found.count, found.failures) == (deep, 200, Counter())
    after = load_dataset(out)
    kept = before.completed
    np.testing.assert_array_equal(after.force[kept], before.force[kept])
    assert after.attributes["core_seconds"] > before.attributes["core_seconds"]
    assert run(retry_failed=True).computed == 0
    assert sorted(tmp_path.iterdir()) == [out, mended]


def test_shards_completed_later_are_merged_again(tmp_path, monkeypatch):
    out, mended = tmp_path / "data.h5", tmp_path / "mended"
    monkeypatch.setenv("STAND_IN_MARKER", str(mended))
    stand_in.restart_workers()
    plans = [Campaign(count=200, seed=1, shard=(number, 2)) for number in (1, 2)]

    def run(plan, **options):
        return run_campaign(plan, out, solver=stand_in.fails_until_mended, workers=1, **options).path

    paths = [run(plan) for plan in plans]
    assert sum(merge(paths, out).failures.values()) > 0
    mended.touch()
    for plan in plans:
        run(plan, retry_failed=True)
    assert merge(paths, out).failures == Counter()


def test_an_interrupted_retry_continues(tmp_path, monkeypatch):
    out, mended = tmp_path / "data.h5", tmp_path / "mended"
    monkeypatch.setenv("STAND_IN_MARKER", str(mended))
    stand_in.restart_workers()
    plan = Campaign(count=200, seed=1)

    def run(**options):
        return run_campaign(plan, out, solver=stand_in.fails_until_mended, workers=1, **options)

    failed = sum(run().failures.values())
    mended.touch()

    def stop(done, _):
        if done > 200 - failed:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(retry_failed=True, progress=stop)
    assert run().computed == 0  # and leaves what the retry saved
    found = run(retry_failed=True)
    assert 0 < found.computed < failed
    assert found.failures == Counter()
    assert sorted(tmp_path.iterdir()) == [out, mended]


def test_where_the_work_was_done_is_recorded(tmp_path, monkeypatch):
    places = iter([{"host": "A", "versions": {"numpy": "1"}}, {"host": "B", "versions": {"numpy": "1"}}] * 500)
    monkeypatch.setattr(bem.campaign_work, "origin", lambda: next(places))

    class Here:
        workers = 1

        def __init__(self, *_):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def run(self, batches, task):
            return ((batch, task(batch)) for batch in batches)

    monkeypatch.setattr("bem.campaign.LocalPool", Here)
    run_campaign(Campaign(count=60, seed=4), tmp_path / "data.h5", solver=stand_in.solve)
    attributes = load_dataset(tmp_path / "data.h5").attributes
    assert (attributes["host"], attributes["versions"]) == (["A", "B"], {"numpy": "1"})


def test_a_link_stays_one_and_what_it_leads_to_is_written(tmp_path):
    (tmp_path / "there").mkdir()
    link = tmp_path / "data.h5"
    link.symlink_to(tmp_path / "there" / "real.h5")
    run_campaign(Campaign(count=10), link, solver=stand_in.solve, workers=1)
    assert link.is_symlink()
    assert len(load_dataset(tmp_path / "there" / "real.h5")) == 10
    link.unlink()
    link.symlink_to(link)
    with pytest.raises(ValueError, match="out must not be a link in circles"):
        run_campaign(Campaign(count=10), link, solver=stand_in.solve, workers=1)

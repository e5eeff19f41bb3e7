"""What a campaign costs besides its trajectories: replays, saving, and the estimate, on small and made-up cases."""

import numpy as np
import pytest

from bem.dataset.campaign.plan import Campaign
from bem.dataset.file import load_dataset
from experiments.scale import bench_campaign
from experiments.scale.ten_million import TRAJECTORIES, estimate, page_text

MEASURED = {
    "trajectory": 0.006,
    "start": {"command": 0.5, "worker": 1.0},
    "tails": [{"workers": 2, "batches": 40, "tail": 0.01}, {"workers": 1000, "batches": 9000, "tail": 3.0}],
    "one_process": {
        "saving": 3e-5,
        "writing": 1e-5,
        "merging": 6e-5,
        "drawing": 1e-6,
        "bytes": 500.0,
        "part_bytes": 1000.0,
        "held_bytes": 4000.0,
    },
    "dask": {"workers": 8, "seconds": 0.008, "central": 7e-5, "scheduling": 1e-4, "share": 0.0125, "idle": 0.01},
}


def test_workers_wait_for_the_last_batch():
    campaign = Campaign(count=300)
    expected = campaign.expected_seconds(campaign.indices)
    even = [bench_campaign.tail(campaign, expected, workers) for workers in (1, 2, 8)]
    assert even[0]["tail"] == pytest.approx(0.0, abs=1e-9)
    assert all(0.0 <= one["tail"] < 0.05 for one in even[1:])
    # Trajectories all of which cost what the cheapest is expected to, but one.
    seconds = np.full(300, 1e-3)
    seconds[int(np.argmin(expected))] = 1.0
    assert bench_campaign.tail(campaign, seconds, 2)["tail"] > 0.5


def test_one_process_saves_writes_and_merges_what_there_is(dataset, tmp_path):
    found = bench_campaign.saved(load_dataset(dataset), tmp_path)
    assert all(value > 0.0 for value in found.values())
    assert found["bytes"] > 480  # 120 forces of four bytes
    assert {path.name for path in tmp_path.iterdir()} >= {"whole.h5", "merged.h5", "1.h5", "2.h5"}
    assert len(load_dataset(tmp_path / "merged.h5")) == 60


def test_the_estimate_follows_from_what_was_measured():
    found = estimate(MEASURED)
    assert found["core_hours"] == pytest.approx(TRAJECTORIES * 0.006 / 3600.0)
    assert found["shards"] == 16
    assert found["minutes"] == pytest.approx((60.0 * 1.01 + 1.5 + 10.0) / 60.0)
    assert (found["cores_fed"], found["cores_scheduled"]) == (pytest.approx(200.0), pytest.approx(60.0))
    assert found["file_bytes"] == pytest.approx(5e9)
    slow = MEASURED | {"one_process": MEASURED["one_process"] | {"saving": 3e-4}}
    assert estimate(slow)["minutes"] > 2.5 * found["minutes"]  # then saving lasts longer than simulating
    assert "| Minutes on 1,000 cores, 16 shards of 64 processes | **1.2**" in page_text(MEASURED)


def test_the_start_is_what_two_processes_do_not_halve():
    plain = MEASURED | {"tails": [{"workers": 2, "batches": 1, "tail": 0.0}]}
    times = {workers: bench_campaign.expected_seconds(plain, 3000, workers) for workers in (1, 2)}
    work = 3000 * (0.006 + 3e-5)
    assert times == pytest.approx({1: 1.0 + work + 0.03, 2: 1.25 + 0.5 * work + 0.03})


@pytest.mark.slow
def test_scheduling_is_measured_with_workers_that_sleep():
    pytest.importorskip("distributed")
    found = bench_campaign.under_dask(40, 2, 0.01)
    assert found["scheduling"] >= 0.0
    assert found["idle"] > 0.0
    assert found["wall_share"] > 0.0

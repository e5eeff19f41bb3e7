"""What a campaign costs besides its trajectories: saving, the page, and Dask, on small and made-up cases."""

import pytest

from bem.dataset.file import load_dataset
from experiments.measurements import campaign_scale

MEASURED = {
    "trajectory": 0.006,
    "start": {"command": 0.5, "worker": 1.0},
    "one_process": {"saving": 3e-5, "writing": 1e-5, "bytes": 500.0},
    "dask": {"workers": 8, "seconds": 0.008, "central": 7e-5, "scheduling": 1e-4},
}


def test_one_process_saves_and_writes_what_there_is(dataset, tmp_path):
    found = campaign_scale.saved(load_dataset(dataset), tmp_path)
    assert all(value > 0.0 for value in found.values())
    assert found["bytes"] > 480  # 120 forces of four bytes
    assert len(load_dataset(tmp_path / "whole.h5")) == 60


def test_the_page_says_for_how_many_cores_one_process_can_save():
    text = campaign_scale.page_text(MEASURED | {"host": "a machine"})
    assert "| Cores that one process can save for | 200, 60 with Dask |" in text
    assert "| Start: the command, then a worker | 0.5 s, 1.0 s |" in text
    assert "| 100 µs, 1.2 % of 8 ms |" in text


@pytest.mark.slow
def test_scheduling_is_measured_with_workers_that_sleep():
    pytest.importorskip("distributed")
    found = campaign_scale.under_dask(40, 2, 0.01)
    assert found["scheduling"] >= found["central"] >= 0.0

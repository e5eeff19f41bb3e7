"""What a campaign costs besides its trajectories: saving, and Dask, on small and made-up cases."""

import pytest

from bem.dataset.file import load_dataset
from experiments.measurements import campaign_scale


def test_one_process_saves_and_writes_what_there_is(dataset, tmp_path):
    found = campaign_scale.saved(load_dataset(dataset), tmp_path)
    assert all(value > 0.0 for value in found.values())
    assert found["bytes"] > 480  # 120 forces of four bytes
    assert len(load_dataset(tmp_path / "whole.h5")) == 60


@pytest.mark.slow
def test_scheduling_is_measured_with_workers_that_sleep():
    pytest.importorskip("distributed")
    found = campaign_scale.under_dask(40, 2, 0.01)
    assert found["scheduling"] >= found["central"] >= 0.0

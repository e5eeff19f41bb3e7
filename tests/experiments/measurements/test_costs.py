"""What campaigns, commands and ticks cost, on small and made-up cases."""

import numpy as np
import pytest

from bem import LoadingProtocol, Scene, StandardLinearSolid
from bem.dataset.file import load_dataset
from experiments.measurements import campaign_scale, harness, latencies, limits
from experiments.measurements.cases import Case


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


@pytest.mark.parametrize(("dwell", "count"), [(0.01, 56), (10.0, 100)])
def test_a_protocol_is_followed_in_ticks_up_to_the_longest_number(dwell, count, monkeypatch):
    monkeypatch.setattr(latencies, "LONGEST", 100)
    protocol = LoadingProtocol(peak_indentation=0.2, loading_rate=100.0, dwell_time=dwell, unloading_rate=100.0)
    spent = latencies.ticks(Case(Scene(1.0, StandardLinearSolid(0.1)), protocol), np.random.default_rng(0))
    assert len(spent) == count
    assert min(spent) > 0.0


def test_the_shares_are_found(monkeypatch):
    monkeypatch.setattr(latencies, "ticks", lambda *_: [2e-4, 4e-4, 5e-3, 3e-4])
    content = latencies.study_contact_ticks(count=2)
    assert (content["count"], content["below_a_millisecond"]) == (8, 0.75)


def test_processor_seconds_are_those_of_the_command_alone():
    sum(number**2 for number in range(3_000_000))  # of this process
    assert 0.05 < harness.of_command("--version")[1] < 2.0


def test_a_prescribed_force_is_met():
    assert 0.0 < limits.force_error(1, count=3) < 1e-3


def test_the_first_elastic_contact_costs_most():
    found = {"elastic": [{"seconds": 0.05}, {"seconds": 5e-4}]}
    assert limits.elastic_text(found).startswith("50 ms of processor time the first time, 0.5 ms afterwards")

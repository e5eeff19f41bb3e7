import numpy as np
import pytest

from bem.dataset.file import Dataset, load_dataset
from bem.dataset.records import COMPLETED, FAILED
from bem.methods.closed_forms import dmt
from bem.problem.protocol import default_start_indentation
from experiments.paper import dataset_examples, dataset_statistics, inconsistencies


@pytest.fixture(scope="module")
def data(dataset):
    return load_dataset(dataset)


FIRST = np.arange(60) < 15


def changed(data, **scalars):
    """The data set with other scalars, or another status."""
    columns = {name if name == "status" else f"scalars/{name}": values for name, values in scalars.items()}
    return Dataset(data.columns | columns, data.attributes, data.counts)


def test_resolution_floor_is_the_steps_error(data):
    unloading, times = data.force[:, 69:].astype(np.float64), data.grid()[0][:, 69:]
    time = 2.0 * times[np.arange(60), unloading.argmax(axis=1)]
    shifted = changed(data, pull_off_force=unloading.max(axis=1) / 0.75, pull_off_time=time)
    floor = dataset_statistics.resolution_floor(shifted)
    np.testing.assert_allclose(floor["pull_off_force"], 0.25)
    np.testing.assert_allclose(floor["pull_off_time"], 0.5)


def test_dataset_statistics_and_percentiles(dataset, data):
    study = dataset_statistics.study(dataset)
    assert (study["trajectories"], study["completed"], study["distinct_protocols"]) == (60, 60, 60)
    assert study["solver_seconds"]["sum"] == pytest.approx(60 * 1e-3)
    assert study["resolution_floor"]["pull_off_force"].keys() == {"median", "p90", "p99", "largest"}
    core_seconds = data.attributes["wall_seconds"] * data.attributes["workers"]
    assert study["run_over_solver"] == pytest.approx(core_seconds / (60 * 1e-3))
    assert study["trajectories_over_solver"] == pytest.approx(data.attributes["core_seconds"] / (60 * 1e-3))
    assert study["parallel_efficiency"] == pytest.approx(data.attributes["core_seconds"] / core_seconds)
    assert study["cost_grows"]["with tabor"] == 0.0
    unloading = data.protocols["unloading_rate"]
    growing = dataset_statistics.statistics(changed(data, solver_seconds=1.0 / unloading))["cost_grows"]
    assert growing["with slow unloading"] == pytest.approx(1.0)
    percentiles = dataset_statistics.percentiles(np.arange(101.0))
    assert percentiles == {"median": 50.0, "p90": 90.0, "p99": 99.0, "largest": 100.0}


def test_end_above_far_field_is_attached(data):
    alone = dmt.rigid_force_from_indentation(default_start_indentation(data.protocols["tabor"]))
    ending = changed(data, end_force=np.where(FIRST, 4.1, 3.9) * alone)
    assert dataset_statistics.still_attached(ending).tolist() == FIRST.tolist()
    assert dataset_statistics.statistics(ending)["still_attached"] == 0.25


def test_failed_trajectories_are_not_counted(dataset, data, monkeypatch):
    end = np.where(FIRST, np.nan, data.scalars["pull_off_force"])
    status = np.where(FIRST, FAILED, COMPLETED)
    failed = changed(data, status=status, jump_count=FIRST.astype(int), end_force=end)
    assert dataset_statistics.statistics(failed)["with_jumps"] == 0.0
    monkeypatch.setattr("bem.dataset.file.load_dataset", lambda _: failed)
    assert list(inconsistencies.end_force(dataset).values()) == [1.0]


def test_uncompressed_has_no_force_ratio(data):
    compression = np.where(np.arange(60) < 7, 0.25, data.scalars["max_compression"])
    uncompressed = changed(data, max_compression=compression)
    before, after = (dataset_statistics.statistics(dataset)["never_compressed"] for dataset in (data, uncompressed))
    assert after == before + 7
    expected = data.scalars["pull_off_force"][7:] / -compression[7:]
    np.testing.assert_array_equal(dataset_statistics.force_ratio(uncompressed), expected[compression[7:] < 0.0])


def test_example_of_the_real_solver():
    quantities = dataset_examples.MAPPING | {"peak_indentation": 3.0}
    example = dataset_examples.example("x", quantities, "draft")
    assert len(example["steps"]["force"]) == 120
    assert example["phase_times"][3] == example["steps"]["time"][-1]
    for quantity in ("indentation", "force"):
        assert example["steps"][quantity][[0, -1]] == pytest.approx(example["native"][quantity][[0, -1]])
    assert example["results"]["pull_off_force"] == max(
        force
        for time, force in zip(example["native"]["time"], example["native"]["force"], strict=True)
        if time >= example["phase_times"][2]
    )

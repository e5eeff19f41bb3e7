import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bem"))

import campaign_stand_in as stand_in

from bem.campaign import run_campaign
from bem.campaign_plan import Campaign
from bem.dataset_file import Dataset, load_dataset
from experiments import accuracy_price, dataset_examples, dataset_statistics


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_campaign(Campaign(count=60, seed=2), path, solver=stand_in.solve)
    return path


def test_resolution_floor_is_what_the_steps_alone_cost(path):
    dataset = load_dataset(path)
    columns = dict(dataset.columns)
    unloading = dataset.force[:, 69:].astype(np.float64)
    rows = np.arange(60)
    times = dataset.grid()[0][:, 69:]
    columns["scalars/pull_off_force"] = unloading.max(axis=1) / 0.75
    columns["scalars/pull_off_time"] = times[rows, unloading.argmax(axis=1)] * 2.0
    floor = dataset_statistics.resolution_floor(Dataset(columns, dataset.attributes, dataset.counts))
    np.testing.assert_allclose(floor["pull_off_force"], 0.25)
    np.testing.assert_allclose(floor["pull_off_time"], 0.5)


def test_statistics_are_written(path, tmp_path):
    out = tmp_path / "statistics.json"
    dataset_statistics.main(path, out)
    found = json.loads(out.read_text(encoding="utf-8"))
    assert (found["trajectories"], found["completed"], found["distinct_protocols"]) == (60, 60, 60)
    assert found["solver_seconds"]["sum"] == pytest.approx(60 * 1e-3)
    assert found["resolution_floor"]["pull_off_force"].keys() == {"median", "p90", "p99", "largest"}


def test_price_compares_the_same_protocols(tmp_path):
    datasets = accuracy_price.run(40, 10, 3, tmp_path, 2, solver=stand_in.solve)
    levels = accuracy_price.price(datasets)
    assert [(level["accuracy"], level["trajectories"]) for level in levels] == [
        ("draft", 40),
        ("standard", 40),
        ("reference", 10),
    ]
    assert levels[0]["compared"] == 10
    assert levels[0]["errors"]["pull_off_force"]["largest"] == 0.0
    assert "errors" not in levels[2]
    with pytest.raises(ValueError, match="reference_count must be a whole number from 1 to 40"):
        accuracy_price.run(40, 41, 3, tmp_path, 2, solver=stand_in.solve)


def test_example_of_the_real_solver():
    quantities = dataset_examples.MAPPING | {"peak_indentation": 3.0}
    found = dataset_examples.example("x", quantities, "draft")
    assert len(found["steps"]["force"]) == 120
    assert found["results"]["pull_off_force"] == max(
        force
        for time, force in zip(found["native"]["time"], found["native"]["force"], strict=True)
        if time >= found["phase_times"][2]
    )

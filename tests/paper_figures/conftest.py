"""A small data set and result files computed by a stand-in for the solver."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bem"))

import campaign_stand_in as stand_in

from bem.campaign import run_campaign
from bem.campaign_plan import Campaign
from bem.dataset_file import load_dataset
from bem.measurement import measurement_grid
from experiments.dataset_statistics import statistics


@pytest.fixture(scope="session")
def dataset_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_campaign(Campaign(count=80, seed=2), path, solver=stand_in.solve)
    return path


@pytest.fixture(scope="session")
def statistics_path(dataset_path):
    path = dataset_path.with_name("statistics.json")
    path.write_text(json.dumps(statistics(load_dataset(dataset_path))), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def examples_path(dataset_path):
    protocol = {"tabor": 1.5, "peak_indentation": 5.0, "loading_rate": 2.0, "dwell_time": 1.0, "unloading_rate": 3.0}
    times, indentations = (values[0] for values in measurement_grid(**protocol))
    force = 1.0 - indentations * np.exp(-times / times[-1])
    example = {
        "protocol": protocol,
        "phase_times": [0.0, times[49], times[69], times[-1]],
        "native": {"time": times.tolist(), "indentation": indentations.tolist(), "force": force.tolist()},
        "steps": {"time": times.tolist(), "indentation": indentations.tolist(), "force": force.tolist()},
        "results": dict.fromkeys(
            ("pull_off_force", "pull_off_time", "max_compression", "hysteresis", "end_force"), 1.2345
        ),
        "jumps": 1,
    }
    path = dataset_path.with_name("examples.json")
    content = {"accuracy": "test", "examples": [{"name": name, **example} for name in "abcdef"], "mapping": example}
    path.write_text(json.dumps(content), encoding="utf-8")
    return path

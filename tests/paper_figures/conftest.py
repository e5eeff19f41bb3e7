"""A small data set computed by a stand-in for the solver, small results, and figures that are closed after a test."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from bem.dataset.campaign import Campaign
from bem.dataset.measurement_steps import measurement_grid
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here
from tests.paper_figures.results import PERCENTS


@pytest.fixture(scope="session")
def dataset_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_here(Campaign(count=80, seed=2), path, solver=stand_in.solve)
    return path


@pytest.fixture(scope="session")
def examples():
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
    return {"accuracy": "test", "examples": [{"name": name, **example} for name in "abcdef"], "mapping": example}


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


@pytest.fixture
def regimes():
    def regime(sample):
        steps = {"time": [0.0, 1.0], "indentation": [0.0, float(sample)]}
        errors = {"pull_off_force": 1.5, "hysteresis": 0.5}
        forces = {"paper": [0.5, -1.0 * sample], "swift": [0.4, -2.0 * sample]}
        return {
            "sample": sample,
            "protocol": {
                "tabor": 0.2 if sample in (1, 2, 3, 7, 8, 9) else 3.2,
                "peak_indentation": 5.0,
                "loading_rate": 10.0,
                "dwell_time": 1.0 if sample < 7 else 1e-3,
                "unloading_rate": 200.0,
            },
            "native": {"time": [0.0, 1.0], "indentation": [0.0, float(sample)], "force": [0.6, -1.1 * sample]},
            "steps": steps,
            "predicted": {name: {"force": force, "errors_percent": errors} for name, force in forces.items()},
            "seconds": {"solver": 0.01, "keras_call": 0.1, "predictor": 0.006, "predictor_batch": 0.0008},
            "paper_seconds": {"solver": 658.0, "surrogate": 0.12},
        }

    times = {"host": "a machine", "config": {"batch": 1024}}
    config = {"model": "M1-concat", "accuracy": "standard"}
    contact = {"radius": [0.0, 1.0], "surface": [-1.0, 0.0], "sphere": [0.0, 1.0], "force": 0.5}
    moments = {"pressed": (0.2, 5.0), "relaxed": (0.6, 5.0), "pull-off": (0.8, 1.0)}
    contacts = {name: contact | {"time": time, "indentation": depth} for name, (time, depth) in moments.items()}
    regimes = [regime(sample) for sample in range(1, 13)]
    return {"config": config, "times": times, "regimes": regimes, "contacts": contacts}


@pytest.fixture
def errors():
    values = np.geomspace(0.1, 10.0, 8)
    moments = {"mean": 2.0, "sd": 1.0, "median": 1.5, "p90": 6.0}
    statistics = {
        "trajectories": 8,
        "quartiles": {
            name: {column: {"mean": 2e-3, "sd": 1e-3} for column in ("mse", *PERCENTS)}
            for name in ("Q1", "Q2", "Q3", "Q4")
        },
        "overall": dict.fromkeys((*PERCENTS, "resolution_floor_percent"), moments),
        "spearman": {"pull_off_and_hysteresis": 0.25, "pull_off_and_nmae": 0.5},
        "per_trajectory": {**{name: values.tolist() for name in PERCENTS}, "quartile": [0, 0, 1, 1, 2, 2, 3, 3]},
    }
    ours = {name: column | {"median": 3.0} for name, column in statistics["overall"].items()}
    return {"config": {"model": "M1-concat"}, "paper": statistics, "swift": statistics | {"overall": ours}}


@pytest.fixture
def cracks():
    point = {
        "unloading_rate": 1.0,
        "theory": 2.0,
        "theory_at_own_velocity": 2.1,
        "solver": 2.2,
        "paper": 2.3,
        "swift": 2.4,
    }
    point["protocol"] = {"tabor": 3.24, "peak_indentation": 80.0, "loading_rate": 1.3895, "dwell_time": 3.0}
    points = [{**point, "point": k, "crack_velocity": 1.0 * k, "own_crack_velocity": 1.1 * k} for k in range(1, 15)]
    summary = {
        f"{name}_{statistic}_percent": percent
        for name in (
            "solver_against_theory",
            "solver_against_theory_at_own_velocity",
            "paper_against_theory",
            "swift_against_theory",
        )
        for statistic, percent in (("median", 1.0), ("largest", 3.0))
    }
    summary |= {"extrapolation_percent": 1.25, "trained_up_to_tabor": 3.2}
    theory = {"crack_velocity": [0.1, 10.0], "effective_energy": [1.0, 5.0]}
    return {"config": {"model": "M1-concat"}, "summary": summary, "points": points, "theory": theory}

"""The twelve canonical protocols: solver against surrogate, with the seconds of both.

The seconds are those that `experiments.measurements.canonical_times` measured and published.
Source: the paper's section "Canonical adhesion regimes" and its timing table.
"""

from typing import Any

import numpy as np

from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FIRST_UNLOADING
from experiments import common
from experiments.common import Config, Models, Result
from experiments.measurements.cases import Case, native
from experiments.paper_numbers import paper_rows


def regime(protocol: dict[str, Any], trained: Any, config: dict[str, Any], seconds: dict[str, float]) -> dict[str, Any]:
    """One row of the timing table: native history, measurement steps, prediction, scalars, errors and seconds."""
    from surrogate.data.metrics import hysteresis, nmae

    case = Case.of(protocol, config["modulus_ratio"])
    trajectory = case.simulated(config["accuracy"])
    steps = case.on_steps(trajectory)
    force = common.predicted(trained, steps["time"], steps["indentation"], protocol["tabor"])
    prediction, reference = (
        {
            "pull_off_force": float(values[FIRST_UNLOADING:].max()),
            "hysteresis": float(hysteresis(steps["indentation"][None], values[None])[0]),
        }
        for values in (force, steps["force"])
    )
    return {
        "sample": int(protocol["sample"]),
        "protocol": {name: protocol[name] for name in QUANTITIES},
        "native": native(trajectory),
        "steps": {**steps, "predicted": force},
        "errors_percent": {name: 100.0 * abs(prediction[name] - true) / abs(true) for name, true in reference.items()}
        | {"nmae": float(nmae(force[None], steps["force"][None])[0])},
        "seconds": seconds,
        "paper_seconds": {"solver": protocol["bem_seconds"], "surrogate": protocol["surrogate_seconds"]},
    }


def summary(regimes: list[dict[str, Any]]) -> dict[str, float]:
    """Medians over the twelve protocols."""
    columns = {name: np.array([row["seconds"][name] for row in regimes]) for name in regimes[0]["seconds"]}
    medians = {f"median_{name}_seconds": float(np.median(values)) for name, values in columns.items()}
    return medians | {"orders_of_magnitude": float(np.log10(np.median(columns["solver"] / columns["predictor"])))}


def study(config: Config, models: Models, canonical_times: Result) -> dict[str, Any]:
    """Simulate and predict the twelve protocols."""
    trained = common.load_surrogate(config["model"], models)
    regimes = [
        regime(protocol, trained, config, canonical_times["seconds"][str(int(protocol["sample"]))])
        for protocol in paper_rows("canonical_protocols")
    ]
    return {
        "config": config,
        "times": {name: canonical_times[name] for name in ("host", "config")},
        "summary": summary(regimes),
        "regimes": regimes,
    }

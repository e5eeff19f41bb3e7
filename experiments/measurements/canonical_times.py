"""Seconds of solver and surrogate on the twelve canonical protocols of the paper's timing table.

The surrogate is timed in three ways, on one thread and after a first call: the plain Keras call (`model.predict`, as
most scripts do it), the predictor on one protocol, and the predictor on a batch, per trajectory. The predictor uses
ONNX Runtime if the model was exported. Times are processor seconds, each the median of its repetitions.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bem.dataset.measurement_steps import measurement_grid
from experiments import common
from experiments.measurements.harness import progress, timed
from experiments.measurements.tools import scaled_inputs
from experiments.paper_numbers import paper_rows

KEYS = ("model", "modulus_ratio", "accuracy", "repetitions", "batch")
BATCHES = 3


def seconds_of(protocol: dict[str, Any], trained: Any, model: Any, config: dict[str, Any]) -> dict[str, float]:
    """Seconds of one protocol: of the solver, and of each way to call the surrogate.

    Args:
        protocol: A row of the paper's timing table.
        trained: The surrogate.
        model: The Keras model with the same weights.
        config: Configuration of the measurement.
    """
    tabor, repetitions, batch = protocol["tabor"], config["repetitions"], config["batch"]
    times, indentations = measurement_grid(**{name: protocol[name] for name in common.QUANTITIES})
    steps = {"time": times[0], "indentation": indentations[0]}
    inputs = scaled_inputs(trained, times, indentations, np.array([tabor]))
    many = [np.repeat(values, batch, axis=0) for values in (times, indentations)]
    accuracy = {name: config[name] for name in ("modulus_ratio", "accuracy")}
    calls = {
        "solver": (lambda: common.simulated(protocol, **accuracy), repetitions, 1),
        "keras_call": (lambda: model.predict(inputs, verbose=0), repetitions, 1),
        "predictor": (lambda: common.predicted(trained, steps, tabor), repetitions, 1),
        "predictor_batch": (lambda: trained.predict_history(*many, common.scenes(tabor)[0]), BATCHES, batch),
    }
    return {way: float(np.median(timed(call, count))) / share for way, (call, count, share) in calls.items()}


def study(config: dict[str, Any], models: Path) -> dict[str, Any]:
    """Time the twelve protocols."""
    trained = common.load_surrogate(config["model"], models)
    model = common.load_surrogate(config["model"], models, backend="keras").model
    seconds = {
        str(int(protocol["sample"])): seconds_of(protocol, trained, model, config)
        for protocol in progress(paper_rows("canonical_protocols"), "canonical protocols")
    }
    for sample, found in seconds.items():
        print(f"({sample}) " + "  ".join(f"{way} {value:.3g} s" for way, value in found.items()))
    return {"config": config, "backend": type(trained.network).__name__, "seconds": seconds}

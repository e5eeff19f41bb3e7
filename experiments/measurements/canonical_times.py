"""Seconds of solver and surrogate on the twelve canonical protocols of the paper's timing table.

The surrogate is timed in three ways, on one thread and after a first call: the plain Keras call (`model.predict`, as
most scripts do it), the predictor on one protocol, and the predictor on a batch, per trajectory. Times are processor
seconds of whole calls (`experiments.measurements.tools`), each the median of its repetitions.
"""

from pathlib import Path
from typing import Any

import numpy as np

from experiments.common import without_extrapolation_warnings
from experiments.measurements import tools
from experiments.measurements.cases import Case
from experiments.measurements.harness import progress, timed
from experiments.paper_numbers import paper_rows

KEYS = ("model", "modulus_ratio", "accuracy", "repetitions", "batch")
BATCHES = 3


def seconds_of(case: Case, ways: dict[str, tools.Predict], config: dict[str, Any]) -> dict[str, float]:
    """Seconds of one protocol: of the solver, and of each way to call the surrogate."""
    repetitions, batch = config["repetitions"], config["batch"]
    calls = {
        "solver": (lambda: tools.solver_at(config["accuracy"])(case), repetitions, 1),
        "keras_call": (lambda: ways["Keras call"]([case]), repetitions, 1),
        "predictor": (lambda: ways["ONNX"]([case]), repetitions, 1),
        "predictor_batch": (lambda: ways["ONNX"]([case] * batch), BATCHES, batch),
    }
    return {way: float(np.median(timed(call, count))) / share for way, (call, count, share) in calls.items()}


def study(config: dict[str, Any], models: Path) -> dict[str, Any]:
    """Time the twelve protocols."""
    ways, _ = tools.ways_to_call(config["model"], models)
    rows = [row | {"modulus_ratio": config["modulus_ratio"]} for row in paper_rows("canonical_protocols")]
    with without_extrapolation_warnings():
        seconds = {
            str(int(row["sample"])): seconds_of(Case.of(row), ways, config)
            for row in progress(rows, "canonical protocols")
        }
    return {"config": config, "seconds": seconds}

"""Seconds of solver and surrogate on the twelve canonical protocols of the paper's timing table.

The surrogate is timed in three ways, on one thread and after a first call: the plain Keras call (`model.predict`, as
most scripts do it), the predictor on one protocol, and the predictor on a batch, per trajectory. Times are processor
seconds of whole calls (`experiments.measurements.tools`), each the median of its repetitions.
"""

from functools import partial
from typing import Any

import numpy as np

from experiments.cases import Case
from experiments.common import Config, Models, without_extrapolation_warnings
from experiments.harness import progress, timed
from experiments.measurements import tools
from experiments.paper_numbers import paper_rows

BATCHES = 3


def study(config: Config, models: Models) -> dict[str, Any]:
    """Time the twelve protocols."""
    ways, _ = tools.ways_to_call(config["model"], models)
    rows = [row | {"modulus_ratio": config["modulus_ratio"]} for row in paper_rows("canonical_protocols")]
    solver, repetitions, batch = tools.solver_at(config["accuracy"]), config["repetitions"], config["batch"]
    seconds = {}
    for row in progress(rows, "canonical protocols"):
        case = Case.of(row)
        calls = {
            "solver": (partial(solver, case), repetitions, 1),
            "keras_call": (partial(ways["Keras call"], [case]), repetitions, 1),
            "predictor": (partial(ways["ONNX"], [case]), repetitions, 1),
            "predictor_batch": (partial(ways["ONNX"], [case] * batch), BATCHES, batch),
        }
        with without_extrapolation_warnings():
            spent = {way: np.median(timed(call, count)) / share for way, (call, count, share) in calls.items()}
        seconds[str(int(row["sample"]))] = spent
    return {"config": config, "seconds": seconds}

"""Seconds of solver and surrogate on the twelve canonical protocols, as published.

The surrogate is timed three ways, on one thread and warmed up: the plain Keras call (`model.predict`, as most scripts
do it), our predictor on one protocol, and our predictor on a batch, per trajectory. Our predictor is ONNX Runtime where
the model is exported. Processor seconds, each the median of its repetitions.

Usage: `python -m experiments canonical_times [--config FILE] [--models DIR] [--out FILE]`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from bem._support.command_line import run_main
from bem.dataset.measurement_steps import FMS, measurement_grid
from experiments import common
from experiments.timing import MEASUREMENTS, Busy, progress, publish, timed

if TYPE_CHECKING:
    import keras

    from surrogate.inference.predictor import Surrogate

CONFIG = common.CONFIGS / "canonical_times.toml"
OUT = MEASUREMENTS / "canonical_times.json"
WAYS = ("solver", "keras_call", "predictor", "predictor_batch")
BATCHES = 3


def median_seconds(call: Callable[[], Any], repetitions: int) -> float:
    """Median seconds of a call, after one that is not counted."""
    return float(np.median(timed(call, repetitions)))


def keras_inputs(trained: Surrogate, times: np.ndarray, indentations: np.ndarray, tabor: float) -> list[np.ndarray]:
    """The scaled arrays of one trajectory, (1, steps) in time and indentation, as the Keras model takes them."""
    from surrogate.data.features import channels, edge_from_counts

    physical = channels(times, indentations, edge_from_counts(FMS, 1), trained.scaling.features)
    return [trained.scaling.scale_channels(physical), trained.scaling.scale_tabor(np.array([tabor]))]


def seconds_of(
    protocol: dict[str, Any], trained: Surrogate, model: keras.Model, config: dict[str, Any]
) -> dict[str, float]:
    """Seconds of one protocol by all of `WAYS`.

    Args:
        protocol: A row of the paper's timing table.
        trained: Our predictor.
        model: The Keras model of the same weights.
        config: The measurement's configuration.
    """
    tabor, repetitions, batch = protocol["tabor"], config["repetitions"], config["batch"]
    times, indentations = measurement_grid(**{name: protocol[name] for name in common.QUANTITIES})
    steps = {"time": times[0], "indentation": indentations[0]}
    inputs = keras_inputs(trained, times, indentations, tabor)
    many = [np.repeat(values, batch, axis=0) for values in (times, indentations)]
    accuracy = {name: config[name] for name in ("modulus_ratio", "accuracy")}
    calls = {
        "solver": (lambda: common.simulated(protocol, **accuracy), repetitions, 1),
        "keras_call": (lambda: model.predict(inputs, verbose=0), repetitions, 1),
        "predictor": (lambda: common.predicted(trained, steps, FMS, tabor), repetitions, 1),
        "predictor_batch": (lambda: trained.predict(*many, tabor=tabor), BATCHES, batch),
    }
    return {way: median_seconds(call, count) / share for way, (call, count, share) in calls.items()}


def main(
    config: Annotated[Path, typer.Option(help="TOML file.")] = CONFIG,
    models: Annotated[Path, typer.Option(help="Where trained models are.")] = common.MODELS,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
    busy: Busy = False,
) -> None:
    """Time the twelve protocols."""
    settings = common.read_config(config, "model", "modulus_ratio", "accuracy", "repetitions", "batch")
    trained = common.load_surrogate(settings["model"], models)
    model = common.load_surrogate(settings["model"], models, backend="keras").model
    protocols = common.paper_protocols("canonical_protocols")
    seconds = {
        str(int(protocol["sample"])): seconds_of(protocol, trained, model, settings)
        for protocol in progress(protocols, "canonical protocols")
    }
    for sample, found in seconds.items():
        print(f"({sample}) " + "  ".join(f"{way} {value:.3g} s" for way, value in found.items()))
    backend = type(trained.backend).__name__
    content = {"config": settings, "backend": backend, "seconds": seconds}
    publish(out, "canonical_times", content, busy=busy)


if __name__ == "__main__":
    run_main(main)

"""Seconds of every published surrogate: plain Keras call, ONNX Runtime one at a time, ONNX Runtime in batches.

The plain call is `model.predict` on one trajectory, as most scripts do it, features included; the others are
`surrogate.load(...).predict`. One thread. What is not published is named, not replaced.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem.measurement import FMS, measurement_grid

if TYPE_CHECKING:
    from experiments.solver_sample import Case

KERAS_PROTOCOLS = 40
BATCH_REPEATS = 5


def published(models: Path) -> list[str]:
    """Names of the model directories with weights, in the order of the architectures."""
    from surrogate.architectures.naming import names

    return [name for name in names() if (models / name / "model.weights.h5").is_file()]


def missing(models: Path) -> list[str]:
    """Architectures that are not published."""
    from surrogate.architectures.naming import names

    found = published(models)
    return [name for name in names() if name not in found]


def histories(cases: list[Case]) -> dict[str, np.ndarray]:
    """Times and indentations (count, 120) and Tabor parameters (count,)."""
    quantities = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
    columns = {name: np.array([getattr(case.protocol, name) for case in cases]) for name in quantities}
    tabor = np.array([case.scene.tabor for case in cases])
    times, indentations = measurement_grid(tabor=tabor, **columns)
    return {"times": times, "indentations": indentations, "tabor": tabor}


def keras_call(trained: Any) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """`model.predict` on physical inputs, with features and scaling by hand."""
    from surrogate.features import channels, edge_from_counts

    def call(times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        edge = edge_from_counts(FMS, len(times))
        sequence = trained.scaling.scale_channels(channels(times, indentations, edge, trained.scaling.features))
        scaled = trained.model.predict([sequence, trained.scaling.scale_tabor(tabor)], verbose=0)
        return trained.scaling.unscale_force(np.asarray(scaled)[..., 0])

    return call


def one_at_a_time(
    predict: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray], inputs: dict[str, np.ndarray], repeats: int
) -> list[np.ndarray]:
    """Seconds (count,) of each repeat, after one call that is not counted."""
    times, indentations, tabor = inputs["times"], inputs["indentations"], inputs["tabor"]
    predict(times[:1], indentations[:1], tabor[:1])
    runs = []
    for _ in range(repeats):
        seconds = np.empty(len(times))
        for i in range(len(times)):
            started = time.perf_counter()
            predict(times[i : i + 1], indentations[i : i + 1], tabor[i : i + 1])
            seconds[i] = time.perf_counter() - started
        runs.append(seconds)
    return runs


def in_batches(predict: Callable, inputs: dict[str, np.ndarray], repeats: int, size: int = 1024) -> list[np.ndarray]:
    """Seconds per trajectory (count,) of each repeat, all equal: of a batch of `size`, repeating the protocols."""
    count = len(inputs["tabor"])
    chosen = np.arange(size) % count
    many = {name: values[chosen] for name, values in inputs.items()}
    predict(many["times"], many["indentations"], many["tabor"])
    runs = []
    for _ in range(repeats):
        started = time.perf_counter()
        predict(many["times"], many["indentations"], many["tabor"])
        runs.append(np.full(count, (time.perf_counter() - started) / size))
    return runs


def surrogate_tools(cases: list[Case], models: Path, repeats: int) -> tuple[list[dict[str, Any]], list[str]]:
    """Forces (count, 120) and seconds of every published model by every way that works, and what is missing."""
    names = published(models)
    absent = missing(models)
    if not names:
        return [], absent
    from surrogate.backend import limit_threads, quiet_backend

    quiet_backend()
    limit_threads(1)
    from surrogate.predictor import ExtrapolationWarning, Surrogate

    inputs = histories(cases)
    few = {key: values[:KERAS_PROTOCOLS] for key, values in inputs.items()}
    tools = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        for name in names:
            trained = Surrogate.load(name, models, backend="keras")
            force = trained.predict(inputs["times"], inputs["indentations"], tabor=inputs["tabor"])
            call = one_at_a_time(keras_call(trained), few, 1)
            medians = [np.full(len(cases), np.median(seconds)) for seconds in call]
            common = {"model": name, "parameters": trained.model.count_params(), "force": force}
            tools.append({**common, "setting": f"{name}, Keras call", "way": "Keras call", "seconds": medians})
            if not (models / name / "model.onnx").is_file():
                absent.append(f"{name}/model.onnx")
                continue
            light = Surrogate.load(name, models)

            def predict(t: np.ndarray, d: np.ndarray, mu: np.ndarray, light: Any = light) -> np.ndarray:
                return light.predict(t, d, tabor=mu)

            common["force"] = predict(inputs["times"], inputs["indentations"], inputs["tabor"])
            single, batch = one_at_a_time(predict, inputs, repeats), in_batches(predict, inputs, BATCH_REPEATS)
            tools.append({**common, "setting": f"{name}, ONNX single", "way": "ONNX single", "seconds": single})
            tools.append({**common, "setting": f"{name}, ONNX batch", "way": "ONNX batch", "seconds": batch})
    return tools, absent

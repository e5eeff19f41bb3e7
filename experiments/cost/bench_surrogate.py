"""What a prediction costs on one core: every way to call a model, against Keras's own `model.predict`.

`python -m experiments bench_surrogate` measures the start, single predictions and batches. With `--stream` it measures
the steps of a stream, a million of them. `make docs-control` writes the published numbers into the guide. Times are
wall seconds of one thread. The slowest calls are due to other programs on the core; for single predictions and batches,
processor seconds are therefore given too.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.provenance import versions
from bem._support.wording import markdown_table
from bem.dataset.designs import Design
from bem.dataset.measurement_steps import FMS, measurement_grid
from experiments.cost.surrogate_cost import scaled_inputs
from experiments.timing import CLOCK, MEASUREMENTS, Busy, in_fresh_process, publish

PREDICTIONS, STREAM = MEASUREMENTS / "surrogate_latency.json", MEASUREMENTS / "stream_latency.json"
BATCH = 1024
STEPS = 1_000_000
STREAM_HISTORY = sum(FMS)
EDGES = (FMS[0] - 1, FMS[0] + FMS[1] - 1)
"""Indices of the measurement steps at which the dwell starts and ends."""


def measure_predictions(name: str, models: Path | None, repeats: int) -> dict[str, Any]:
    """Seconds per trajectory of each way to call a model, seconds of a cold start, and the agreement of the ways."""
    import surrogate
    from surrogate.inference.predictor import ExtrapolationWarning

    warnings.simplefilter("ignore", ExtrapolationWarning)
    quick, keras = (surrogate.load(name, models, backend=backend) for backend in ("onnx", "keras"))
    tabor, times, indentations = _protocols(BATCH)
    one = slice(0, 1)
    scaled = scaled_inputs(keras, times, indentations, tabor)

    def ask(model: Any, rows: slice) -> Callable[[], Any]:
        return lambda: model.predict(times[rows], indentations[rows], tabor=tabor[rows])

    everything = slice(None)
    ways = {
        "Keras model.predict, one": (lambda: keras.model.predict([part[one] for part in scaled], verbose=0), 1, 20),
        "Keras, one": (ask(keras, one), 1, 20),
        "ONNX, one": (ask(quick, one), 1, repeats),
        f"Keras, batch of {BATCH}": (ask(keras, everything), BATCH, 2),
        f"ONNX, batch of {BATCH}": (ask(quick, everything), BATCH, 5),
    }
    rows = [{"way": way, **_seconds(call, count, times_)} for way, (call, count, times_) in ways.items()]
    reference = rows[0]["median"]
    force = quick.predict(times, indentations, tabor=tabor)
    same = keras.predict(times, indentations, tabor=tabor)
    difference = np.abs(quick.scaling.scale_force(force) - quick.scaling.scale_force(same)).max()
    return {
        "model": quick.name,
        "rows": [row | {"times_faster_than_model_predict": reference / row["median"]} for row in rows],
        "start_seconds": _start_seconds(name, models),
        "largest_difference_of_scaled_force": float(difference),
        "versions": _versions(),
    }


def measure_stream(name: str, models: Path | None, steps: int) -> dict[str, Any]:
    """Microseconds of the steps of a stream, each timed separately, along trajectories of 120 steps."""
    import surrogate

    tabor, times, indentations = _protocols(1)
    stream = surrogate.load(name, models).stream(tabor=float(tabor[0]))
    history = list(zip(times[0].tolist(), indentations[0].tolist(), strict=True))
    spent = np.empty(steps, dtype=np.int64)
    clock = time.perf_counter_ns
    with CLOCK:
        for index in range(steps):
            at = index % STREAM_HISTORY
            if at == 0:
                stream.reset()
            instant, depth = history[at]
            started = clock()
            stream.step(instant, depth, at in EDGES)
            spent[index] = clock() - started
    microseconds = spent / 1e3
    percentiles = {"median": 50.0, "p99": 99.0, "p99_9": 99.9, "worst": 100.0}
    return {
        "model": stream.name,
        "steps": steps,
        "microseconds": {key: float(np.percentile(microseconds, value)) for key, value in percentiles.items()},
        "share_above_50_microseconds": float((microseconds > 50.0).mean()),
        "versions": _versions(),
    }


def prediction_table(content: dict[str, Any]) -> str:
    """The measured times as a Markdown table, with the start and the agreement in a sentence."""
    header = ["way", "ms per trajectory", "processor time (ms)", "times faster than model.predict"]
    cells = []
    for row in content["rows"]:
        milliseconds = [f"{1e3 * row[name]:.3f}" for name in ("median", "processor")]
        cells.append([row["way"], *milliseconds, f"{row['times_faster_than_model_predict']:.1f}"])
    return (
        f"{content['model']}, on one core\n\n{markdown_table(header, cells, 'lrrr')}\n\n"
        f"Start to first prediction: {content['start_seconds']:.2f} s. Largest difference of the scaled force between "
        f"Keras and ONNX: {content['largest_difference_of_scaled_force']:.1e}."
    )


def stream_table(content: dict[str, Any]) -> str:
    """The measured times as a sentence."""
    values = content["microseconds"]
    return (
        f"{content['model']}, {content['steps']:,} steps: median {values['median']:.1f} µs, "
        f"99th percentile {values['p99']:.1f} µs, 99.9th {values['p99_9']:.1f} µs, worst {values['worst']:.0f} µs; "
        f"{100 * content['share_above_50_microseconds']:.2f} % took more than 50 µs."
    )


def _protocols(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    columns = Design("log-uniform").protocols(count, seed=1)
    times, indentations = measurement_grid(**columns)
    return columns["tabor"], times, indentations


def _seconds(call: Callable[[], Any], count: int, repeats: int) -> dict[str, float]:
    call()
    wall, processor = [], []
    for _ in range(repeats):
        with CLOCK:
            call()
        wall.append(CLOCK.wall / count)
        processor.append(CLOCK.seconds / count)
    return {"median": float(np.median(wall)), "best": float(min(wall)), "processor": float(np.median(processor))}


def _start_seconds(name: str, models: Path | None) -> float:
    """Seconds from the first line of a new interpreter to the first prediction; the least of five runs."""
    root = str(models) if models else None
    code = (
        "import time; started = time.perf_counter()\n"
        "import numpy, warnings, surrogate\n"
        "warnings.simplefilter('ignore')\n"
        f"model = surrogate.load({name!r}, {root!r})\n"
        "times = numpy.linspace(0.0, 3.0, 120)[None]\n"
        "model.predict(times, numpy.minimum(5.0 * times, 10.0), tabor=1.0)\n"
        "print(time.perf_counter() - started)"
    )
    return min(in_fresh_process(code, PYTHONPATH=str(Path.cwd()))[0] for _ in range(5))


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return versions() | {name: version(name) for name in ("onnxruntime", "keras")}


def main(
    model: Annotated[str, typer.Option(help="A published model or a model directory.")] = "M1-concat",
    models: Annotated[Path | None, typer.Option(help="Folder of published models.")] = None,
    stream: Annotated[bool, typer.Option("--stream", help="Measure steps of a stream instead.")] = False,
    steps: Annotated[int, typer.Option(help="Steps of the stream.")] = STEPS,
    repeats: Annotated[int, typer.Option(help="Single predictions.")] = 200,
    out: Annotated[Path | None, typer.Option(help="Result file to write.")] = None,
    busy: Busy = False,
) -> None:
    """Measure, print a table and write the numbers."""
    from surrogate.backend import limit_threads

    limit_threads(1)
    if stream:
        content = measure_stream(model, models, steps)
        print(stream_table(content))
        study = f"bench_surrogate --stream --model {model} --steps {steps}"
        publish(out or STREAM, study, content, busy=busy)
    else:
        content = measure_predictions(model, models, repeats)
        print(prediction_table(content))
        publish(out or PREDICTIONS, f"bench_surrogate --model {model} --repeats {repeats}", content, busy=busy)

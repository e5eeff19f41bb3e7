"""Latencies: a tick of a control loop, a step of a stream, and the start of a process that predicts.

Ticks are those of `bem.Contact`, advanced by a thousandth of a retardation time: each random protocol of the paper's
box is followed from its start, or, where it is long, in `LONGEST` ticks from a random instant that one step reaches.
The mesh has room for the peak from the start. Their times are processor seconds.

Steps are those of a surrogate's stream, a million of them. Their times are wall seconds of one thread; the slowest are
due to other programs on the core. What a prediction costs is measured by `experiments.measurements.accuracy_cost`.
`make docs-numbers` writes the numbers into the guide.
"""

import time
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem import Contact
from bem._support.provenance import versions
from experiments.common import MODULUS_RATIO, scenes
from experiments.measurements.cases import Case, Hidden, drawn, rows_of
from experiments.measurements.harness import CLOCK, Count, Seed, in_fresh_process, progress
from experiments.measurements.tools import points_of

TICK, LONGEST = 1e-3, 3000
LEVELS = (50.0, 99.0, 99.9)
PERCENTILES = {"median": 50.0, "p99": 99.0, "p99_9": 99.9, "worst": 100.0}
START = """
import time; started = time.perf_counter()
import sys, warnings, numpy, bem, surrogate
warnings.simplefilter("ignore")
model = surrogate.load(sys.argv[1], sys.argv[2] or None)
times = numpy.linspace(0.0, 3.0, 120)[None]
scene = bem.Scene(1.0, bem.StandardLinearSolid(0.1))
model.predict_history(times, numpy.minimum(5.0 * times, 10.0), scene)
print(time.perf_counter() - started)
"""
"""A new interpreter from its first line to its first prediction."""


def ticks(case: Case, generator: np.random.Generator) -> list[float]:
    """Processor seconds of the ticks of one protocol."""
    history, end = case.protocol.history(case.scene.tabor), 0.0
    contact = Contact(case.scene, deepest=case.protocol.peak_indentation)
    count = int(history.times[-1] / TICK)
    if count > LONGEST:
        end = TICK * int(generator.integers(1, count - LONGEST + 1))
        contact.advance(end, indentation=float(history.indentation_at(end)))
    spent = []
    for number in range(1, min(count, LONGEST) + 1):
        depth = float(history.indentation_at(end + number * TICK))
        with CLOCK:
            contact.advance(TICK, indentation=depth)
        spent.append(CLOCK.seconds)
    return spent


def ticks_text(contact_ticks: Any) -> str:
    """The measurement as a sentence, for docs/simulate.md."""
    each = {name: 1e3 * value for name, value in contact_ticks["seconds"].items()}
    return (
        f"A step of {TICK:g} retardation times takes {each['50']:.2f} ms (median; 99th percentile {each['99']:.2f} ms, "
        f"99.9th {each['99.9']:.2f} ms) in {contact_ticks['count']:,} steps over the paper's box; "
        f"{100.0 * contact_ticks['below_a_millisecond']:.2f} % take less than 1 ms. Measured on one core of "
        f"{contact_ticks['host']}."
    )


def study_contact_ticks(*, count: Count = 40, seed: Seed = 5) -> dict[str, Any]:
    """How long a tick of 1 ms of `bem.Contact` takes, over random protocols."""
    generator = np.random.default_rng(seed)
    cases = [Case.of(row) for row in rows_of(drawn("inside", count, seed))]
    spent = np.concatenate([ticks(case, generator) for case in progress(cases, "protocols")])
    found = {f"{level:g}": float(np.percentile(spent, level)) for level in LEVELS}
    below = float(np.mean(spent < 1e-3))
    return {"count": spent.size, "seconds": found, "largest": float(spent.max()), "below_a_millisecond": below}


def step_microseconds(name: str, models: Path | None, steps: int) -> np.ndarray:
    """Microseconds of the steps of a stream, each timed separately, along the steps of its training; shape (steps,)."""
    import surrogate

    hidden = Hidden.draw(1, MODULUS_RATIO, seed=1)
    (points,) = points_of(name, hidden)
    stream = surrogate.load(name, models).stream(scenes(hidden.quantities["tabor"])[0])
    spent = np.empty(steps, dtype=np.int64)
    clock = time.perf_counter_ns
    with CLOCK:
        for index in range(steps):
            at = index % len(points)
            if at == 0:
                stream.reset()
            point = points[at]
            started = clock()
            stream.step(*point)
            spent[index] = clock() - started
    return spent / 1e3


def stream_text(stream_latency: Any) -> str:
    """The measured times as sentences."""
    values = stream_latency["microseconds"]
    start, host = stream_latency.get("start_seconds"), stream_latency.get("host")
    return (
        f"{stream_latency['model']}, {stream_latency['steps']:,} steps: median {values['median']:.1f} µs, "
        f"99th percentile {values['p99']:.1f} µs, 99.9th {values['p99_9']:.1f} µs, worst {values['worst']:.0f} µs; "
        f"{100 * stream_latency['share_above_50_microseconds']:.2f} % took more than 50 µs."
        + (f" Start to first prediction: {start:.2f} s." if start else "")
        + (f"\n\nMeasured on one core of {host}." if host else "")
    )


def study_stream_latency(
    *,
    model: Annotated[str, typer.Option(help="A published model or a model directory.")] = "M1-concat",
    models: Annotated[Path | None, typer.Option(help="Folder of published models.")] = None,
    steps: Annotated[int, typer.Option(help="Steps of the stream.")] = 1_000_000,
) -> dict[str, Any]:
    """How long a step of a stream of predictions takes, and its start."""
    spent = step_microseconds(model, models, steps)
    starts = [in_fresh_process(START, model, models or "", PYTHONPATH=str(Path.cwd()))[0] for _ in range(5)]
    return {
        "model": model,
        "steps": steps,
        "microseconds": {name: float(np.percentile(spent, percent)) for name, percent in PERCENTILES.items()},
        "share_above_50_microseconds": float((spent > 50.0).mean()),
        "start_seconds": min(starts),
        "versions": versions() | {"onnxruntime": version("onnxruntime")},
    }

"""What a step of our stream costs beside a step of an ONNX Runtime session that keeps the state of the network.

The stream is measured as a control loop calls it: checks, features, scaling and network. One session does the same work
without the checks (`whole`). Others have the network alone: they are given scaled channels and return the scaled force,
so that they do less than the stream (`network`, `plain`). All are called from Python on one thread; a session that
computes nothing shows the share of the call (`empty`). Memory is bound, except in `plain`. `make measure-streaming`
measures, `make docs-control` writes the table into docs/network.md. Times are processor microseconds; the ways take
turns, history by history.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.provenance import versions
from bem._support.wording import markdown_table
from bem.dataset.designs import Design
from bem.dataset.measurement_steps import FMS, PHYSICAL, measurement_grid
from bem.dataset.physical_steps import physical_grid
from experiments.common import without_extrapolation_warnings
from experiments.surrogates.one_step_model import INDENTATION, TIME, Solid, empty_model, step_model
from experiments.surrogates.stateful_session import StatefulSession
from experiments.timing import CLOCK, MEASUREMENTS, Busy, publish
from surrogate.pretrained.model import NAMES

OUT = MEASUREMENTS / "streaming_cost.json"
MODELS = ("M1-concat", "M3-concat", "fast", "accurate")
BLOCKS = 100
MODULUS_RATIO = 0.1
AGREEMENT = 1e-5
"""Largest difference of stream and session that is rounding, as a share of the history's force range."""
NOTICED = 2.0
"""Least factor that counts as a gain in a control loop."""
Walk = Callable[[], list[float]]


def compared(name: str, models: Path | None, blocks: int) -> dict[str, Any]:
    """Microseconds of a step of one model in each way, and the difference of the forces.

    Raises:
        RuntimeError: the forces of stream and session differ by more than rounding.
    """
    ways, difference = walks(name, models)
    if not difference <= AGREEMENT:
        raise RuntimeError(
            f"Expected forces of stream and session that agree to {AGREEMENT:g} of their range. Received: {name}, "
            f"which differs by {difference:.1e}"
        )
    spent: dict[str, list[float]] = {way: [] for way in ways}
    for _ in range(blocks):
        for way, walk in ways.items():
            with CLOCK:
                steps = len(walk())
            spent[way].append(1e6 * CLOCK.seconds / steps)
    medians = {way: float(np.median(values)) for way, values in spent.items()}
    return {
        "model": name,
        "microseconds": medians,
        "spread": {way: np.percentile(values, [10.0, 90.0]) for way, values in spent.items()},
        "factor": medians["whole"] / medians["stream"],
        "network_factor": min(medians["network"], medians["plain"]) / medians["stream"],
        "largest_difference": difference,
    }


def walks(name: str, models: Path | None) -> tuple[dict[str, Walk], float]:
    """Functions that take all steps of one history, and the largest difference of their forces.

    The ways are those of the module. The difference is a share of the range of the force.
    """
    import surrogate
    from surrogate.data.features import channels, edge_from_counts
    from surrogate.pretrained.network import graph_of

    protocol = Design("log-uniform").protocols(1, seed=1)
    tabor = float(protocol["tabor"][0])
    model: Any = surrogate.load(name) if name in NAMES else surrogate.load(name, models)
    if name in NAMES:
        solid = Solid(tabor, MODULUS_RATIO)
        graph, counts = graph_of(model.folder / "model.onnx"), PHYSICAL
        times, indentations = physical_grid(**protocol, modulus_ratio=MODULUS_RATIO)
    else:
        solid = Solid(tabor)
        graph, counts = model.backend.graph(), FMS
        times, indentations = measurement_grid(**protocol)
    scaling, edge = model.scaling, edge_from_counts(counts, 1)
    physical = channels(
        times, indentations, edge, scaling.features, tabor=protocol["tabor"], modulus_ratio=MODULUS_RATIO
    )
    scaled = scaling.scale_channels(physical)[0]
    told = np.repeat(scaling.scale_tabor(protocol["tabor"]), len(scaled), axis=0)
    rows = list(np.hstack([scaled, told])[:, None, None])
    raw = list(np.stack([times[0], indentations[0], edge[0]], axis=-1)[:, None, None])
    start = {TIME: -1.0, INDENTATION: float(indentations[0, 0])}
    alone, complete = (step_model(graph, scaling, solid, features=features) for features in (False, True))
    given = {} if solid.modulus_ratio is None else {"modulus_ratio": solid.modulus_ratio}
    with without_extrapolation_warnings():
        stream = model.stream(tabor=tabor, **given)
    points = list(zip(times[0].tolist(), indentations[0].tolist(), (edge[0] == 1.0).tolist(), strict=True))

    def streamed() -> list[float]:
        stream.reset()
        return [stream.step(*point) for point in points]

    ways = {
        "stream": streamed,
        "whole": _walk(StatefulSession(complete, bound=True, initial=start), raw),
        "network": _walk(StatefulSession(alone, bound=True), rows),
        "plain": _walk(StatefulSession(alone, bound=False), rows),
        "empty": _walk(StatefulSession(empty_model(rows[0].size), bound=True), rows),
    }
    expected = np.array(streamed())
    found = [np.array(ways["whole"]()), *(scaling.unscale_force(np.array(ways[way]())) for way in ("network", "plain"))]
    difference = float(max(np.abs(force - expected).max() for force in found) / np.ptp(expected))
    return ways, difference


def _walk(session: StatefulSession, points: list[np.ndarray]) -> Walk:
    """Function that takes all steps; a session of fewer inputs is not told the Tabor parameter, which comes last."""
    rows = [np.ascontiguousarray(point[..., : session.width]) for point in points]

    def walk() -> list[float]:
        session.reset()
        return [session.step(row) for row in rows]

    return walk


def page_text(content: dict[str, Any]) -> str:
    """The measurement as a Markdown table, and sentences that say for which models the stream wins."""
    header = ["Model", "Stream (µs)", "Session, whole step (µs)", "Over stream", "Session, network alone (µs)"]
    header += ["Over stream", "The same, memory not bound (µs)", "Session, nothing (µs)", "Difference"]
    cells = []
    for row in content["models"]:
        spent = {way: f"{value:.1f}" for way, value in row["microseconds"].items()}
        factors = [f"{row[name]:.1f}" for name in ("factor", "network_factor")]
        compared = [spent["stream"], spent["whole"], factors[0], spent["network"], factors[1]]
        cells.append([row["model"], *compared, spent["plain"], spent["empty"], f"{row['largest_difference']:.0e}"])
    verdicts = [
        _verdict(content, "factor", "the whole step"),
        _verdict(content, "network_factor", "the network alone"),
    ]
    return (
        f"{markdown_table(header, cells, 'lrrrrrrrr')}\n\nA factor of {NOTICED:g} is taken as one that a control loop "
        f"notices. {' '.join(verdicts)} Processor time of one step, medians of {content['blocks']} histories; largest "
        f"difference of the forces as a share of their range. ONNX Runtime {content['versions']['onnxruntime']}; "
        f"measured by `{content['command']}` on one core of {content['host']}; the process had "
        f"{100 * content['processor_share']:.0f} % of its core."
    )


def _verdict(content: dict[str, Any], key: str, work: str) -> str:
    """Which models the stream computes faster than the session by a factor that is noticed, and which not."""
    lists = {True: [], False: []}
    for row in content["models"]:
        lists[row[key] >= NOTICED].append(row["model"])
    won, others = (", ".join(lists[wins]) or "no model" for wins in (True, False))
    return f"Against {work}, the stream reaches it for {won}; it does not for {others}."


def main(
    model: Annotated[list[str] | None, typer.Option(help="A model; give it once for each.")] = None,
    models: Annotated[Path | None, typer.Option(help="Folder of published models.")] = None,
    blocks: Annotated[int, typer.Option(help="Histories in each way.")] = BLOCKS,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
    busy: Busy = False,
) -> None:
    """Compare, print the table and write the numbers."""
    from importlib.metadata import version

    from surrogate.backend import limit_threads

    limit_threads(1)
    rows = [compared(name, models, blocks) for name in model or MODELS]
    for row in rows:
        spent = ", ".join(f"{way} {value:.1f}" for way, value in row["microseconds"].items())
        print(f"{row['model']}: {spent} us; differs by {row['largest_difference']:.1e}")
    named = "".join(f" --model {name}" for name in model or ())
    content = {"blocks": blocks, "models": rows, "versions": versions() | {"onnxruntime": version("onnxruntime")}}
    publish(out, f"streaming_cost{named} --blocks {blocks}", content, busy=busy)

"""Results, intervals and bands of a model with bands as operations of an ONNX graph, in double precision.

They are those of `surrogate.prediction.bands`, whose compiled functions do the same for one prediction in a fraction of
the time, and have the names of `PredictedTrajectory`. Protocols are read off the measurement steps.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import onnx
from onnx import TensorProto, numpy_helper

from bem.dataset.designs import OUTERMOST
from bem.protocol import default_start_indentation
from surrogate.data.scaling import Scaling
from surrogate.export.channels import RATIO, scaled_channels
from surrogate.export.onnx import HISTORY, MATRIX, complete, unscaled
from surrogate.export.onnx_file import PRETRAINED_FORMAT
from surrogate.export.onnx_graph import OnnxGraph, Value
from surrogate.prediction.bands import BANDS, CORNERS, FACTORS, GROUPS, KNOWN, LEAST, NEARLY_ELASTIC, RESULTS, Bands
from surrogate.prediction.predictor import Surrogate
from surrogate.prediction.validity import RANGE_TOLERANCE, START_TOLERANCE

COVERAGE = 0.9
"""Share of true values that intervals and bands of a graph are to contain."""
_BOTH = np.array([[-1.0, 1.0]])


def banded_content(model: Surrogate) -> bytes:
    """Return one ONNX file of a model with bands: features, scaling and bands around its network; without Keras.

    `surrogate.export.onnx` describes the file.

    Raises:
        ValueError: the model has no bands.
    """
    if model.bands is None:
        raise ValueError(f"Expected a model with bands, fast or accurate. Received: {model.name}")
    network = onnx.load_model_from_string(model.network.content()).graph
    inner, graph, steps = onnx.compose.add_prefix_graph(network, "network/"), OnnxGraph(), ["batch", sum(model.counts)]
    channels = scaled_channels(graph, model.scaling, with_tabor=True)
    graph.add("Transpose", channels, perm=[1, 0, 2], output="network/inputs")
    graph.nodes.extend(inner.node)
    graph.initializers |= {item.name: numpy_helper.to_array(item) for item in inner.initializer}
    scaled = unscaled(graph, graph.named("network/force").turned(1, 0), model.scaling)
    outputs = {"force": steps} | add_bands(graph, scaled, model.bands, model.scaling, model.counts)
    inputs = {key: steps if shape == MATRIX else shape for key, shape in HISTORY.items()} | {RATIO: ["batch"]}
    more = {"counts": json.dumps(model.counts), "coverage": str(COVERAGE)}
    return complete(graph, inputs, outputs, PRETRAINED_FORMAT, model.name, model.scaling, more)


def add_bands(
    graph: OnnxGraph, scaled: Value, bands: Bands, scaling: Scaling, counts: Sequence[int]
) -> dict[str, list[str | int]]:
    """Add all outputs but the force.

    Args:
        graph: The graph, with the inputs of models of set F and the output `force`.
        scaled: The scaled force, float64 of shape `(batch, steps)`.
        bands: What is known of the errors.
        scaling: The scaling of the force, and the ranges outside of which bands are infinite.
        counts: Points of loading, dwell and unloading.

    Returns:
        The shapes of the outputs by name.
    """
    loading, turn, steps = counts[0], counts[0] + counts[1] - 1, sum(counts)
    times, indentations, force = (graph.named(name) for name in ("times", "indentations", "force"))
    begin = times.pick(turn)
    pull_off, instant, sharpness = _pull_off(graph, times.columns(turn), force.columns(turn), steps - turn)
    works = [
        _work(graph, *(one.columns(first, stop) for one in (times, indentations, force)))
        for first, stop in ((0, loading), (turn, steps))
    ]
    hysteresis = graph.add("Abs", works[0] + works[1])
    instants, levels = (one.pick(0, loading - 1, turn, steps - 1) for one in (times, indentations))
    durations = instants.rise()
    rates = levels.rise() / durations
    tabor, ratio = (graph.named(name).expand(1) for name in ("tabor", RATIO))
    # In the order of `KNOWN`.
    protocol = (tabor, levels.pick(1), rates.pick(0), durations.pick(1), -rates.pick(2), ratio)
    known = graph.add("Concat", *protocol, axis=1)
    half, group = _half_widths(graph, graph.add("Concat", known, sharpness, axis=1), bands)
    outside = _outside(graph, known, levels.pick(0), scaling)
    pull_off_width, time_width, hysteresis_width, *widths = (half.pick(row) for row in range(len(RESULTS + BANDS)))
    unit = graph.add("Max", hysteresis, 0.01 * graph.add("Abs", works[0]), 1e-300)
    found = {
        "pull_off_force": (pull_off, pull_off * graph.add("Exp", _BOTH * pull_off_width)),
        "pull_off_time": (instant, begin + (instant - begin) * graph.add("Exp", _BOTH * time_width)),
        "hysteresis": (hysteresis, graph.add("Max", hysteresis + _BOTH * (hysteresis_width * unit), 0.0)),
    }
    shapes: dict[str, list[str | int]] = {}
    for result, (name, (value, interval)) in zip(RESULTS, found.items(), strict=True):
        graph.add("Where", outside, _BOTH * np.inf, interval, output=f"{result}_interval")
        graph.add("Squeeze", value, [1], output=name)
        shapes |= {name: ["batch"], f"{result}_interval": ["batch", 2]}
    shape = graph.add("Gather", bands.shape, group.pick(len(RESULTS)).squeeze(1), axis=0)
    mean, deviation = scaling.force
    for name, width in zip(BANDS, widths, strict=True):
        distance = graph.add("Where", outside, np.array(np.inf), width) * shape
        graph.symexp((scaled - distance) * deviation + mean, f"{name}_lower")
        graph.symexp((scaled + distance) * deviation + mean, f"{name}_upper")
        shapes |= {f"{name}_{end}": ["batch", steps] for end in ("lower", "upper")}
    return shapes


def _pull_off(graph: OnnxGraph, times: Value, force: Value, count: int) -> tuple[Value, Value, Value]:
    """Pull-off force, its time and sharpness, each (batch, 1), of an unloading, as of `bands.results`."""
    top = graph.add("ArgMax", force, axis=1)
    middle = graph.add("Min", graph.add("Max", top, [1]), [count - 2])
    places = graph.add("Concat", middle - 1, middle, middle + 1, axis=1)
    values, moments = (graph.add("GatherElements", one, places, axis=1) for one in (force, times))
    durations = moments.rise()
    slopes = values.rise() / durations
    bend = slopes.rise() / graph.add("ReduceSum", durations, [1])
    slope = slopes.pick(0) + bend * durations.pick(0)
    inside = graph.add("Equal", middle, top)
    smooth = inside & (bend < 0.0)
    shift = graph.add("Where", smooth, slope / bend, 0.0)
    highest, instant = (graph.add("GatherElements", one, top, axis=1) for one in (force, times))
    lower = graph.add("Max", values.pick(0), values.pick(2)) / graph.add("Max", highest, 1e-300)
    return highest - 0.25 * slope * shift, instant - 0.5 * shift, graph.add("Where", inside, 1.0 - lower, 0.0)


def _work(graph: OnnxGraph, times: Value, indentations: Value, force: Value) -> Value:
    """Integral of -P d(indentation) over a phase, by the monotone cubics of `bem._support.monotone`, (batch, 1)."""
    width, ends = times.rise(), [0, -1]
    chord = force.rise() / width
    before, after = (width.columns(*part) for part in ((0, -1), (1, None)))
    left, right = (chord.columns(*part) for part in ((0, -1), (1, None)))
    weight, next_weight = 2.0 * after + before, after + 2.0 * before
    mean = (weight + next_weight) / (weight / left + next_weight / right)
    inner = graph.add("Where", left * right > 0.0, mean, 0.0)
    near, far, chord_end, chord_next = (
        one.pick(*ends) for one in (width, width.columns(1, -1), chord, chord.columns(1, -1))
    )
    slope = ((2.0 * near + far) * chord_end - near * chord_next) / (near + far)
    steep = graph.add("Abs", slope) > 3.0 * graph.add("Abs", chord_end)
    limited = graph.add("Where", (chord_end * chord_next > 0.0) | graph.add("Not", steep), slope, 3.0 * chord_end)
    outer = graph.add("Where", slope * chord_end > 0.0, limited, 0.0)
    slopes = graph.add("Concat", outer.pick(0), inner, outer.pick(1), axis=1)
    halves = force.columns(0, -1) + 0.5 * force.rise()
    area = graph.add("ReduceSum", width * (halves - width * slopes.rise() / 12.0), [1])
    travel, duration = (one.pick(*ends).rise() for one in (indentations, times))
    return -(area * travel / duration)


def _half_widths(graph: OnnxGraph, known: Value, bands: Bands) -> tuple[Value, Value]:
    """Half-widths of `RESULTS` and `BANDS`, and their groups, each (batch, 5), as of `Bands.widths`."""
    low, high = np.log(bands.ranges).T
    logarithms = graph.add("Log", graph.add("Max", known, LEAST))
    quantities = logarithms.columns(0, len(KNOWN))
    places = (2.0 * quantities - (low + high)) / (high - low)
    places = graph.add("Max", graph.add("Min", places, 1.0), -1.0)
    sharp = 1.0 + logarithms.pick(len(KNOWN)) / 4.0
    one = sharp.pick(0) * 0.0 + 1.0
    factors = graph.add("Concat", one, places, sharp, axis=1)
    first, second, third = (factors.pick(*row) for row in FACTORS.tolist())
    size = graph.add("MatMul", first * second * third, bands.coefficients.T)
    below = (size.expand(2) > bands.edges).cast(TensorProto.INT64)
    group = graph.add("ReduceSum", below, [2], keepdims=0)
    bits = (places > 0.0).cast(TensorProto.INT64) * [1 << bit for bit in range(len(KNOWN))]
    least = graph.add("ReduceMin", graph.add("Abs", places), axes=[1])
    corner = graph.add("ReduceSum", bits, [1])
    cell = graph.add("Where", least > 1.0 - 2.0 * OUTERMOST - 1e-9, corner, group + CORNERS)
    for number, ratio in enumerate(NEARLY_ELASTIC):
        cell = graph.add("Where", known.pick(KNOWN.index("modulus_ratio")) < ratio, cell, CORNERS + GROUPS + number)
    table = bands.quantiles_at(COVERAGE)
    kinds, cells = table.shape
    rows = cell + [cells * kind for kind in range(kinds)]
    return graph.add("Exp", size) * graph.add("Gather", table.ravel(), rows), group


def _outside(graph: OnnxGraph, known: Value, start: Value, scaling: Scaling) -> Value:
    """Whether a quantity or the start lies outside the ranges, as of `surrogate.prediction.validity`, (batch, 1)."""
    low, high = np.array([scaling.ranges[name] for name in KNOWN]).T
    share = start / (default_start_indentation(1.0) * graph.named("tabor").expand(1))
    values = graph.add("Concat", known, share, axis=1)
    low, high = np.append(low, 1.0 - START_TOLERANCE), np.append(high, 1.0 + START_TOLERANCE)
    beyond = (values < low * (1.0 - RANGE_TOLERANCE)) | (values > high * (1.0 + RANGE_TOLERANCE))
    return graph.add("ReduceMax", beyond.cast(TensorProto.FLOAT), axes=[1]).cast(TensorProto.BOOL)

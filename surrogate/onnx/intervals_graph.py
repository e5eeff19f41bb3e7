"""Results, intervals and bands of a model with bands as operations of an ONNX graph, in double precision.

They are those of `surrogate.intervals`, whose compiled functions do the same for one prediction in a fraction of
the time, and have the names of `PredictedTrajectory`. Protocols are read off the measurement steps.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import onnx
from onnx import TensorProto, numpy_helper

from bem.dataset.designs import OUTERMOST
from bem.problem.protocol import default_start_indentation
from surrogate.data.scaling import Scaling
from surrogate.intervals import BANDS, CORNERS, FACTORS, GROUPS, KNOWN, LEAST, NEARLY_ELASTIC, RESULTS, Bands
from surrogate.model import Surrogate
from surrogate.onnx.export import HISTORY, MATRIX, RATIO, complete, scaled_channels, unscaled
from surrogate.onnx.file import PRETRAINED_FORMAT
from surrogate.onnx.graph import OnnxGraph, Value
from surrogate.validity import RANGE_TOLERANCE, START_TOLERANCE

COVERAGE = 0.9
"""Share of true values that intervals and bands of a graph are to contain."""
_BOTH = np.array([[-1.0, 1.0]])


def banded_content(model: Surrogate) -> bytes:
    """Return one ONNX file of a model with bands: features, scaling and bands around its network; without Keras.

    `surrogate.onnx.export` describes the file.

    Raises:
        ValueError: the model has no bands.
    """
    if model.bands is None:
        raise ValueError(f"the model must have bands, as fast and accurate; received {model.name}")
    network = onnx.load_model_from_string(model.network.content()).graph
    inner, graph, steps = onnx.compose.add_prefix_graph(network, "network/"), OnnxGraph(), ["batch", sum(model.counts)]
    scaled_channels(graph, model.scaling, with_tabor=True).to("Transpose", perm=[1, 0, 2], output="network/inputs")
    graph.nodes.extend(inner.node)
    graph.initializers |= {item.name: numpy_helper.to_array(item) for item in inner.initializer}
    scaled = unscaled(graph.named("network/force").turned(1, 0), model.scaling)
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
    pull_off, instant, sharpness = _pull_off(times.columns(turn), force.columns(turn), steps - turn)
    works = [
        _work(*(history.columns(first, stop) for history in (times, indentations, force)))
        for first, stop in ((0, loading), (turn, steps))
    ]
    hysteresis = (works[0] + works[1]).to("Abs")
    instants, levels = (history.pick(0, loading - 1, turn, steps - 1) for history in (times, indentations))
    durations = instants.rise()
    rates = levels.rise() / durations
    tabor, ratio = (graph.named(name).expand(1) for name in ("tabor", RATIO))
    # In the order of `KNOWN`.
    protocol = (tabor, levels.pick(1), rates.pick(0), durations.pick(1), -rates.pick(2), ratio)
    quantities = graph.add("Concat", *protocol, axis=1)
    half, group = _half_widths(quantities.to("Concat", sharpness, axis=1), bands)
    outside = _outside(quantities, levels.pick(0), scaling)
    pull_off_width, time_width, hysteresis_width, *widths = (half.pick(row) for row in range(len(RESULTS + BANDS)))
    unit = hysteresis.to("Max", 0.01 * works[0].to("Abs"), 1e-300)
    estimates = {
        "pull_off_force": (pull_off, pull_off * (_BOTH * pull_off_width).to("Exp")),
        "pull_off_time": (instant, begin + (instant - begin) * (_BOTH * time_width).to("Exp")),
        "hysteresis": (hysteresis, (hysteresis + _BOTH * (hysteresis_width * unit)).to("Max", 0.0)),
    }
    shapes: dict[str, list[str | int]] = {}
    for result, (name, (value, interval)) in zip(RESULTS, estimates.items(), strict=True):
        outside.to("Where", _BOTH * np.inf, interval, output=f"{result}_interval")
        value.to("Squeeze", [1], output=name)
        shapes |= {name: ["batch"], f"{result}_interval": ["batch", 2]}
    shape = graph.add("Gather", bands.shape, group.pick(len(RESULTS)).squeeze(1), axis=0)
    mean, deviation = scaling.force
    for name, width in zip(BANDS, widths, strict=True):
        distance = outside.to("Where", np.array(np.inf), width) * shape
        ((scaled - distance) * deviation + mean).symexp(f"{name}_lower")
        ((scaled + distance) * deviation + mean).symexp(f"{name}_upper")
        shapes |= {f"{name}_{end}": ["batch", steps] for end in ("lower", "upper")}
    return shapes


def _pull_off(times: Value, force: Value, count: int) -> tuple[Value, Value, Value]:
    """Pull-off force, its time and sharpness, each (batch, 1), of an unloading, as of `bands.results`."""
    top = force.to("ArgMax", axis=1)
    middle = top.to("Max", [1]).to("Min", [count - 2])
    places = (middle - 1).to("Concat", middle, middle + 1, axis=1)
    values, moments = (history.to("GatherElements", places, axis=1) for history in (force, times))
    durations = moments.rise()
    slopes = values.rise() / durations
    bend = slopes.rise() / durations.to("ReduceSum", [1])
    slope = slopes.pick(0) + bend * durations.pick(0)
    inside = middle.to("Equal", top)
    shift = (inside & (bend < 0.0)).to("Where", slope / bend, 0.0)
    highest, instant = (history.to("GatherElements", top, axis=1) for history in (force, times))
    lower = values.pick(0).to("Max", values.pick(2)) / highest.to("Max", 1e-300)
    return highest - 0.25 * slope * shift, instant - 0.5 * shift, inside.to("Where", 1.0 - lower, 0.0)


def _work(times: Value, indentations: Value, force: Value) -> Value:
    """Integral of -P d(indentation) over a phase, by the monotone cubics of `bem._support.monotone`, (batch, 1)."""
    width, ends = times.rise(), [0, -1]
    chord = force.rise() / width
    before, after = width.columns(0, -1), width.columns(1)
    left, right = chord.columns(0, -1), chord.columns(1)
    weight, next_weight = 2.0 * after + before, after + 2.0 * before
    mean = (weight + next_weight) / (weight / left + next_weight / right)
    inner = (left * right > 0.0).to("Where", mean, 0.0)
    near, far, chord_end, chord_next = (
        value.pick(*ends) for value in (width, width.columns(1, -1), chord, chord.columns(1, -1))
    )
    slope = ((2.0 * near + far) * chord_end - near * chord_next) / (near + far)
    steep = slope.to("Abs") > 3.0 * chord_end.to("Abs")
    limited = ((chord_end * chord_next > 0.0) | steep.to("Not")).to("Where", slope, 3.0 * chord_end)
    outer = (slope * chord_end > 0.0).to("Where", limited, 0.0)
    slopes = outer.pick(0).to("Concat", inner, outer.pick(1), axis=1)
    halves = force.columns(0, -1) + 0.5 * force.rise()
    area = (width * (halves - width * slopes.rise() / 12.0)).to("ReduceSum", [1])
    travel, duration = (history.pick(*ends).rise() for history in (indentations, times))
    return -(area * travel / duration)


def _half_widths(predictors: Value, bands: Bands) -> tuple[Value, Value]:
    """Half-widths of `RESULTS` and `BANDS`, and their groups, each (batch, 5), as of `Bands.half_widths`."""
    low, high = np.log(bands.ranges).T
    logarithms = predictors.to("Max", LEAST).to("Log")
    quantities = logarithms.columns(0, len(KNOWN))
    places = (2.0 * quantities - (low + high)) / (high - low)
    places = places.to("Min", 1.0).to("Max", -1.0)
    sharp = 1.0 + logarithms.pick(len(KNOWN)) / 4.0
    ones = sharp.pick(0) * 0.0 + 1.0
    factors = ones.to("Concat", places, sharp, axis=1)
    first, second, third = (factors.pick(*row) for row in FACTORS.tolist())
    size = first * second * third @ bands.coefficients.T
    below = (size.expand(2) > bands.edges).cast(TensorProto.INT64)
    group = below.to("ReduceSum", [2], keepdims=0)
    bits = (places > 0.0).cast(TensorProto.INT64) * [1 << bit for bit in range(len(KNOWN))]
    least = places.to("Abs").to("ReduceMin", axes=[1])
    corner = bits.to("ReduceSum", [1])
    cell = (least > 1.0 - 2.0 * OUTERMOST - 1e-9).to("Where", corner, group + CORNERS)
    for number, ratio in enumerate(NEARLY_ELASTIC):
        cell = (predictors.pick(KNOWN.index("modulus_ratio")) < ratio).to("Where", cell, CORNERS + GROUPS + number)
    table = bands.quantiles_at(COVERAGE)
    kinds, cells = table.shape
    rows = cell + [cells * index for index in range(kinds)]
    return size.to("Exp") * predictors.graph.add("Gather", table.ravel(), rows), group


def _outside(quantities: Value, start: Value, scaling: Scaling) -> Value:
    """Whether a quantity or the start lies outside the ranges, as of `surrogate.validity`, (batch, 1)."""
    low, high = np.array([scaling.ranges[name] for name in KNOWN]).T
    share = start / (default_start_indentation(1.0) * quantities.graph.named("tabor").expand(1))
    values = quantities.to("Concat", share, axis=1)
    low, high = np.append(low, 1.0 - START_TOLERANCE), np.append(high, 1.0 + START_TOLERANCE)
    beyond = (values < low * (1.0 - RANGE_TOLERANCE)) | (values > high * (1.0 + RANGE_TOLERANCE))
    return beyond.cast(TensorProto.FLOAT).to("ReduceMax", axes=[1]).cast(TensorProto.BOOL)

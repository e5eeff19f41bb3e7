"""Compiled kernels of the step-by-step prediction.

A program is an integer array of shape `(operations, len(COLUMNS))`. A row holds the kind of an operation, the positions
of its inputs and of its result in the vector of values, the position of its weights in the vector of weights, and that
of its state in the vector of states. The three vectors are float32. No kernel allocates an array. The gates of an LSTM
are in ONNX order: i, o, f, c.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from surrogate.data.features import ACCELERATION_SMOOTHING, FEATURE_SETS

KINDS = ("add", "append", "convolve", "dense", "lstm", "mix", "modulate", "normalise", "relu")
ADD, APPEND, CONVOLVE, DENSE, LSTM, MIX, MODULATE, NORMALISE, RELU = range(len(KINDS))

COLUMNS = ("kind", "first", "second", "result", "width_in", "width", "weights", "state", "points", "dilation")

CHANNELS = (*FEATURE_SETS["F"], "acceleration")
"""The first entries of the vector of the motion, float64, which a step reads and updates."""

TIME, INDENTATION, VELOCITY, EDGE, LOG_STEP, LEE_RADOK, HERTZ = range(7)
MEMORY_RELAXATION, MEMORY_RETARDATION, LOG_MODULUS_RATIO, LOADING, UNLOADING, ACCELERATION = range(7, 13)
# After the channels; MEMORY is that of the force of Hertz.
STEPS, ORIGIN, LATEST, MEMORY = range(13, 17)
MOTION_SIZE = 17

compiled = njit(cache=True, error_model="numpy", nogil=True)

# Sums of products may be reordered for vector instructions; NaN and infinity are treated as in IEEE 754.
compiled_sums = njit(cache=True, error_model="numpy", nogil=True, fastmath={"reassoc", "contract"})


@compiled_sums
def accumulate(matrix: np.ndarray, vector: np.ndarray, result: np.ndarray) -> None:
    """Add `matrix @ vector` to `result`; the matrix is flat, in row-major order."""
    columns = vector.size
    for row in range(result.size):
        total = np.float32(0.0)
        start = row * columns
        for column in range(columns):
            total += matrix[start + column] * vector[column]
        result[row] += total


@compiled
def hyperbolic_tangents(values: np.ndarray) -> None:
    """Replace float32 values by their hyperbolic tangents, to 4e-7; values that are not finite become NaN.

    A rational function is compiled to vector instructions, `math.tanh` is not. Source of the coefficients: the minimax
    approximation `generic_fast_tanh_float` of the Eigen library.
    """
    for index in range(values.size):
        x = min(max(values[index], np.float32(-7.90531110763549805)), np.float32(7.90531110763549805))
        s = x * x
        p = np.float32(-2.76076847742355e-16)
        p = p * s + np.float32(2.00018790482477e-13)
        p = p * s + np.float32(-8.60467152213735e-11)
        p = p * s + np.float32(5.12229709037114e-08)
        p = p * s + np.float32(1.48572235717979e-05)
        p = p * s + np.float32(6.37261928875436e-04)
        p = p * s + np.float32(4.89352455891786e-03)
        q = np.float32(1.19825839466702e-06)
        q = q * s + np.float32(1.18534705686654e-04)
        q = q * s + np.float32(2.26843463243900e-03)
        q = q * s + np.float32(4.89352518554385e-03)
        # The clamp makes infinity, and may make NaN, finite; the second term is then NaN.
        values[index] = x * p / q + (values[index] - values[index])


@compiled
def lstm_step(weights: np.ndarray, x: np.ndarray, state: np.ndarray, gates: np.ndarray) -> None:
    """Advance one LSTM layer.

    Args:
        weights: Input kernel, recurrent kernel and bias, flat.
        x: The input of shape `(inputs,)`.
        state: Hidden state, then cell state, of shape `(2 units,)`; updated in place.
        gates: Work array of shape `(4 units,)`.
    """
    units = gates.size // 4
    hidden, cell = state[:units], state[units:]
    split, end = gates.size * x.size, gates.size * (x.size + units)
    gates[:] = weights[end : end + gates.size]
    accumulate(weights[:split], x, gates)
    accumulate(weights[split:end], hidden, gates)
    half = np.float32(0.5)
    for index in range(3 * units):
        gates[index] *= half
    hyperbolic_tangents(gates)
    for index in range(units):
        admit = half + half * gates[index]
        keep = half + half * gates[2 * units + index]
        cell[index] = keep * cell[index] + admit * gates[3 * units + index]
        hidden[index] = cell[index]
    hyperbolic_tangents(hidden)
    for index in range(units):
        hidden[index] *= half + half * gates[units + index]


@compiled
def normalise(weights: np.ndarray, x: np.ndarray, result: np.ndarray) -> None:
    """Apply layer normalisation; the weights are gamma, beta and epsilon, flat."""
    width = x.size
    mean = 0.0
    for value in x:
        mean += value
    mean /= width
    variance = 0.0
    for value in x:
        variance += (value - mean) ** 2
    factor = 1.0 / math.sqrt(variance / width + weights[2 * width])
    for index in range(width):
        result[index] = np.float32((x[index] - mean) * factor) * weights[index] + weights[width + index]


@compiled
def convolve_step(
    weights: np.ndarray, x: np.ndarray, ring: np.ndarray, result: np.ndarray, points: int, dilation: int, steps: int
) -> None:
    """Advance a causal convolution; `ring` is a ring buffer of past inputs, and `weights` are kernel and bias, flat."""
    inputs, rows = x.size, ring.size // x.size
    row = steps % rows
    ring[row * inputs : (row + 1) * inputs] = x
    size = result.size * inputs
    result[:] = weights[points * size : points * size + result.size]
    for point in range(points):
        back = (points - 1 - point) * dilation
        if back <= steps:
            row = (steps - back) % rows
            accumulate(weights[point * size : (point + 1) * size], ring[row * inputs : (row + 1) * inputs], result)


@compiled
def symlog(value: float) -> float:
    """Return sign(x) log(1 + |x|)."""
    return math.copysign(math.log1p(abs(value)), value)


@compiled
def observe(motion: np.ndarray, solid: np.ndarray, time: float, indentation: float, edge: float) -> None:
    """Update the motion by a new point; the time of the first point becomes zero.

    Args:
        motion: The motion, of shape `(MOTION_SIZE,)`; updated in place.
        solid: Relaxed force of Hertz at an indentation of one, and modulus ratio; with NaN as the modulus ratio, the
            channels that depend on the solid are left out.
        time, indentation, edge: The new point.
    """
    if motion[STEPS] == 0.0:
        motion[ORIGIN] = time
    motion[LATEST] = time
    time -= motion[ORIGIN]
    step, velocity, acceleration = 0.0, 0.0, 0.0
    if motion[STEPS] > 0.0:
        step = time - motion[TIME]
        velocity = (indentation - motion[INDENTATION]) / step
        raw = (velocity - motion[VELOCITY]) / step
        acceleration = ACCELERATION_SMOOTHING * raw + (1.0 - ACCELERATION_SMOOTHING) * motion[ACCELERATION]
        motion[LOG_STEP] = math.log(step)
    motion[TIME] = time
    motion[INDENTATION] = indentation
    motion[VELOCITY] = velocity
    motion[ACCELERATION] = acceleration
    motion[EDGE] = edge
    motion[STEPS] += 1.0
    if not math.isnan(solid[1]):
        _observe_solid(motion, solid[0], solid[1], step)


@compiled
def _observe_solid(motion: np.ndarray, size: float, ratio: float, step: float) -> None:
    """Carry the channels of the solid to a point `step` after the last one, or zero at the first."""
    indentation, velocity = motion[INDENTATION], motion[VELOCITY]
    hertz = size * indentation * math.sqrt(indentation) if indentation > 0.0 else 0.0
    if step > 0.0:
        change = velocity * step
        lost, forgotten = -math.expm1(-step / ratio), -math.expm1(-step)
        motion[MEMORY] += lost / (step / ratio) * (hertz - motion[HERTZ]) - lost * motion[MEMORY]
        motion[MEMORY_RELAXATION] += lost / (step / ratio) * change - lost * motion[MEMORY_RELAXATION]
        motion[MEMORY_RETARDATION] += forgotten / step * change - forgotten * motion[MEMORY_RETARDATION]
    else:
        motion[MEMORY] = hertz
    motion[HERTZ] = hertz
    motion[LEE_RADOK] = hertz + (1.0 / ratio - 1.0) * motion[MEMORY]
    motion[LOG_MODULUS_RATIO] = math.log(ratio)
    motion[LOADING] = 1.0 if velocity > 0.0 else 0.0
    motion[UNLOADING] = 1.0 if velocity < 0.0 else 0.0


@compiled
def advance(
    program: np.ndarray,
    weights: np.ndarray,
    values: np.ndarray,
    state: np.ndarray,
    motion: np.ndarray,
    channels: np.ndarray,
    moments: np.ndarray,
    solid: np.ndarray,
    time: float,
    indentation: float,
    edge: float,
) -> float:
    """Take one step and return the physical force.

    Args:
        program: The program, of shape `(operations, len(COLUMNS))`.
        weights: All weights, float32.
        values: The scaled channels, followed by the results of all operations, float32; updated in place.
        state: All states of LSTM layers and convolutions, float32; updated in place.
        motion: The motion, of shape `(MOTION_SIZE,)`, float64; updated in place.
        channels: Index in the motion and number of symlog passes of each channel, of shape `(channels, 2)`.
        moments: Mean and standard deviation of each channel, then of the force, of shape `(channels + 1, 2)`.
        solid: Relaxed force of Hertz at an indentation of one, and modulus ratio, or NaN if no channel needs it.
        time: Time of the new point.
        indentation: Indentation at the new point.
        edge: One at the first and the last point of the dwell, otherwise zero.
    """
    steps = int(motion[STEPS])
    observe(motion, solid, time, indentation, edge)
    for index in range(channels.shape[0]):
        raw = motion[channels[index, 0]]
        for _ in range(channels[index, 1]):
            raw = symlog(raw)
        values[index] = np.float32((raw - moments[index, 0]) / moments[index, 1])

    for row in range(program.shape[0]):
        kind, first, second, target, width_in, width, at, state_at, points, dilation = program[row]
        x = values[first : first + width_in]
        result = values[target : target + width]
        if kind == LSTM:
            # The work array for the gates follows the result.
            lstm_step(
                weights[at:], x, state[state_at : state_at + 2 * width], values[target + width : target + 5 * width]
            )
            result[:] = state[state_at : state_at + width]
        elif kind == DENSE:
            result[:] = weights[at + width * width_in : at + width * (width_in + 1)]
            accumulate(weights[at:], x, result)
        elif kind == RELU:
            # `max` might replace NaN by zero; this does not.
            for index in range(width):
                result[index] = np.float32(0.0) if x[index] < 0.0 else x[index]
        elif kind == NORMALISE:
            normalise(weights[at:], x, result)
        elif kind == CONVOLVE:
            reach = ((points - 1) * dilation + 1) * width_in
            convolve_step(weights[at:], x, state[state_at : state_at + reach], result, points, dilation, steps)
        elif kind == ADD:
            for index in range(width):
                result[index] = x[index] + values[second + index]
        elif kind == APPEND:
            result[:width_in] = x
            result[width_in] = weights[at]
        elif kind == MODULATE:
            for index in range(width):
                result[index] = weights[at + index] * x[index] + weights[at + width + index]
        else:
            for index in range(width):
                result[index] = weights[at] * x[index] + weights[at + 1] * values[second + index]

    last = program[-1, 3]
    scaled = values[last] * moments[-1, 1] + moments[-1, 0]
    return math.copysign(math.expm1(abs(scaled)), scaled)

"""Step-by-step prediction with a pretrained model, for control loops on any standard linear solid.

`Pretrained.stream` returns a stream with the methods of `surrogate.inference.streaming.Stream`. Inputs F and LSTMs are
advanced by one compiled kernel without allocation; the network is that of `surrogate.pretrained.network`. The models
learned from the physical measurement steps of a planned protocol (`bem.dataset.physical_steps.physical_grid`): take
these steps.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from surrogate.inference.streaming import Stream
from surrogate.inference.validity import start_range
from surrogate.network.kernels import (
    MOTION_SIZE,
    STEPS,
    TIME,
    VELOCITY,
    accumulate,
    compiled,
    lstm_step,
    observe,
    symlog,
)
from surrogate.pretrained.network import CHANNELS, weights_of

if TYPE_CHECKING:
    from surrogate.pretrained.model import Pretrained

# After those of `surrogate.network.kernels`: force of Hertz and the three memories of `surrogate.data.physics`.
HERTZ, RELAXED, FAST, SLOW = range(MOTION_SIZE, MOTION_SIZE + 4)


@compiled
def _observe_physics(motion: np.ndarray, indentation: float, step: float, size: float, ratio: float) -> None:
    """Carry the channels of `surrogate.data.physics.physics_channels` to a new point, `step` after the last one."""
    hertz = size * indentation * math.sqrt(indentation) if indentation > 0.0 else 0.0
    if step > 0.0:
        change = motion[VELOCITY] * step
        lost, forgotten = -math.expm1(-step / ratio), -math.expm1(-step)
        motion[RELAXED] += lost / (step / ratio) * (hertz - motion[HERTZ]) - lost * motion[RELAXED]
        motion[FAST] += lost / (step / ratio) * change - lost * motion[FAST]
        motion[SLOW] += forgotten / step * change - forgotten * motion[SLOW]
    else:
        motion[RELAXED] = hertz
    motion[HERTZ] = hertz


@compiled
def _advance(
    units: np.ndarray,
    weights: np.ndarray,
    inputs: np.ndarray,
    work: np.ndarray,
    state: np.ndarray,
    motion: np.ndarray,
    moments: np.ndarray,
    solid: np.ndarray,
    time: float,
    indentation: float,
    edge: float,
) -> float:
    """Take one step and return the physical force.

    Args:
        units: Of each LSTM, then of the dense layer.
        weights: Of all layers in their order, flat float32.
        inputs: Scaled inputs, float32 of shape (13,); the last one, of the Tabor parameter, is constant.
        work: Work array, float32, four times the largest number of units.
        state: Hidden and cell state of each LSTM, float32.
        motion: Float64; updated in place, as the state.
        moments: Mean and standard deviation of the 13 inputs, then of the force, shape (14, 2).
        solid: Force of Hertz at an indentation of 1, and modulus ratio.
        time, indentation, edge: The new point.
    """
    before = motion[TIME]
    first = motion[STEPS] == 0.0
    observe(motion, time, indentation)
    step = 0.0 if first else motion[TIME] - before
    _observe_physics(motion, indentation, step, solid[0], solid[1])
    velocity = motion[VELOCITY]
    for index in range(inputs.size - 1):
        if index == 0:
            raw = symlog(symlog(motion[TIME]))
        elif index == 1:
            raw = symlog(indentation)
        elif index == 2:
            raw = symlog(velocity)
        elif index == 3:
            raw = edge
        elif index == 4:
            raw = 0.0 if first else math.log(step)
        elif index == 5:
            raw = symlog(motion[HERTZ] + (1.0 / solid[1] - 1.0) * motion[RELAXED])
        elif index == 6:
            raw = symlog(motion[HERTZ])
        elif index < 9:
            raw = symlog(motion[FAST + index - 7])
        elif index == 9:
            raw = math.log(solid[1])
        else:
            raw = 1.0 if (velocity > 0.0 if index == 10 else velocity < 0.0) else 0.0
        inputs[index] = np.float32((raw - moments[index, 0]) / moments[index, 1])
    x, at, place = inputs, 0, 0
    for layer in range(units.size - 1):
        size = units[layer]
        lstm_step(weights[at:], x, state[place : place + 2 * size], work[: 4 * size])
        at += 4 * size * (x.size + size + 1)
        x = state[place : place + size]
        place += 2 * size
    size = units[-1]
    hidden = work[:size]
    hidden[:] = weights[at + size * x.size : at + size * (x.size + 1)]
    accumulate(weights[at:], x, hidden)
    at += size * (x.size + 1)
    scaled = weights[at + size]
    for index in range(size):
        scaled += weights[at + index] * max(hidden[index], np.float32(0.0))
    force = scaled * moments[-1, 1] + moments[-1, 0]
    return math.copysign(math.expm1(abs(force)), force)


class PretrainedStream(Stream):
    """Prediction that advances point by point; `Pretrained.stream` returns one.

    Args:
        model: The pretrained model.
        tabor: The Tabor parameter of the history.
        modulus_ratio: Relaxed over instantaneous modulus of its solid.
    """

    def __init__(self, model: Pretrained, *, tabor: float, modulus_ratio: float) -> None:
        self.name, self.tabor, self.modulus_ratio = model.name, tabor, modulus_ratio
        units, self._weights = weights_of(model.folder / "model.onnx")
        self._units = np.array(units)
        scaling = model.scaling
        moments = [*zip(scaling.channel_mean, scaling.channel_scale, strict=True), scaling.tabor, scaling.force]
        self._moments = np.array(moments, dtype=np.float64)
        self._inputs = np.zeros(CHANNELS, dtype=np.float32)
        self._inputs[-1] = scaling.scale_tabor(np.array([tabor]))[0, 0]
        self._work = np.zeros(4 * max(units), dtype=np.float32)
        self._solid = np.array([-4.0 / (3.0 * np.pi) * tabor**-1.5, modulus_ratio])
        self._state = np.zeros(2 * sum(units[:-1]), dtype=np.float32)
        self._motion = np.zeros(SLOW + 1)
        self._owner = (model.name, tabor, modulus_ratio, float(self._weights.sum(dtype=np.float64)))
        self._starts = start_range(tabor)
        # The kernels are compiled, or loaded, here instead of in the first step of the user.
        self._advance(0.0, 0.0, 0.0)
        self.reset()

    def _advance(self, time: float, indentation: float, edge: float) -> float:
        return _advance(
            self._units,
            self._weights,
            self._inputs,
            self._work,
            self._state,
            self._motion,
            self._moments,
            self._solid,
            time,
            indentation,
            edge,
        )

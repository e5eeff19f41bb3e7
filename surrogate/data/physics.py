"""Channels of histories, computed point by point.

A standard linear solid's physics gives some of them for nothing: no contact with adhesion is solved. With u the force
of Hertz at the indentation of each instant and relaxation E(t)/E0 = 1 + (1/k - 1) exp(-t / k), k the modulus ratio and
the retardation time 1:

- `lee_radok`: integral of E(t - s)/E0 du(s), exact without adhesion while the contact grows. Its memory is carried on
  through the unloading, where it turns to tension shortly before the pull-off;
- `hertz`: u itself, the force when all is relaxed;
- `memory_relaxation`, `memory_retardation`: integral of exp(-(t - s) / T) d(indentation), the indentation less what the
  solid has forgotten, for the relaxation time T = k and the retardation time T = 1.

Everything is causal, and linear between the given instants. Units and the other channels as in
`surrogate.data.features`. Source: Lee and Radok, J. Appl. Mech. 27 (1960) 438.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel

ACCELERATION_SMOOTHING = 0.3
"""Weight of the newest value in the moving average of the acceleration."""


class Motion(NamedTuple):
    """Channels of one history at its latest point, forces positive in tension; all are zero before the first point.

    `memory` is that of the force of Hertz, which the force of Lee and Radok adds to it; `origin` is the time of the
    first point, from which `time` counts, and `latest` that of the latest one.
    """

    time: float = 0.0
    indentation: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0
    edge: float = 0.0
    log_step: float = 0.0
    lee_radok: float = 0.0
    hertz: float = 0.0
    memory_relaxation: float = 0.0
    memory_retardation: float = 0.0
    log_modulus_ratio: float = 0.0
    loading: float = 0.0
    unloading: float = 0.0
    memory: float = 0.0
    origin: float = 0.0
    latest: float = -math.inf


START = Motion()
"""The state before the first point."""


@functools.cache
def fields(names: tuple[str, ...]) -> np.ndarray:
    """Return the numbers of some fields of `Motion`."""
    return np.array([*map(Motion._fields.index, names)])


@kernel
def advance(last: Motion, instant: float, indentation: float, edge: float, tabor: float, ratio: float) -> Motion:
    """Return the channels at a new point.

    Args:
        last: Those at the point before.
        instant: Time of the point; that of the first point becomes zero.
        indentation: Indentation there.
        edge: One at the first and the last point of the dwell, otherwise zero.
        tabor: The Tabor parameter.
        ratio: Modulus ratio of the solid; with NaN, the channels that depend on the solid stay zero.

    Returns:
        The channels at the point.
    """
    began = last.latest > -math.inf
    origin = last.origin if began else instant
    time = instant - origin
    step, change = time - last.time, indentation - last.indentation
    velocity, acceleration, log_step = 0.0, 0.0, 0.0
    if began:
        velocity, log_step = change / step, math.log(step)
        raw = (velocity - last.velocity) / step
        acceleration = ACCELERATION_SMOOTHING * raw + (1.0 - ACCELERATION_SMOOTHING) * last.acceleration
    hertz, fast, slow, memory, strength, log_ratio = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if ratio > 0.0:
        if indentation > 0.0:
            hertz = -4.0 / (3.0 * math.pi) * tabor**-1.5 * indentation * math.sqrt(indentation)
        memory, strength, log_ratio = hertz, 1.0 / ratio - 1.0, math.log(ratio)
        if began:
            lost, forgotten = -math.expm1(-step / ratio), -math.expm1(-step)
            memory = last.memory + (lost / (step / ratio) * (hertz - last.hertz) - lost * last.memory)
            fast = last.memory_relaxation + (lost / (step / ratio) * change - lost * last.memory_relaxation)
            slow = last.memory_retardation + (forgotten / step * change - forgotten * last.memory_retardation)
    return Motion(
        time,
        indentation,
        velocity,
        acceleration,
        edge,
        log_step,
        hertz + strength * memory,
        hertz,
        fast,
        slow,
        log_ratio,
        1.0 if velocity > 0.0 else 0.0,
        1.0 if velocity < 0.0 else 0.0,
        memory,
        origin,
        instant,
    )


@kernel
def of_histories(
    start: Motion,
    times: np.ndarray,
    indentations: np.ndarray,
    edge: np.ndarray,
    tabor: np.ndarray,
    ratio: np.ndarray,
    chosen: np.ndarray,
) -> np.ndarray:
    """Channels of whole histories, shape (batch, steps, channels).

    Args:
        start: The state before the first point.
        times: Instants of shape (batch, steps), increasing along the steps.
        indentations: Indentations there.
        edge: Edge marks there.
        tabor: Tabor parameters, shape (batch,).
        ratio: Modulus ratios, shape (batch,).
        chosen: Numbers of the wanted fields of `Motion`.

    Returns:
        Array of shape (batch, steps, len(chosen)).
    """
    batch, steps = times.shape
    channels = np.empty((batch, steps, len(chosen)))
    for row in range(batch):
        now = start
        for step in range(steps):
            now = advance(now, times[row, step], indentations[row, step], edge[row, step], tabor[row], ratio[row])
            for column in range(len(chosen)):
                channels[row, step, column] = now[chosen[column]]
    return channels


@kernel
def standardised(channels: np.ndarray, passes: np.ndarray, mean: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Scaled channels, as of `surrogate.data.scaling`.

    Args:
        channels: Physical ones of shape (n, channels).
        passes: How many times each is transformed by symlog, shape (channels,).
        mean: Of each transformed channel.
        scale: Standard deviation likewise.

    Returns:
        Array of shape (n, channels), float32.
    """
    scaled = np.empty(channels.shape, np.float32)
    for row in range(len(channels)):
        for column in range(channels.shape[1]):
            value = channels[row, column]
            for _ in range(passes[column]):
                value = math.copysign(math.log1p(abs(value)), value)
            scaled[row, column] = (value - mean[column]) / scale[column]
    return scaled

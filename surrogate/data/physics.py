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

import math

import numpy as np

from bem._support.jit import kernel
from bem.dataset.physical_steps import carried, hertz_power

ACCELERATION_SMOOTHING = 0.3
"""Weight of the newest value in the moving average of the acceleration."""

FIELDS = (
    *("time", "indentation", "velocity", "acceleration", "edge", "log_step", "lee_radok", "hertz"),
    *("memory_relaxation", "memory_retardation", "log_modulus_ratio", "loading", "unloading"),
)
"""Names of all channels, in the order of the columns of `_history`; forces are positive in tension."""


@kernel
def of_histories(
    times: np.ndarray,
    indentations: np.ndarray,
    edge: np.ndarray,
    tabor: np.ndarray,
    ratio: np.ndarray,
    chosen: np.ndarray,
) -> np.ndarray:
    """Channels of whole histories, shape (batch, steps, channels).

    Args:
        times: Instants of shape (batch, steps), increasing along the steps; the time channel begins at zero.
        indentations: Indentations there.
        edge: Edge marks there: one at the first and the last point of the dwell, otherwise zero.
        tabor: Tabor parameters, shape (batch,).
        ratio: Modulus ratios, shape (batch,); with NaN, the channels that depend on the solid stay zero.
        chosen: Numbers of the wanted channels in `FIELDS`.

    Returns:
        Array of shape (batch, steps, len(chosen)).
    """
    channels = np.empty((*times.shape, len(chosen)))
    for row in range(len(times)):
        fields = _history(times[row], indentations[row], edge[row], tabor[row], ratio[row])
        for column in range(len(chosen)):
            channels[row, :, column] = fields[:, chosen[column]]
    return channels


@kernel
def _history(times: np.ndarray, indentations: np.ndarray, edge: np.ndarray, tabor: float, ratio: float) -> np.ndarray:
    """All channels of one history, shape (steps, len(FIELDS))."""
    fields, memory = np.zeros((len(times), len(FIELDS))), 0.0
    for i in range(len(times)):
        now, last = fields[i], fields[max(i - 1, 0)]
        now[0], now[1], now[4] = times[i] - times[0], indentations[i], edge[i]
        step, change = now[0] - last[0], now[1] - last[1]
        if i > 0:
            now[2], now[5] = change / step, math.log(step)
            raw = (now[2] - last[2]) / step
            now[3] = ACCELERATION_SMOOTHING * raw + (1.0 - ACCELERATION_SMOOTHING) * last[3]
            now[11], now[12] = now[2] > 0.0, now[2] < 0.0
        if ratio > 0.0:
            now[7], now[10] = -4.0 / (3.0 * math.pi) * tabor**-1.5 * hertz_power(now[1]), math.log(ratio)
            memory = carried(memory, 1.0 / ratio, step, now[7] - last[7]) if i > 0 else now[7]
            now[6] = now[7] + (1.0 / ratio - 1.0) * memory
            if i > 0:
                now[8], now[9] = carried(last[8], 1.0 / ratio, step, change), carried(last[9], 1.0, step, change)
    return fields


@kernel
def transformed(channels: np.ndarray, passes: np.ndarray) -> np.ndarray:
    """Channels of shape (n, channels) after the symmetric logarithm of `surrogate.data.scaling`, `passes` times each.

    The result is float64, and has the same shape.
    """
    values = np.empty(channels.shape)
    for row in range(len(channels)):
        for column in range(channels.shape[1]):
            value = channels[row, column]
            for _ in range(passes[column]):
                value = math.copysign(math.log1p(abs(value)), value)
            values[row, column] = value
    return values

"""Channels of a history at its latest point, carried from point to point; see `surrogate.data.features`.

Plain numbers, because a stream takes one point at a time: an array of one row costs more than its arithmetic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from surrogate.data.features import ACCELERATION_SMOOTHING


@dataclass(slots=True)
class Motion:
    """The motion of one history: its channels by name, all zero before the first point.

    Args:
        tabor: The Tabor parameter.
        modulus_ratio: Modulus ratio of the solid; without it, the channels that depend on the solid stay zero.
    """

    tabor: float
    modulus_ratio: float | None
    origin: float = 0.0
    """Time of the first point, from which the channel `time` counts."""
    latest: float = -math.inf
    """Time of the latest point."""
    time: float = 0.0
    indentation: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0
    edge: float = 0.0
    log_step: float = 0.0
    hertz: float = 0.0
    lee_radok: float = 0.0
    memory: float = 0.0
    """Of the force of Hertz, which the force of Lee and Radok adds to it."""
    memory_relaxation: float = 0.0
    memory_retardation: float = 0.0
    log_modulus_ratio: float = 0.0
    loading: float = 0.0
    unloading: float = 0.0

    @property
    def began(self) -> bool:
        """Whether the history has a point."""
        return self.latest > -math.inf

    def advance(self, time: float, indentation: float, edge: float) -> None:
        """Take a new point.

        Args:
            time: Time of the point; that of the first point becomes zero.
            indentation: Indentation there.
            edge: One at the first and the last point of the dwell, otherwise zero.
        """
        step = 0.0
        if self.began:
            since = time - self.origin
            step = since - self.time
            velocity = (indentation - self.indentation) / step
            raw = (velocity - self.velocity) / step
            self.acceleration = ACCELERATION_SMOOTHING * raw + (1.0 - ACCELERATION_SMOOTHING) * self.acceleration
            self.time, self.velocity, self.log_step = since, velocity, math.log(step)
        else:
            self.origin = time
        self.latest, self.indentation, self.edge = time, indentation, edge
        if self.modulus_ratio is not None:
            self._carry(self.modulus_ratio, step)

    def _carry(self, ratio: float, step: float) -> None:
        """Carry the channels of the solid to a point `step` after the last one, or zero at the first."""
        indentation, size = self.indentation, -4.0 / (3.0 * math.pi) * self.tabor**-1.5
        hertz = size * indentation * math.sqrt(indentation) if indentation > 0.0 else 0.0
        if step > 0.0:
            change = self.velocity * step
            lost, forgotten = -math.expm1(-step / ratio), -math.expm1(-step)
            self.memory += lost / (step / ratio) * (hertz - self.hertz) - lost * self.memory
            self.memory_relaxation += lost / (step / ratio) * change - lost * self.memory_relaxation
            self.memory_retardation += forgotten / step * change - forgotten * self.memory_retardation
        else:
            self.memory = hertz
        self.hertz, self.lee_radok = hertz, hertz + (1.0 / ratio - 1.0) * self.memory
        self.log_modulus_ratio = math.log(ratio)
        self.loading, self.unloading = float(self.velocity > 0.0), float(self.velocity < 0.0)

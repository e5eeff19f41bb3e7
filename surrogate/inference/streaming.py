"""Step-by-step prediction of the force, for control loops.

`Stream.run` gives the same bits as the single steps of `Stream.step`. `Surrogate.predict` computes the same in another
order of float32 operations; it agrees to within `AGREEMENT` of the history's force range, as
`tests/surrogate/inference/test_agreement.py` tests for the published M1-concat. A step of M1-concat takes a few tens of
microseconds (`make bench-stream` measures it) and allocates no array. Only causal models can stream: M5 needs the whole
history.

Examples:
    >>> import surrogate
    >>> stream = surrogate.load("M1-concat").stream(tabor=1.0)  # doctest: +SKIP
    >>> stream.step(0.0, -2.145), stream.step(0.02, -2.0)  # doctest: +SKIP

The models were trained on 120 points per history; `docs/control.md` explains how to divide a protocol into steps. Units
as in `bem.protocol`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bem._support.validation import real_array
from bem._support.wording import shown
from bem.protocol import LARGEST_INDENTATION, LARGEST_RATE
from surrogate.data.features import NEEDS_MATERIAL, channel_names
from surrogate.data.scaling import SYMLOG_PASSES, Scaling
from surrogate.inference.checks import LONGEST_HISTORY, SHORTEST_STEP, checked_edge, real_number
from surrogate.inference.validity import excesses, start_range, warn_of_extrapolation
from surrogate.network.graph import Graph
from surrogate.network.kernels import CHANNELS, INDENTATION, LATEST, MOTION_SIZE, ORIGIN, STEPS, TIME, advance
from surrogate.network.program import Program, aligned

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

AGREEMENT = 1e-5
"""Largest difference between stream, ONNX and Keras, as a share of the history's force range; tested."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """State of a stream after one of its steps; `Stream.restore` takes it."""

    state: np.ndarray
    motion: np.ndarray
    owner: object


class Stream:
    """Prediction that advances point by point; `Surrogate.stream` returns one.

    Args:
        graph: The network as a graph of elementary operations.
        scaling: The scaling of its training set.
        tabor: The Tabor parameter of the history.
        modulus_ratio: Modulus ratio of its solid, for inputs that depend on it; by default that of the training set.
        name: Name of the model in messages.

    Raises:
        ValueError: the model is not causal, the graph is damaged, or the modulus ratio is needed and unknown.
    """

    def __init__(
        self,
        graph: Graph,
        scaling: Scaling,
        *,
        tabor: float,
        modulus_ratio: float | None = None,
        name: str = "surrogate",
    ) -> None:
        if scaling.features in NEEDS_MATERIAL and modulus_ratio is None:
            modulus_ratio = scaling.known_modulus_ratio
        self.name = name
        self.tabor = tabor
        self.modulus_ratio = modulus_ratio
        program = Program(graph, scaling, tabor, name)
        self._program = np.array(program.rows, dtype=np.int64)
        self._weights = aligned(np.concatenate(program.weights, dtype=np.float32))
        self._values = np.zeros(program.values, dtype=np.float32)
        self._state = np.zeros(program.states, dtype=np.float32)
        self._motion = np.zeros(MOTION_SIZE)
        self._solid = np.array([-4.0 / (3.0 * np.pi) * tabor**-1.5, np.nan if modulus_ratio is None else modulus_ratio])
        names = channel_names(scaling.features)
        self._channels = np.array([(CHANNELS.index(channel), SYMLOG_PASSES[channel]) for channel in names])
        moments = [*zip(scaling.channel_mean, scaling.channel_scale, strict=True), scaling.force]
        self._moments = np.array(moments, dtype=np.float64)
        # A snapshot fits the streams of the same network, Tabor parameter and solid only.
        self._owner = (name, tabor, modulus_ratio, scaling.dataset_sha256, float(self._weights.sum(dtype=np.float64)))
        self._starts = start_range(tabor)
        # The kernels are compiled, or loaded, here instead of in the first step of the user.
        self._advance(0.0, 0.0, 0.0)
        self.reset()

    @property
    def time(self) -> float:
        """Time of the latest step; minus infinity before the first step."""
        return float(self._motion[LATEST]) if self._motion[STEPS] else -math.inf

    def step(self, time: float, indentation: float, edge: bool = False) -> float:
        """Advance to the next point and return the force there.

        Args:
            time: Time of the point, later than that of the previous step; the first time is arbitrary.
            indentation: Indentation at the point.
            edge: Whether the point is the first or the last one of the dwell.

        Returns:
            The force P / (pi R dgamma), tension positive.

        Raises:
            ValueError: an argument is not a finite real number, the time does not increase, or the motion is outside
                the bounds of `bem.protocol`. The state of the stream is then unchanged.

        Warns:
            ExtrapolationWarning: the first indentation is not near -pi^(2/3) mu, where all training histories start.
        """
        motion = self._motion
        if not (isinstance(time, float) and isinstance(indentation, float)):
            time, indentation = real_number("time", time), real_number("indentation", indentation)
        if not (math.isfinite(time) and abs(indentation) <= LARGEST_INDENTATION):
            raise ValueError(
                f"Expected a finite time, and an indentation within +-{LARGEST_INDENTATION:g}. "
                f"Received: time={time!r}, indentation={indentation!r}"
            )
        if motion[STEPS]:
            since = time - motion[ORIGIN]
            step = since - motion[TIME]
            if not (step >= SHORTEST_STEP and since <= LONGEST_HISTORY):
                raise ValueError(
                    f"Expected a time after {self.time!r}, that of the previous step, and at most {LONGEST_HISTORY:g} "
                    f"after the first one. Received: time={time!r}"
                )
            if abs(indentation - motion[INDENTATION]) > LARGEST_RATE * step:
                raise ValueError(
                    f"Expected a rate of at most {LARGEST_RATE:g}. Received: indentation={indentation!r} at "
                    f"time={time!r} after {float(motion[INDENTATION])!r} at {self.time!r}"
                )
        elif not self._starts[0] <= indentation <= self._starts[1]:
            start = {"tabor": np.array([self.tabor]), "start_indentation": np.array([indentation])}
            warn_of_extrapolation(self.name, excesses(start, {}))
        return self._advance(float(time), float(indentation), 1.0 if edge else 0.0)

    def run(self, times: ArrayLike, indentations: ArrayLike, edge: ArrayLike) -> np.ndarray:
        """Take many steps, as `step` takes each of them; on a new stream, a whole history.

        Args:
            times: Times of shape `(steps,)`.
            indentations: Indentations of the same shape.
            edge: Marks of the same shape, one at the first and the last point of the dwell and zero elsewhere.

        Returns:
            The forces of shape `(steps,)`, float64, bitwise equal to those of `step`.

        Raises:
            ValueError: the shapes differ, a mark is neither zero nor one, or `step` raises. The state of the stream is
                then unchanged.
        """
        times, indentations = real_array("times", times), real_array("indentations", indentations)
        if times.ndim != 1 or times.shape != indentations.shape:
            raise ValueError(
                "Expected times and indentations of the same shape (steps,). "
                f"Received: shapes {times.shape} and {indentations.shape}"
            )
        marks = checked_edge(edge, times.shape)
        before = self.snapshot()
        try:
            points = zip(times.tolist(), indentations.tolist(), marks.tolist(), strict=True)
            return np.array([self.step(*point) for point in points])
        except ValueError:
            self.restore(before)
            raise

    def _advance(self, time: float, indentation: float, edge: float) -> float:
        return advance(
            self._program,
            self._weights,
            self._values,
            self._state,
            self._motion,
            self._channels,
            self._moments,
            self._solid,
            time,
            indentation,
            edge,
        )

    def reset(self) -> None:
        """Reset the state: the next step is the first one of a history."""
        self._state[:] = 0.0
        self._motion[:] = 0.0

    def snapshot(self) -> Snapshot:
        """Return a copy of the state, so that later steps can be undone by `restore`."""
        return Snapshot(self._state.copy(), self._motion.copy(), self._owner)

    def restore(self, snapshot: Snapshot) -> None:
        """Set the state to a snapshot of this stream, or of another one of the same model and Tabor parameter.

        Raises:
            ValueError: the snapshot is of another model or another Tabor parameter.
        """
        if not isinstance(snapshot, Snapshot) or snapshot.owner != self._owner:
            raise ValueError(f"Expected a snapshot of {self.name} at tabor={self.tabor:g}. Received: {shown(snapshot)}")
        self._state[:] = snapshot.state
        self._motion[:] = snapshot.motion

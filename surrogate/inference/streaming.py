"""Step-by-step prediction for control loops: a causal model carried along as the sphere moves.

Steps taken one by one and a whole history through `Stream.run` agree bitwise. `Surrogate.predict`, which computes the
same in another order of float32 operations, agrees within `AGREEMENT` of the history's force range, which
`tests/surrogate/test_agreement.py` holds the published M1-concat to. A step of M1-concat takes a few tens of
microseconds (`make bench-stream` measures it) and allocates no array. M5 needs the whole history and cannot stream.

Example:
    >>> import surrogate
    >>> stream = surrogate.load("M1-concat").stream(tabor=1.0)  # doctest: +SKIP
    >>> stream.step(0.0, -2.145), stream.step(0.02, -2.0)  # doctest: +SKIP

The models learned from about 120 points a history; `docs/control.md` explains how to divide a protocol into steps.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bem._support.validation import real_array
from bem._support.wording import shown
from bem.protocol import LARGEST_INDENTATION, LARGEST_RATE, default_start_indentation
from surrogate.data.features import channel_names
from surrogate.data.scaling import SYMLOG_PASSES, Scaling
from surrogate.inference.checks import LONGEST_HISTORY, SHORTEST_STEP, checked_edge, real_number
from surrogate.inference.validity import START_TOLERANCE, ExtrapolationWarning, advice, excesses, worst
from surrogate.network.graph import Graph
from surrogate.network.kernels import CHANNELS, INDENTATION, LATEST, MOTION_SIZE, ORIGIN, STEPS, TIME, advance
from surrogate.network.program import Program

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

AGREEMENT = 1e-5
"""Largest difference between stream, ONNX and Keras, as a share of the history's force range; tested."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A stream's state at one moment, to return to."""

    state: np.ndarray
    motion: np.ndarray
    owner: object


class Stream:
    """A prediction that advances point by point; made by `Surrogate.stream`.

    Args:
        graph: The network.
        scaling: Its scaling.
        tabor: The Tabor parameter.
        name: The name shown in messages.

    Raises:
        ValueError: the model is not causal.
    """

    def __init__(self, graph: Graph, scaling: Scaling, *, tabor: float, name: str = "surrogate") -> None:
        self.name = name
        self.tabor = tabor
        program = Program(graph, scaling, tabor, name)
        self._program = np.array(program.rows, dtype=np.int64)
        self._weights = np.concatenate(program.weights, dtype=np.float32)
        self._values = np.zeros(program.values, dtype=np.float32)
        self._state = np.zeros(program.states, dtype=np.float32)
        self._motion = np.zeros(MOTION_SIZE)
        names = channel_names(scaling.features)
        if not set(names) <= set(CHANNELS):
            raise ValueError(f"Expected a model of the feature sets A to D. Received: {name} of {scaling.features}")
        self._channels = np.array([(CHANNELS.index(channel), SYMLOG_PASSES[channel]) for channel in names])
        moments = [*zip(scaling.channel_mean, scaling.channel_scale, strict=True), scaling.force]
        self._moments = np.array(moments, dtype=np.float64)
        # Snapshots fit every stream of the same network and Tabor parameter, and no other.
        self._owner = (name, tabor, scaling.dataset_sha256, float(self._weights.sum(dtype=np.float64)))
        usual = default_start_indentation(tabor)
        self._starts = ((1.0 + START_TOLERANCE) * usual, (1.0 - START_TOLERANCE) * usual)
        # Kernels compile, or load, before the first step of a user.
        self._advance(0.0, 0.0, 0.0)
        self.reset()

    @property
    def time(self) -> float:
        """Time of the latest step; minus infinity before the first."""
        return float(self._motion[LATEST]) if self._motion[STEPS] else -math.inf

    def step(self, time: float, indentation: float, edge: bool = False) -> float:
        """Advance to a new point and return the force there.

        Args:
            time: Its time, after that of the step before; the first step's may be any.
            indentation: Its indentation.
            edge: Whether it is the first or the last point of the dwell, which the caller knows.

        Returns:
            The force P / (pi R dgamma), tension positive.

        Raises:
            ValueError: what is no real number, a time that does not advance, NaN or infinity, or motion beyond the
                bounds of `bem.protocol`; the stream stays where it was.

        Warns:
            ExtrapolationWarning: a first step elsewhere than at -pi^(2/3) mu, where all training histories begin.
        """
        motion = self._motion
        if not (isinstance(time, float) and isinstance(indentation, float)):
            time, indentation = real_number("time", time), real_number("indentation", indentation)
        if not (math.isfinite(time) and abs(indentation) <= LARGEST_INDENTATION):
            raise ValueError(
                f"Expected a finite step, indentations within +-{LARGEST_INDENTATION:g}. "
                f"Received: time={time!r}, indentation={indentation!r}"
            )
        if motion[STEPS]:
            since = time - motion[ORIGIN]
            step = since - motion[TIME]
            if not (step >= SHORTEST_STEP and since <= LONGEST_HISTORY):
                raise ValueError(
                    f"Expected a time after {self.time!r}, that of the step before, and at most {LONGEST_HISTORY:g} "
                    f"after the first. Received: time={time!r}"
                )
            if abs(indentation - motion[INDENTATION]) > LARGEST_RATE * step:
                raise ValueError(
                    f"Expected a rate of at most {LARGEST_RATE:g}. Received: indentation={indentation!r} at "
                    f"time={time!r} after {float(motion[INDENTATION])!r} at {self.time!r}"
                )
        elif not self._starts[0] <= indentation <= self._starts[1]:
            self._warn_of_start(indentation)
        return self._advance(float(time), float(indentation), 1.0 if edge else 0.0)

    def run(self, times: ArrayLike, indentations: ArrayLike, edge: ArrayLike) -> np.ndarray:
        """Take many steps, each as `step` takes it; from a fresh stream on, a whole history.

        Args:
            times: Times of shape `(steps,)`.
            indentations: Indentations of the same shape.
            edge: Marks of the dwell's ends, one there and zero elsewhere, of the same shape.

        Returns:
            The forces of shape `(steps,)`, float64, bitwise those of `step`.

        Raises:
            ValueError: unequal shapes, a mark that is neither zero nor one, or what `step` refuses; the stream stays
                where it was.
        """
        times, indentations = real_array("times", times), real_array("indentations", indentations)
        if times.ndim != 1 or times.shape != indentations.shape:
            raise ValueError(
                "Expected times and indentations of one shape (steps,). "
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
            time,
            indentation,
            edge,
        )

    def _warn_of_start(self, indentation: float) -> None:
        found = excesses({"tabor": np.array([self.tabor]), "start_indentation": np.array([indentation])}, {})
        if found:
            words = worst(found)
            message = f"{self.name} extrapolates beyond its training: {'; '.join(words)}. Advice: {advice(words)}"
            warnings.warn(message, ExtrapolationWarning, stacklevel=3)

    def reset(self) -> None:
        """Forget everything: the next step is a history's first."""
        self._state[:] = 0.0
        self._motion[:] = 0.0

    def snapshot(self) -> Snapshot:
        """Return the state as it is now, so that steps can be tried and undone."""
        return Snapshot(self._state.copy(), self._motion.copy(), self._owner)

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot, taken of this stream or of another one of the same model and Tabor parameter.

        Raises:
            ValueError: it was taken of another model or at another Tabor parameter.
        """
        if not isinstance(snapshot, Snapshot) or snapshot.owner != self._owner:
            raise ValueError(f"Expected a snapshot of {self.name} at tabor={self.tabor:g}. Received: {shown(snapshot)}")
        self._state[:] = snapshot.state
        self._motion[:] = snapshot.motion

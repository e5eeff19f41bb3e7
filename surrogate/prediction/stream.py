"""Step-by-step prediction of the force, for control loops.

A stream runs one time step of the exported network in ONNX Runtime (`surrogate.export.step`) and keeps its states.
`Stream.run` gives the same bits as the single steps of `Stream.step`. `Surrogate.predict_history` computes the same in
another order of float32 operations; it agrees to within `AGREEMENT` of the history's force range, as
`tests/surrogate/prediction/test_predictor.py` tests for the published M1-concat. A step takes some tens of microseconds
(`make measure-stream-latency` measures it). Only causal networks can stream: M5 and `fast` need the
whole history, and of `accurate` the causal ones run alone.

Examples:
    >>> import surrogate
    >>> from bem import Scene, StandardLinearSolid
    >>> scene = Scene(1.0, StandardLinearSolid(0.1))
    >>> stream = surrogate.load("M1-concat").stream(scene)  # doctest: +SKIP
    >>> stream.step(0.0, -2.145), stream.step(0.02, -2.0)  # doctest: +SKIP

The paper's models were trained on 120 points per history, `fast` and `accurate` on the physical measurement steps of a
planned protocol (`bem.dataset.physical_steps`); `docs/control.md` explains how to divide a protocol into steps. Units
as in `bem.protocol`.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.jit import in_python
from bem._support.validation import real_array
from bem._support.wording import shown
from bem.protocol import LARGEST_INDENTATION, LARGEST_RATE
from surrogate.data.features import channel_names
from surrogate.data.physics import START, Motion, advance
from surrogate.data.scaling import SYMLOG_PASSES, Scaling
from surrogate.export.onnx_file import session_of
from surrogate.export.step import FORCE, INPUT, NEXT, step_model
from surrogate.prediction.validity import LONGEST_HISTORY, SHORTEST_STEP, checked_edge, warn_of_extrapolation
from surrogate.prediction.watch import Watch

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_advance = in_python(advance)  # one point at a time, for which the compiled function takes longer to call
AGREEMENT = 1e-5
"""Largest difference between stream, ONNX and Keras, as a share of the history's force range; tested."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """State of a stream after one of its steps; `Stream.restore` takes it."""

    states: list[np.ndarray]
    motion: Motion
    watch: Watch
    owner: object


class _StatefulSession:
    """A session of ONNX Runtime on one thread, with the states of a network in memory bound to it.

    Two sets of states take turns: each step reads one and writes the other, so no state is copied.
    """

    def __init__(self, content: bytes) -> None:
        self._session = session_of(content)
        shapes = {one.name: one.shape for one in self._session.get_inputs()}
        self.inputs, self._force = np.zeros(shapes.pop(INPUT), np.float32), np.zeros(1, np.float32)
        sets = [{name: np.zeros(shape, np.float32) for name, shape in shapes.items()} for _ in range(2)]
        self._sets = [list(one.values()) for one in sets]
        self._bindings = [self._binding(before, after) for before, after in (sets, sets[::-1])]
        self._turn = 0

    @property
    def states(self) -> list[np.ndarray]:
        """The states that the next step reads."""
        return self._sets[self._turn]

    def step(self) -> float:
        """Advance by `inputs`, and return the scaled force."""
        self._session.run_with_iobinding(self._bindings[self._turn])
        self._turn = 1 - self._turn
        return self._force.item(0)

    def _binding(self, before: dict[str, np.ndarray], after: dict[str, np.ndarray]) -> Any:
        found = self._session.io_binding()
        outputs = {FORCE: self._force} | {f"{name}{NEXT}": values for name, values in after.items()}
        for bind, ends in ((found.bind_input, {INPUT: self.inputs} | before), (found.bind_output, outputs)):
            for name, values in ends.items():
                bind(name, "cpu", 0, np.float32, values.shape, values.ctypes.data)
        return found


def _number(name: str, value: Any) -> float:
    """Return a number, or the one element of an array, as a float; NaN and infinity are allowed."""
    number = real_array(name, value)
    if number.size != 1:
        raise ValueError(f"Expected one number as {name}. Received: shape {number.shape}")
    return float(number.item())


class Stream:
    """Prediction that advances point by point; `Surrogate.stream` returns one.

    Args:
        content: ONNX file with the network.
        scaling: The scaling of its training set.
        tabor: The Tabor parameter of the history.
        modulus_ratio: Modulus ratio of its solid, for inputs that depend on it.
        name: Name of the model in messages.
        ranges: Smallest and largest value of each quantity, by default those of the scaling; see
            `surrogate.prediction.watch.Watch`.

    Raises:
        ValueError: the model is not causal.
    """

    def __init__(
        self,
        content: bytes,
        scaling: Scaling,
        *,
        tabor: float,
        modulus_ratio: float | None = None,
        name: str = "surrogate",
        ranges: dict[str, tuple[float, float]] | None = None,
    ) -> None:
        self.name, self.tabor, self.modulus_ratio = name, tabor, modulus_ratio
        told = scaling.scale_tabor(np.array([tabor]))
        self._network = _StatefulSession(step_model(content, told, name))
        self._motion, self._solid = START, (tabor, math.nan if modulus_ratio is None else modulus_ratio)
        self._names = names = channel_names(scaling.features)
        self._mean, self._scale = np.array(scaling.channel_mean), np.array(scaling.channel_scale)
        self._force_mean, self._force_scale = scaling.force
        # A network that has the Tabor parameter as its last channel is told it once.
        self._scaled = self._network.inputs[0, 0, : len(names)]
        self._network.inputs[0, 0, len(names) :] = told[0, 0]
        # A snapshot fits the streams of the same network, Tabor parameter and solid only.
        self._owner = (name, tabor, modulus_ratio, scaling.dataset_sha256, hash(content))
        marked = {} if "edge" in names else {"edge_marks": (0.0, np.inf)}
        self._watch = Watch(tabor, {**(scaling.ranges if ranges is None else ranges), **marked})

    @property
    def time(self) -> float:
        """Time of the latest step; minus infinity before the first step."""
        return self._motion.latest

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
            ExtrapolationWarning: the history leaves the training set, in a quantity that `predict_history` checks, in
                the edge marks, or by a second cycle; of each cause once a history.
        """
        motion = self._motion
        if not (isinstance(time, float) and isinstance(indentation, float)):
            time, indentation = _number("time", time), _number("indentation", indentation)
        if not (math.isfinite(time) and abs(indentation) <= LARGEST_INDENTATION):
            raise ValueError(
                f"Expected a finite time, and an indentation within +-{LARGEST_INDENTATION:g}. "
                f"Received: time={time!r}, indentation={indentation!r}"
            )
        if motion.latest > -math.inf:
            since = time - motion.origin
            step = since - motion.time
            if not (step >= SHORTEST_STEP and since <= LONGEST_HISTORY):
                raise ValueError(
                    f"Expected a time after {self.time!r}, that of the previous step, and at most {LONGEST_HISTORY:g} "
                    f"after the first one. Received: time={time!r}"
                )
            if abs(indentation - motion.indentation) > LARGEST_RATE * step:
                raise ValueError(
                    f"Expected a rate of at most {LARGEST_RATE:g}. Received: indentation={indentation!r} at "
                    f"time={time!r} after {motion.indentation!r} at {self.time!r}"
                )
        force = self._advance(float(time), float(indentation), 1.0 if edge else 0.0)
        if found := self._watch.see(time, indentation, bool(edge), self._motion.lee_radok < 0.0 < indentation):
            warn_of_extrapolation(self.name, found)
        return force

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
        self._motion = _advance(self._motion, time, indentation, edge, *self._solid)
        values = []
        for name in self._names:
            value = getattr(self._motion, name)
            for _ in range(SYMLOG_PASSES[name]):
                value = math.copysign(math.log1p(abs(value)), value)
            values.append(value)
        self._scaled[:] = (np.array(values) - self._mean) / self._scale
        scaled = self._network.step() * self._force_scale + self._force_mean
        return math.copysign(math.expm1(abs(scaled)), scaled)

    def reset(self) -> None:
        """Reset the state: the next step is the first one of a history."""
        for state in self._network.states:
            state[:] = 0.0
        self._motion = START
        self._watch.reset()

    def snapshot(self) -> Snapshot:
        """Return a copy of the state, so that later steps can be undone by `restore`."""
        states = [state.copy() for state in self._network.states]
        return Snapshot(states, self._motion, copy(self._watch), self._owner)

    def restore(self, snapshot: Snapshot) -> None:
        """Set the state to a snapshot of this stream, or of another one of the same model, Tabor parameter and solid.

        Raises:
            ValueError: the snapshot is of another model, Tabor parameter or solid.
        """
        if not isinstance(snapshot, Snapshot) or snapshot.owner != self._owner:
            raise ValueError(f"Expected a snapshot of {self.name} at tabor={self.tabor:g}. Received: {shown(snapshot)}")
        for state, kept in zip(self._network.states, snapshot.states, strict=True):
            state[:] = kept
        self._motion, self._watch = snapshot.motion, copy(snapshot.watch)

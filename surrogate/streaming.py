"""Step-by-step prediction for control loops: a causal model carried along as the sphere moves.

Steps taken one by one and a whole history through `Stream.run` agree bitwise. `Surrogate.predict`, which computes the
same in another order of float32 operations, agrees within `AGREEMENT` of the history's force range, which
`tests/surrogate/test_agreement.py` holds the published M1-concat to. A step of M1-concat takes a few tens of
microseconds (`make bench-stream` measures it) and allocates no array. M5 looks at the whole history and cannot stream.

Example:
    >>> import surrogate
    >>> stream = surrogate.load("M1-concat").stream(tabor=1.0)  # doctest: +SKIP
    >>> stream.step(0.0, -2.145), stream.step(0.02, -2.0)  # doctest: +SKIP

The model learned from about 120 points a history; how a plan should be divided into steps is said in `docs/control.md`.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bem.protocol import LARGEST_INDENTATION, LARGEST_RATE, default_start_indentation
from surrogate.checks import LONGEST_HISTORY, SHORTEST_STEP, checked_edge
from surrogate.extrapolation import START_TOLERANCE, ExtrapolationWarning, excesses, worst
from surrogate.features import channel_names
from surrogate.kernels import CHANNELS, COLUMNS, INDENTATION, KINDS, LATEST, MOTION_SIZE, ORIGIN, STEPS, TIME, advance
from surrogate.plan import SEQUENCE, TABOR, Operation, Plan
from surrogate.scaling import SYMLOG_PASSES, Scaling

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
        plan: The network.
        scaling: Its scaling.
        tabor: The Tabor parameter.
        name: The name shown in messages.

    Raises:
        ValueError: the model is not causal.
    """

    def __init__(self, plan: Plan, scaling: Scaling, *, tabor: float, name: str = "surrogate") -> None:
        self.name = name
        self.tabor = tabor
        try:
            compiler = _Compiler(plan, scaling, tabor, name)
        except (KeyError, IndexError, TypeError, AttributeError) as error:
            raise ValueError(f"Expected a plan whose operations and weights fit. Received: {name}, damaged") from error
        self._program = np.array(compiler.program, dtype=np.int64)
        self._weights = np.concatenate(compiler.weights, dtype=np.float32)
        self._values = np.zeros(compiler.values, dtype=np.float32)
        self._state = np.zeros(compiler.states, dtype=np.float32)
        self._motion = np.zeros(MOTION_SIZE)
        names = channel_names(scaling.features)
        self._channels = np.array([(CHANNELS.index(channel), SYMLOG_PASSES[channel]) for channel in names])
        moments = [*zip(scaling.channel_mean, scaling.channel_scale, strict=True), scaling.force]
        self._moments = np.array(moments, dtype=np.float64)
        # Snapshots fit every stream of the same network and Tabor parameter, and no other.
        self._owner = (name, tabor, scaling.dataset_sha256, float(self._weights.sum(dtype=np.float64)))
        usual = default_start_indentation(tabor)
        self._starts = ((1.0 + START_TOLERANCE) * usual, (1.0 - START_TOLERANCE) * usual)
        # Kernels compile, or load, before the first step that somebody waits for.
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
            edge: Whether it is the first or the last point of the dwell, which the caller's plan says.

        Returns:
            The force P / (pi R dgamma), tension positive.

        Raises:
            ValueError: a time that does not advance, NaN or infinity, or motion beyond the bounds of `bem.protocol`;
                the stream stays where it was.

        Warns:
            ExtrapolationWarning: a first step elsewhere than at -pi^(2/3) mu, where all training histories begin.
        """
        motion = self._motion
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
        times, indentations = (np.asarray(values, dtype=np.float64) for values in (times, indentations))
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
            message = f"{self.name} extrapolates beyond its training: {'; '.join(worst(found))}"
            warnings.warn(message, ExtrapolationWarning, stacklevel=3)

    def reset(self) -> None:
        """Forget everything: the next step is a history's first."""
        self._state[:] = 0.0
        self._motion[:] = 0.0

    def snapshot(self) -> Snapshot:
        """Return the state as it is now, to try what a plan would do and come back."""
        return Snapshot(self._state.copy(), self._motion.copy(), self._owner)

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot, taken of this stream or of another one of the same model and Tabor parameter.

        Raises:
            ValueError: it was taken of another model or at another Tabor parameter.
        """
        if not isinstance(snapshot, Snapshot) or snapshot.owner != self._owner:
            raise ValueError(f"Expected a snapshot of {self.name} at tabor={self.tabor:g}. Received: {snapshot!r}")
        self._state[:] = snapshot.state
        self._motion[:] = snapshot.motion


class _Compiler:
    """Lays a plan out in flat vectors; what depends on the Tabor parameter alone is computed here, once."""

    def __init__(self, plan: Plan, scaling: Scaling, tabor: float, name: str) -> None:
        self.plan = plan
        self.program: list[list[int]] = []
        self.weights: list[np.ndarray] = []
        self.values = len(channel_names(scaling.features))
        self.states = 0
        self._used = 0
        self._where = {SEQUENCE: (0, self.values)}
        self._known = {TABOR: scaling.scale_tabor(np.array([tabor]))[0]}
        for operation in plan.operations:
            if all(source in self._known for source in operation.inputs):
                self._known[operation.name] = self._evaluate(operation)
            elif operation.kind in KINDS:
                self._place(operation)
            else:
                raise ValueError(
                    f"Expected a causal model, which sees no step before it is taken. "
                    f"Received: {name}, whose {operation.name!r} looks at the whole history; use `predict`"
                )
        if self._where[plan.output][1] != 1:
            raise ValueError(f"Expected a plan that ends in one force. Received: {name}, damaged")

    def _check_shapes(self, operation: Operation, row: dict[str, int], sizes: list[int]) -> None:
        """Kernels trust a program; a damaged plan must not make them read beyond their arrays."""
        into, out, points = row["width_in"], row["width"], row["points"]
        expected = {
            "add": [],
            "append": [1],
            "convolve": [points * into * out, out],
            "dense": [into * out, out],
            "lstm": [4 * out * into, 4 * out * out, 4 * out],
            "mix": [2],
            "modulate": [out, out],
            "normalise": [out, out, 1],
            "relu": [],
        }[operation.kind]
        widths = [self._where[source][1] for source in operation.inputs if source in self._where]
        if operation.kind == "convolve" and row["dilation"] < 1:
            raise ValueError(f"Expected a dilation of at least one in {operation.name!r}. Received: {row['dilation']}")
        if sizes != expected or any(width != into for width in widths):
            raise ValueError(f"Expected weights that fit operation {operation.name!r}. Received: sizes {sizes}")

    def _weight(self, operation: Operation, key: str) -> np.ndarray:
        return self.plan.weights[f"{operation.name}/{key}"]

    def _evaluate(self, operation: Operation) -> np.ndarray:
        (x,) = (self._known[source] for source in operation.inputs)
        if operation.kind == "dense":
            return x @ self._weight(operation, "kernel") + self._weight(operation, "bias")
        if operation.kind == "relu":
            return np.maximum(x, np.float32(0.0))
        powers = np.exp(x - x.max())
        return powers / powers.sum()

    def _place(self, operation: Operation) -> None:
        sources = [self._where[source] for source in operation.inputs if source in self._where]
        constants = [self._known[source] for source in operation.inputs if source in self._known]
        (first, width_in), second = sources[0], sources[-1][0]
        arrays, width, states, points, dilation = constants, width_in, 0, 0, 0
        scratch = 0
        if operation.kind == "append":
            width = width_in + 1
        elif operation.kind == "dense":
            kernel = self._weight(operation, "kernel")
            arrays, width = [kernel.T, self._weight(operation, "bias")], kernel.shape[1]
        elif operation.kind == "lstm":
            width = self._weight(operation, "R").shape[-1]
            both = self._weight(operation, "B").reshape(2, -1)
            arrays = [self._weight(operation, "W"), self._weight(operation, "R"), both.sum(axis=0)]
            states, scratch = 2 * width, 4 * width
        elif operation.kind == "normalise":
            epsilon = np.array([operation.options["epsilon"]])
            arrays = [self._weight(operation, "gamma"), self._weight(operation, "beta"), epsilon]
        elif operation.kind == "convolve":
            kernel = self._weight(operation, "kernel")
            width, _, points = kernel.shape
            dilation = int(operation.options["dilation"])
            arrays = [kernel.transpose(2, 0, 1), self._weight(operation, "bias")]
            states = ((points - 1) * dilation + 1) * width_in
        row = {
            "kind": KINDS.index(operation.kind),
            "first": first,
            "second": second,
            "result": self.values,
            "width_in": width_in,
            "width": width,
            "weights": self._used,
            "state": self.states,
            "points": points,
            "dilation": dilation,
        }
        self._check_shapes(operation, row, [np.size(values) for values in arrays])
        self.program.append([row[column] for column in COLUMNS])
        self._where[operation.name] = (self.values, width)
        flat = [np.ravel(np.ascontiguousarray(values, dtype=np.float32)) for values in arrays]
        self.weights += flat
        self._used += sum(values.size for values in flat)
        self.values += width + scratch
        self.states += states

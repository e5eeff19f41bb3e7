"""Step-by-step prediction for control loops: a causal model carried along as the sphere moves.

The result equals the prediction of the whole sequence to rounding. A step of M1-concat takes a few tens of microseconds
(`make bench-stream` measures it) and allocates no array. M5 looks at the whole history and cannot stream.

Example:
    >>> import surrogate
    >>> stream = surrogate.load("M1-concat").stream(tabor=1.0)  # doctest: +SKIP
    >>> stream.step(0.0, -2.1), stream.step(0.02, -2.0)  # doctest: +SKIP

The model learned from about 120 points a history; how a plan should be divided into steps is said in `docs/control.md`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from surrogate.features import channel_names
from surrogate.kernels import CHANNELS, COLUMNS, KINDS, MOTION_SIZE, STEPS, TIME, advance
from surrogate.plan import SEQUENCE, TABOR, Operation, Plan
from surrogate.scaling import SYMLOG_PASSES, Scaling


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
        compiler = _Compiler(plan, scaling, tabor, name)
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
        # Kernels compile, or load, before the first step that somebody waits for.
        self.step(0.0, 0.0)
        self.reset()

    @property
    def time(self) -> float:
        """Time of the latest step; minus infinity before the first."""
        return float(self._motion[TIME]) if self._motion[STEPS] else -math.inf

    def step(self, time: float, indentation: float, edge: bool = False) -> float:
        """Advance to a new point and return the force there.

        Args:
            time: Its time, after that of the step before.
            indentation: Its indentation.
            edge: Whether it is the first or the last point of the dwell, which the caller's plan says.

        Returns:
            The force P / (pi R dgamma), tension positive.

        Raises:
            ValueError: a time that does not advance, NaN or infinity; the stream stays where it was.
        """
        if not (math.isfinite(time) and math.isfinite(indentation)):
            raise ValueError(f"Expected a finite step. Received: time={time!r}, indentation={indentation!r}")
        if self._motion[STEPS] and time <= self._motion[TIME]:
            raise ValueError(f"Expected a time after {self.time!r}, that of the step before. Received: time={time!r}")
        return advance(
            self._program,
            self._weights,
            self._values,
            self._state,
            self._motion,
            self._channels,
            self._moments,
            float(time),
            float(indentation),
            1.0 if edge else 0.0,
        )

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
        self.program.append([row[column] for column in COLUMNS])
        self._where[operation.name] = (self.values, width)
        flat = [np.ravel(np.ascontiguousarray(values, dtype=np.float32)) for values in arrays]
        self.weights += flat
        self._used += sum(values.size for values in flat)
        self.values += width + scratch
        self.states += states

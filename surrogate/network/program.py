"""Program for the compiled kernels: a graph as rows of integers, with weights, results and states in flat vectors."""

from __future__ import annotations

import numpy as np

from surrogate.data.features import channel_names
from surrogate.data.scaling import Scaling
from surrogate.network.graph import SEQUENCE, TABOR, Graph, Operation
from surrogate.network.kernels import COLUMNS, KINDS

CACHE_LINE = 16
"""Numbers of float32 in a cache line. Matrices that begin on one are read faster."""


def aligned(values: np.ndarray) -> np.ndarray:
    """Return a copy of a flat float32 array that begins on a cache line."""
    room = np.empty(values.size + CACHE_LINE, dtype=np.float32)
    begin = -(room.ctypes.data // room.itemsize) % CACHE_LINE
    found = room[begin : begin + values.size]
    found[:] = values
    return found


class Program:
    """Program of a graph for one Tabor parameter.

    Operations that depend on the Tabor parameter only are evaluated here, once.

    Args:
        graph: The network.
        scaling: The scaling of its training set.
        tabor: The Tabor parameter.
        name: Name of the model in messages.

    Attributes:
        rows: Operations; each is a list of the integers of `surrogate.network.kernels.COLUMNS`.
        weights: Flat float32 arrays, which the caller concatenates; those of an operation begin on a cache line.
        values: Length of the vector of values, work arrays included.
        states: Length of the vector of states.

    Raises:
        ValueError: the model is not causal, or the graph is damaged.
    """

    def __init__(self, graph: Graph, scaling: Scaling, tabor: float, name: str) -> None:
        self.rows: list[list[int]] = []
        self.weights: list[np.ndarray] = []
        self.states = 0
        self._graph = graph
        self._used = 0
        try:
            self.values = len(channel_names(scaling.features))
            self._where = {SEQUENCE: (0, self.values)}
            self._known = {TABOR: scaling.scale_tabor(np.array([tabor]))[0]}
            for operation in graph.operations:
                if all(source in self._known for source in operation.inputs):
                    self._known[operation.name] = self._evaluate(operation)
                elif operation.kind in KINDS:
                    self._place(operation)
                else:
                    raise ValueError(
                        f"Expected a causal model, whose force does not depend on later steps; use `predict`. "
                        f"Received: {name}, whose {operation.name!r} needs the whole history"
                    )
            if self._where[graph.output][1] != 1:
                raise ValueError(f"Expected a network that ends in one force. Received: {name}, damaged")
        except (KeyError, IndexError, TypeError, AttributeError) as error:
            raise ValueError(f"Expected operations and weights that fit. Received: {name}, damaged") from error

    def _check_shapes(self, operation: Operation, row: dict[str, int], sizes: list[int]) -> None:
        """Check the sizes of weights and inputs, because the kernels do not check the bounds of arrays."""
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
        return self._graph.weights[f"{operation.name}/{key}"]

    def _evaluate(self, operation: Operation) -> np.ndarray:
        (x,) = (self._known[source] for source in operation.inputs)
        if operation.kind == "dense":
            return x @ self._weight(operation, "kernel") + self._weight(operation, "bias")
        if operation.kind == "relu":
            return np.maximum(x, np.float32(0.0))
        exponentials = np.exp(x - x.max())
        return exponentials / exponentials.sum()

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
        gap = -self._used % CACHE_LINE
        self.weights.append(np.zeros(gap, dtype=np.float32))
        self._used += gap
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
        self.rows.append([row[column] for column in COLUMNS])
        self._where[operation.name] = (self.values, width)
        flat = [np.ravel(np.ascontiguousarray(values, dtype=np.float32)) for values in arrays]
        self.weights += flat
        self._used += sum(values.size for values in flat)
        self.values += width + scratch
        self.states += states

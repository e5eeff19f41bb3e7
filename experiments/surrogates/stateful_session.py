"""An ONNX Runtime session that keeps the states of a network between its steps, on one thread."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from experiments.surrogates.one_step_model import INPUT
from surrogate.network.onnx_file import session_of

if TYPE_CHECKING:
    import onnxruntime

TYPES = {"tensor(float)": np.float32, "tensor(double)": np.float64}


class StatefulSession:
    """A session of a file of `experiments.surrogates.one_step_model`.

    Args:
        content: The ONNX file.
        bound: Whether inputs and outputs are bound to fixed memory, so that a step copies no state: two bindings take
            turns, and each writes the states that the other one reads. Otherwise each step is an ordinary `run`.
        initial: Initial values of states; the others are zero.
    """

    def __init__(self, content: bytes, *, bound: bool, initial: Mapping[str, float] | None = None) -> None:
        self._session = session_of(content)
        taken = {one.name: np.zeros(one.shape, dtype=TYPES[one.type]) for one in self._session.get_inputs()}
        force = self._session.get_outputs()[0]
        self._inputs, self._force = taken.pop(INPUT), np.zeros(force.shape, dtype=TYPES[force.type])
        self.width = self._inputs.shape[-1]
        self._initial = dict(initial or {})
        self._states = [taken, {name: np.zeros_like(values) for name, values in taken.items()}]
        self._bindings = [self._binding(*self._states[::way]) for way in (1, -1)] if bound else []
        self._next = [one.name.removesuffix("/next") for one in self._session.get_outputs()[1:]]
        self.reset()

    def reset(self) -> None:
        """Set all states to their initial values: the next step is the first one of a history."""
        for name, values in self._states[0].items():
            values[:] = self._initial.get(name, 0.0)
        self._turn = 0
        self._feed = {INPUT: self._inputs, **self._states[0]}

    def step(self, inputs: np.ndarray) -> float:
        """Advance by the inputs, of the shape that the file states, and return the force."""
        if self._bindings:
            self._inputs[:] = inputs
            self._session.run_with_iobinding(self._bindings[self._turn])
            self._turn = 1 - self._turn
            return self._force.item(0)
        feed = self._feed
        feed[INPUT] = inputs
        force, *states = self._session.run(None, feed)
        for name, state in zip(self._next, states, strict=True):
            feed[name] = state
        return force.item(0)

    def _binding(self, before: Mapping[str, np.ndarray], after: Mapping[str, np.ndarray]) -> onnxruntime.IOBinding:
        found = self._session.io_binding()
        arrays = {INPUT: self._inputs, "force": self._force, **before}
        arrays |= {f"{name}/next": values for name, values in after.items()}
        for ends, bind in (
            (self._session.get_inputs(), found.bind_input),
            (self._session.get_outputs(), found.bind_output),
        ):
            for one in ends:
                values = arrays[one.name]
                bind(one.name, "cpu", 0, values.dtype.type, values.shape, values.ctypes.data)
        return found

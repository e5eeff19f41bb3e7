"""Trained network as a graph of elementary operations with named weights.

`surrogate.network.lowering` lowers a Keras model to a graph of eleven kinds of operation. The ONNX export
(`surrogate.export`) implements all of them, the streaming kernels (`surrogate.network.kernels`) those of causal models.
Neither needs Keras for it.

==============  ============================================  =====================================================
kind            weights                                       result
==============  ============================================  =====================================================
``append``                                                    the sequence with the Tabor parameter as last channel
``dense``       ``kernel`` (in, out), ``bias``                an affine map at each step
``lstm``        ``W`` (1, 4H, in), ``R`` (1, 4H, H), ``B``    hidden states; gates in ONNX order: i, o, f, c
``normalise``   ``gamma``, ``beta``                           layer normalisation; option ``epsilon``
``convolve``    ``kernel`` (out, in, points), ``bias``        a causal convolution; option ``dilation``
``relu``                                                      max(x, 0)
``softmax``                                                   a softmax over the last axis
``add``                                                       the sum of two sequences
``modulate``                                                  the first input times the second plus the third
``mix``                                                       the sum of two sequences with two weights
``attend``      ``kernel_q`` .. ``bias_out``                  full self-attention; options ``heads``, ``key_dim``
==============  ============================================  =====================================================
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

SEQUENCE, TABOR = "sequence", "tabor"


def lstm_weights(kernel: np.ndarray, recurrent: np.ndarray, bias: np.ndarray) -> dict[str, np.ndarray]:
    """Return the weights of the operation `lstm` from those of Keras, which orders the gates i, f, c, o."""
    units = len(recurrent)
    order = np.concatenate([np.arange(units) + units * block for block in (0, 3, 1, 2)])
    kernel, recurrent, bias = (values[..., order] for values in (kernel, recurrent, bias))
    return {"W": kernel.T[None], "R": recurrent.T[None], "B": np.concatenate([bias, np.zeros_like(bias)])[None]}


@dataclass(frozen=True)
class Operation:
    """One elementary operation.

    Args:
        kind: One of the kinds in the table of the module.
        name: Name of the result; a weight has the name `NAME/KEY`.
        inputs: Names of the results that are its inputs.
        options: Options of the kind.
    """

    kind: str
    name: str
    inputs: tuple[str, ...]
    options: dict[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as a dictionary, ready for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Operation:
        """Return the operation of a dictionary of `as_dict`."""
        return cls(content["kind"], content["name"], tuple(content["inputs"]), dict(content["options"]))


@dataclass
class Graph:
    """A network. Its inputs are `SEQUENCE` and `TABOR`, its output is the result of the last operation.

    Args:
        operations: Operations in the order of their evaluation.
        weights: Weights by name, float32 arrays.
    """

    operations: list[Operation] = field(default_factory=list)
    weights: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def output(self) -> str:
        """Name of the result, the scaled force of shape `(batch, steps, 1)`."""
        return self.operations[-1].name

    def add(
        self, kind: str, name: str, inputs: list[str], weights: dict[str, Any] | None = None, **options: Any
    ) -> str:
        """Append an operation and return its name."""
        self.operations.append(Operation(kind, name, tuple(inputs), options))
        for key, values in (weights or {}).items():
            self.weights[f"{name}/{key}"] = np.ascontiguousarray(values, dtype=np.float32)
        return name
